"""What is said of a log is decided by the numbers of `thresholds`, and by no others.

Read off the source: every comparison of a module that decides. A number written into one, or a
constant of the module's own, has to stand below, with what kind it is; the lists may get shorter.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

from tests.test_lengths import ROOT, tree

DECIDING = ("tracing", "drift", "experiment")
ESTIMATION = (
    "converged_fit", "estimates", "fit", "force_hold", "late_position", "prescribed_motion",
    "recorded_logs",
    "regressed_plant", "run_or_equation", "structure_fit",
    "surroundings", "turn_orders", "two_masses",
)  # fmt: skip
# Names of equations, parameters, signals and remarks, and bounds of what a parameter can be.
NO_NUMBERS = {
    "ABSORBED", "ACTUATOR", "AT_REST", "BREAKAWAY", "DELAY", "END_PLACES", "FIVE",
    "GRAVITY", "MECHANICAL", "NAMES", "NEGATIVE", "NO_INFORMATION", "NOT_SIGNALS", "OF_AN_ANGLE",
    "OF_SPEED", "REST", "STUCK", "TURNS", "VISCOUS_NAMES",
}  # fmt: skip
# How many rows, samples or windows a statistic needs to exist at all, and what rounding leaves.
ENOUGH = {
    "CURVE_ROWS", "FEWEST_COMPARED", "FEWEST_OF_DIRECTION", "FEWEST_ROWS", "FEWEST_RUNS",
    "FEWEST_SAMPLES", "FEWEST_WINDOWS", "FEWEST_WINDOWS_OF_A_TURN", "FEW_VALUES", "GRID_PLACES",
    "LEAST_SD", "MANY_ROWS", "OF_EQUATION", "OUTLYING_ROW", "OVERLAPPING",
    "ROWS_IN_PERIOD", "SLIDES", "SLIDING_SAMPLES", "SWINGS",
}  # fmt: skip
# Where a search begins, what it tries and when it ends.
STEER = {
    "FAR_BEYOND", "LAG", "LASTING_SHARE", "LASTING_STEP", "LONG_TIME",
    "SLOW_LOG", "WIDEST_SEEN",
}  # fmt: skip
# What still decides outside of `thresholds`.
ELSEWHERE = {
    "BRAKES", "BY_CHANCE", "INERTIA_SHARE", "RIGID_CONTACT",
    "SECOND_SIGNAL", "SHIFT", "SMALL_TERM",
}  # fmt: skip
LITERALS = {0.5, 1e-300, 3, 50}  # halves, rows of a statistic, and what is not to be divided by
ARGUMENTS = {0.01, 10.0}  # bounds of what `DriftSettings` may be given


def modules() -> list[Path]:
    """Files that decide what is said of a log."""
    room = ROOT / "identification"
    rooms = (path for name in DECIDING for path in (room / name).rglob("*.py"))
    return sorted([*rooms, *(room / "estimation" / f"{name}.py" for name in ESTIMATION)])


def compared(path: Path) -> Iterator[str | float]:
    """Constants not of `thresholds`, and numbers but 0, 1 and 2, in the comparisons of a file."""
    read = tree(path)
    ours = {
        name.name
        for node in read.body
        if isinstance(node, ast.ImportFrom) and node.module == "identification.thresholds"
        for name in node.names
    }
    sides = (
        part
        for node in ast.walk(read)
        if isinstance(node, ast.Compare)
        for side in (node.left, *node.comparators)
        for part in ast.walk(side)
    )
    for part in sides:
        if isinstance(part, ast.Name) and part.id.isupper() and len(part.id) > 1:
            yield from () if part.id in ours else (part.id,)
        number = part.value if isinstance(part, ast.Constant) else None
        if isinstance(number, int | float) and not isinstance(number, bool):
            yield from () if abs(number) in (0, 1, 2) else (number,)


def test_no_number_decides_but_those_of_thresholds() -> None:
    found = {(path.name, one) for path in modules() for one in compared(path)}
    allowed = NO_NUMBERS | ENOUGH | STEER | ELSEWHERE | LITERALS | ARGUMENTS
    assert {(name, one) for name, one in found if one not in allowed} == set()
    assert allowed - {one for _, one in found} == set()  # what is gone goes from the lists too
