"""Is each number that decides noticed by its test? Halved and doubled in turn, everywhere it is.

    python benchmarks/threshold_mutants.py

For every constant of `identification/thresholds.py`: its test in
`tests/identification/test_thresholds.py` is run as it is, with half of it and with twice it. Exit
status 1 where a mutant passes.
"""

import importlib
import pkgutil
import subprocess
import sys
from types import ModuleType

import pytest

import identification
from identification import thresholds

FILE = "tests/identification/test_thresholds.py"
FACTORS = (0.5, 2.0)


class Mutation:
    """Sets a constant in every module that names it, before the tests are collected."""

    def __init__(self, name: str, factor: float) -> None:
        self.name, self.factor = name, factor

    def pytest_sessionstart(self) -> None:
        """Loads the whole package, so that no module comes by the constant afterwards."""
        modules: list[ModuleType] = [thresholds]
        for found in pkgutil.walk_packages(identification.__path__, "identification."):
            modules.append(importlib.import_module(found.name))
        value = getattr(thresholds, self.name)
        for module in modules:
            if self.name in vars(module):
                setattr(module, self.name, type(value)(self.factor * value))


def passes(name: str, factor: float) -> bool:
    """Whether the constant's test passes with so many times its value, in a process of its own."""
    given = [sys.executable, __file__, name, str(factor)]
    return subprocess.run(given, check=False, capture_output=True).returncode == 0


def main() -> None:
    if len(sys.argv) == 3:
        name, factor = sys.argv[1], float(sys.argv[2])
        asked = ["-q", "-x", "-p", "no:cacheprovider", f"{FILE}::test_{name.lower()}"]
        sys.exit(pytest.main(asked, plugins=[Mutation(name, factor)]))
    names = [name for name in vars(thresholds) if name.isupper()]
    missed = 0
    for name in names:
        caught = [not passes(name, factor) for factor in FACTORS]
        sound = passes(name, 1.0) and all(caught)
        missed += not sound
        print(f"{name:20s} {'caught' if sound else f'MISSED {caught}'}", flush=True)
    print(f"{len(names) - missed} of {len(names)} noticed both ways")
    sys.exit(int(missed > 0))


if __name__ == "__main__":
    main()
