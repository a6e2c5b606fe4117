"""A position sensor that sticks; the other refusals are tested with the stages that call them."""

import numpy as np
import pytest

from identification.errors import BadLog, NotIdentifiable
from identification.log import Log, Rig
from identification.signals.check import check, check_driven


def test_a_noisy_position_that_sticks_is_refused() -> None:
    rng = np.random.default_rng(3)
    t = 0.01 * np.arange(2000, dtype=np.float64)
    y = 0.1 * np.sin(t) + 1e-5 * rng.standard_normal(2000)
    stuck = y.copy()
    stuck[500:700] = stuck[500]
    with pytest.raises(BadLog, match=r"for 200 samples from row 501 \(1 such"):
        check(Log("made", {"t": t, "y": stuck}), Rig("force"))
    check(Log("made", {"t": t, "y": y}), Rig("force"))


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_rest_is_no_fault_without_noise_or_with_counts(noise: float) -> None:
    rng = np.random.default_rng(3)
    t = 0.01 * np.arange(2000, dtype=np.float64)
    y = 0.1 * np.sin(np.maximum(t - 5.0, 0.0)) + noise * rng.standard_normal(2000)
    if noise:
        y = 2e-5 * np.round(y / 2e-5)
    check(Log("made", {"t": t, "y": y}), Rig("force"))


def test_a_force_that_hardly_changes_while_the_body_goes_both_ways_is_refused() -> None:
    t = 0.01 * np.arange(1000, dtype=np.float64)
    y, F = 0.1 * np.sin(t), np.cos(t)
    check_driven([Log("a", {"t": t, "y": y, "F": F})])
    check_driven([Log("a", {"t": t, "y": y, "F": 50.0 + F})])
    check_driven([Log("a", {"t": t, "y": 0.1 * t, "F": 300.0 + F})])
    for level in (300.0, -300.0):
        with pytest.raises(BadLog, match="so something else drives it; check the units"):
            check_driven([Log("a", {"t": t, "y": y, "F": level + F})])


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        ((1.0,), r"constant \(1\)"),
        ((1.0, -0.8), r"constant \(1 and -0.8\)"),
        ((1.0, 1.0), r"constant \(1\)"),
        ((1.0, 0.8), ""),
        ((1.0, -1.0, -0.8), ""),
    ],
)
def test_steps_of_force_are_refused_where_friction_may_be_all_of_them(
    steps: tuple[float, ...], said: str
) -> None:
    t = 0.01 * np.arange(200, dtype=np.float64)
    logs = [Log(f"of {F:g}", {"t": t, "y": F * t**2, "F": np.full(200, F)}) for F in steps]
    if not said:
        check_driven(logs)
        return
    with pytest.raises(NotIdentifiable, match=f"of 1: the applied force is {said}, so friction"):
        check_driven(logs)


@pytest.mark.parametrize(("by", "period"), [(1e-9, "1e-11"), (1e9, r"1e\+07")])
def test_a_clock_that_no_logger_has_is_refused(by: float, period: str) -> None:
    t = 0.01 * np.arange(1000, dtype=np.float64)
    with pytest.raises(BadLog, match=f"sampled every {period} s.*check the unit of t"):
        check(Log("a", {"t": t * by, "y": np.sin(t), "F": np.cos(t)}), Rig("force"))
