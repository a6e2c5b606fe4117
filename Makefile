# make demo | make docs | make test | make bench; needs Python 3.11 or newer (make PYTHON=python3.12 demo).
PYTHON ?= python3
WORKERS ?= 2
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
NEEDED := import sys; v = sys.version_info; v >= (3, 11) or sys.exit( \
	f"Python {v[0]}.{v[1]} found, 3.11 or newer needed: make PYTHON=python3.12 ...")
BENCHMARKS := $(filter-out benchmarks/_%,$(wildcard benchmarks/*.py))

.PHONY: demo test environment lint types floors wheel docs kernels tests bench format clean

demo: $(VENV)/.installed
	$(BIN)/workbench demo

# Two at a time: what one core checks goes on beside what the other compiles and tests.
test: environment
	$(MAKE) --no-print-directory -j 2 lint types floors kernels
	$(MAKE) --no-print-directory -j 2 docs wheel tests

environment: $(VENV)/.installed-dev

$(VENV)/.installed: pyproject.toml constraints.txt
	@$(PYTHON) -c '$(NEEDED)'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) install --constraint constraints.txt hatchling 'setuptools>=70.1'
	$(PIP) install --constraint constraints.txt --no-build-isolation --editable .
	touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(PIP) install --constraint constraints.txt --no-build-isolation --editable '.[dev]'
	touch $@

lint: environment
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: environment
	$(BIN)/mypy

floors: environment
	$(BIN)/lint-imports

wheel: environment
	$(BIN)/python tools/check_wheel.py

kernels: environment
	$(BIN)/python tools/compile_kernels.py

# Runs every command of the pages; -E reads all pages anew, whose outputs are of this code.
docs: environment
	$(BIN)/python -m sphinx -W --keep-going -E -q -d build/doctrees docs build/site
	@echo "the site: build/site/index.html"

tests: environment
	$(BIN)/pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

bench: environment
	@test -n "$(BENCHMARKS)" || echo "no benchmarks/*.py yet"
	@set -e; for file in $(BENCHMARKS); do echo "== $$file"; $(BIN)/python $$file; done

format: environment
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	@test -z "$(wildcard notebooks/*.ipynb)" || $(BIN)/nbstripout $(wildcard notebooks/*.ipynb)

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
