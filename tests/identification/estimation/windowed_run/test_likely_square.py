"""The likelihood of many plants at once is that of each by its own run, whatever drives it."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.likelihood import LikelyWindows
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.parameters import names_of, plant_with, values_of
from identification.estimation.windowed_run.run_errors import loss
from identification.estimation.windowed_run.windows import longest_window, window_errors, window_run
from identification.log import Rig
from identification.model.estimates import Drive
from identification.model.plant import Motor, Plant
from tests.identification.estimation.test_fit_motor import K_A, SERVO, motor_log
from tests.identification.plants import ACTUATOR, made_log, table

MEMBERS = 21  # more than a block, and no multiple of one


@cache
def posed(case: str) -> LikelyWindows:
    """A log in windows, driven as the case says, at its true plant."""
    if case == "motor":
        recorded = recorded_logs([motor_log(seconds=6.0)], Rig("motor", force_per_command=K_A))
        plant = Plant(SERVO, Motor(K_A))
    else:
        drive: Drive = "force" if case == "force" else "command"
        recorded = recorded_logs([made_log(table(2), seed=3, seconds=6.0)], Rig("force"), drive)
        plant = Plant(table(2), None if case == "force" else ACTUATOR)
    logs = recorded.logs
    if case == "corrected":
        logs = tuple(replace(one, noise=replace(one.noise, random_walk=3e-3)) for one in logs)
        assert all(0.1 < one.noise.corrected < 0.5 for one in logs)
    names = names_of(plant, recorded.drive)
    size = 0.003 * np.abs(values_of(plant, names))
    seconds = longest_window(plant, logs, recorded.drive)
    return LikelyWindows.of(plant, logs, recorded.drive, names, np.diag(size**2), seconds)


def around(windows: LikelyWindows, size: float) -> Array:
    """Parameter values (MEMBERS, d) about the truth."""
    shape = MEMBERS, len(windows.names)
    drawn = np.random.default_rng(4).uniform(-size, size, shape)
    return np.asarray(windows.center * (1.0 + drawn))


def by_itself(windows: LikelyWindows, x: Array) -> float:
    """`README.md`, (5) of the estimation, as it is written."""
    plant, total = plant_with(windows.plant, windows.names, x), 0.0
    for one, own in zip(windows.logs, windows.found, strict=True):
        run = window_run(plant, one, windows.drive, own.begun)
        assert run is not None
        r = own.weight * window_errors(run, one, windows.drive)
        ends = [*own.begun.at.tolist(), len(one.log)]
        for w, (low, high) in enumerate(pairwise(ends)):
            B = own.B[:, :, low:high]
            z = own.inverse[w] @ np.einsum("ikn,kn->i", B, r[:, low:high])
            total += loss(r[:, low:high] - np.einsum("ikn,i->kn", B, z)) + float(z @ z)
    return total


@pytest.mark.parametrize("case", ["command", "corrected", "force", "motor"])
def test_each_of_many_plants_is_as_likely_as_by_itself(case: str) -> None:
    windows = posed(case)
    members = around(windows, 0.05)
    found = windows.squares(members)
    expected = [by_itself(windows, x) for x in members]
    assert np.ptp(expected) > 1.0
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("case", ["command", "corrected", "force", "motor"])
def test_runs_from_outside_are_as_likely_as_those_of_the_lanes(
    case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    windows = posed(case)
    members = around(windows, 0.05)
    found = windows.squares(members)
    lost = members[2].copy()

    def run_of(tried: Plant, one: MotionLog, *others: object) -> object:
        here = np.allclose(values_of(tried, windows.names), lost)
        return None if here else window_run(tried, one, *others)  # type: ignore[arg-type]

    for log, own, likely in zip(windows.logs, windows.found, windows.likely, strict=True):
        monkeypatch.setattr("identification.estimation.likelihood.window_run", run_of)
        shown = likely.shown(windows._runs(members[:16], log, own))
    assert shown[2] == np.inf
    kept = np.arange(16) != 2
    assert shown[kept] == pytest.approx(found[:16][kept], rel=1e-9, abs=1e-6)


def test_what_is_far_off_is_unlikely_and_still_a_number() -> None:
    windows = posed("command")
    far = windows.center * 1.5
    assert np.all(np.isfinite(windows.squares(far[np.newaxis])))
    assert windows.squares(far[np.newaxis])[0] == pytest.approx(by_itself(windows, far), rel=1e-9)
    assert windows.squares(np.full((1, len(far)), np.nan))[0] == np.inf
