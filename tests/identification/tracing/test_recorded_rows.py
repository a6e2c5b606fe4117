"""Which equations a log can show: whether its command makes its force."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.log import Log, Rig
from identification.tracing.recorded_rows import COMMAND_SAYS_LITTLE, recorded_rows

H = 2e-3
RIG = Rig("electro-pneumatic")


def log_of(dead_zone: float, felt: bool) -> Log:
    """A cylinder under a command that chatters within 0.1 V and now and then goes beyond; not felt:
    its force has nothing to do with it."""
    rng = np.random.default_rng(3)
    t: Array = np.asarray(H * np.arange(20000), dtype=np.float64)
    within = np.where(np.sin(2 * np.pi * 4.0 * t) > 0.0, 0.099, -0.099)
    u = within + 0.03 * np.sin(2 * np.pi * 0.5 * t) * (np.sin(2 * np.pi * 0.11 * t) > 0.97)
    y = 1e-4 * np.sin(2 * np.pi * 0.4 * t)
    given = np.sign(u) * np.maximum(np.abs(u) - dead_zone, 0.0)
    pushed = 9000.0 * H * np.cumsum(given) if felt else 40.0 * np.sin(2 * np.pi * 0.7 * t)
    F = pushed - 8000.0 * (y - y[0]) + 0.01 * rng.standard_normal(len(t))
    return Log("cylinder", {"t": t, "y": y + 1e-5 * rng.standard_normal(len(t)), "u": u, "F": F})


@pytest.mark.parametrize(
    ("dead_zone", "felt", "drive"), [(0.0, True, "command"), (0.1, True, "command"),
                                     (0.1, False, "force")],
)  # fmt: skip
def test_a_command_behind_a_dead_zone_makes_the_force_all_the_same(
    dead_zone: float, felt: bool, drive: str
) -> None:
    """Mostly within it, a command explains hardly any of the force as it is."""
    found = recorded_rows([log_of(dead_zone, felt)], RIG)
    assert found.drive == drive
    assert (COMMAND_SAYS_LITTLE in found.remarks) == (drive == "force")
