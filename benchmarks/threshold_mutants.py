"""Is each number that decides noticed by its test? Halved and doubled in turn, everywhere it is.

    python benchmarks/threshold_mutants.py

For every constant of `identification/thresholds.py`: its tests in
`tests/identification/test_thresholds.py` are run as it is, with half of it and with twice it. Exit
status 1 where a mutant passes.
"""

import importlib
import os
import pkgutil
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import ModuleType

import pytest

import identification
from identification import thresholds

FILE = "tests/identification/test_thresholds.py"
FACTORS = (0.5, 2.0)


def every_module() -> list[ModuleType]:
    """The whole package, so that no module comes by a constant afterwards."""
    found = pkgutil.walk_packages(identification.__path__, "identification.")
    return [thresholds, *(importlib.import_module(one.name) for one in found)]


def passes(name: str, factor: float, modules: list[ModuleType]) -> bool:
    """Whether the constant's test passes with so many times its value, in a process of its own."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    value = getattr(thresholds, name)
    for module in modules:
        if name in vars(module):
            setattr(module, name, type(value)(factor * value))
    asked = ["-q", "-x", "-p", "no:cacheprovider", FILE, "-k", f"test_{name.lower()}"]
    with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
        status = int(pytest.main(asked))
    os._exit(status)


def main() -> None:
    names, modules = [name for name in vars(thresholds) if name.isupper()], every_module()
    missed = 0
    for name in names:
        caught = [not passes(name, factor, modules) for factor in FACTORS]
        sound = passes(name, 1.0, modules) and all(caught)
        missed += not sound
        print(f"{name:20s} {'caught' if sound else f'MISSED {caught}'}", flush=True)
    print(f"{len(names) - missed} of {len(names)} noticed both ways")
    sys.exit(int(missed > 0))


if __name__ == "__main__":
    main()
