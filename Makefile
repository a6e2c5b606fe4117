# make demo | make test | make test-all | make docs | make bench | make paper; needs Python 3.11 or newer
# (make PYTHON=python3.12 demo).
PYTHON ?= python3
WORKERS ?= 2
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
PYTEST := $(BIN)/pytest -n $(WORKERS) --no-loadscope-reorder
NEEDED := import sys; v = sys.version_info; v >= (3, 11) or sys.exit( \
	f"Python {v[0]}.{v[1]} found, 3.11 or newer needed: make PYTHON=python3.12 ...")
KERNELS := $(shell find identification design -name '*.py')
BENCHMARKS := $(filter-out benchmarks/_%,$(wildcard benchmarks/*.py))

# Where Python may not keep its bytecode, each of some hundred processes compiles scipy, numba and
# the rest anew: 7 s every time.
export PYTHONDONTWRITEBYTECODE :=

# uv installs five times as fast as pip, which does it where uv cannot.
UV := $(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt
install = $(UV) $(1) 2>/dev/null || $(PIP) install --constraint constraints.txt $(1)

.PHONY: demo test test-all test-method environment lint types floors kernels tests wheel docs slow verdicts \
	bench paper format clean

demo: $(VENV)/.installed
	$(BIN)/workbench demo

# What a change has to pass. Two at a time: types are checked on one core while the other compiles.
test: environment
	$(MAKE) --no-print-directory -j 2 lint floors types kernels
	$(MAKE) --no-print-directory tests

# What `make test` leaves out because it takes long.
test-all: environment
	$(MAKE) --no-print-directory kernels
	$(MAKE) --no-print-directory -j 2 wheel docs
	$(MAKE) --no-print-directory slow
	$(MAKE) --no-print-directory verdicts

environment: $(VENV)/.installed-dev

$(VENV)/.installed: pyproject.toml constraints.txt
	@$(PYTHON) -c '$(NEEDED)'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	-$(PIP) install --constraint constraints.txt uv
	$(call install,hatchling 'setuptools>=70.1')
	$(call install,--no-build-isolation --editable .)
	touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(call install,--no-build-isolation --editable '.[dev]')
	touch $@

lint: environment
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: environment
	$(BIN)/mypy

floors: environment
	$(BIN)/lint-imports

kernels: $(VENV)/.kernels

$(VENV)/.kernels: $(VENV)/.installed-dev $(KERNELS)
	$(BIN)/python tools/compile_kernels.py
	touch $@

tests: environment
	$(PYTEST) --dist loadfile -m "not slow and not verdicts and not method"

wheel: environment
	$(BIN)/python tools/check_wheel.py

# Runs every command of the pages; -E reads all pages anew, whose outputs are of this code.
docs: environment
	$(BIN)/python -m sphinx -W --keep-going -E -q -d build/doctrees docs build/site
	@echo "the site: build/site/index.html"

slow: environment
	$(PYTEST) --dist loadfile --durations 15 -m "slow and not method"

# Traces and fits of many seconds each, and the longer half of the verdicts, for who changes a method.
test-method: environment kernels
	$(PYTEST) --dist worksteal -m "method and not verdicts"
	$(PYTEST) --dist worksteal -m "verdicts and method" tests/verdicts

verdicts: environment
	$(PYTEST) --dist worksteal -m "verdicts and not method" tests/verdicts

bench: environment
	@test -n "$(BENCHMARKS)" || echo "no benchmarks/*.py yet"
	@set -e; for file in $(BENCHMARKS); do echo "== $$file"; $(BIN)/python $$file; done

# The paper in simulation, its figures beside ours: two minutes.
paper: $(VENV)/.installed
	$(BIN)/python -m studies.paper --out runs/paper

format: environment
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	@test -z "$(wildcard notebooks/*.ipynb)" || $(BIN)/nbstripout $(wildcard notebooks/*.ipynb)

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
