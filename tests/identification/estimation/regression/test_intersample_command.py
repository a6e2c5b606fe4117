"""A command between the samples of a log that is slower than the drive's loop."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array, BoolArray
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regression.intersample_command import (
    between_samples,
    share_between,
    unseen,
)
from identification.estimation.regression.weighted_rows import Rows
from identification.log import Log, Rig

H, SECONDS = 2e-3, 40.0  # of a sample, of a log [s]
M, F_C, F_V = 2.0, 5.0, 10.0
RIG = Rig("motor", force_per_command=1.0)


def driven(
    R: int, chatter: float = 0.0, ripple: float = 0.0, slow: float = 0.0, noise: float = 3e-7
) -> tuple[Log, Array]:
    """A body under a loop of R periods a sample, and its mean force over every sample.

    chatter [N]: of the loop, white from period to period; ripple [N]: a force along the stroke;
    slow [N]: friction that is gone at 50 mm/s; noise [m]: of the position.
    The acceleration is constant over a period, so the motion is exact.
    """
    n, tick = round(SECONDS / H), H / R
    t = tick * np.arange(n * R)
    a = sum(
        size * w * np.cos(w * t + phase)
        for size, w, phase in ((0.2, 4.0, 0.3), (0.1, 11.0, 1.0), (0.06, 29.0, 2.0))
    )
    a = a + chatter / M * np.random.default_rng(R).standard_normal(len(t))
    v = np.concatenate([[0.0], tick * np.cumsum(a - np.mean(a))])
    y = np.concatenate([[0.0], np.cumsum(tick * (v[:-1] + 0.5 * np.diff(v)))])
    middle = 0.5 * (v[1:] + v[:-1])
    F = M * np.diff(v) / tick + F_C * np.sign(middle) + F_V * middle
    F += ripple * np.sin(400.0 * y[:-1])
    F += slow * np.sign(middle) * np.exp(-np.abs(middle) / 0.01)
    shown = y[:-1:R] + noise * np.random.default_rng(1).standard_normal(n)
    signals = {"t": H * np.arange(n), "y": shown, "u": F[::R], "F": F[::R]}
    return Log("driven", signals), F.reshape(n, R).mean(axis=1)


def smooth(log: Log) -> BoolArray:
    """Samples (n,) without a reversal near, at which friction jumps."""
    turns = np.diff(np.sign(np.gradient(log["y"])), append=0.0) != 0
    return ~np.convolve(turns, np.ones(9), "same").astype(bool)


@pytest.mark.parametrize(("R", "share"), [(1, 0.0), (2, 0.25), (4, 0.375), (16, 0.46875)])
def test_the_share_is_that_of_the_loops_periods_in_a_sample(R: int, share: float) -> None:
    recorded = recorded_logs([driven(R)[0]], RIG)
    assert recorded.share == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("R", [1, 2, 4])
def test_a_coarse_position_moves_no_share(R: int) -> None:
    """The wide windows that it needs have a mean velocity without the bias of a smoothed one, which
    goes with the force's rate: 0.09 of the step."""
    recorded = recorded_logs([driven(R, noise=1e-4)[0]], RIG)
    assert recorded.share == pytest.approx((R - 1) / (2 * R), abs=0.03)


def test_a_share_that_is_not_significant_is_as_unsure_as_it_is_large() -> None:
    recorded = recorded_logs([driven(16, noise=2e-3)[0]], RIG)
    assert recorded.share == 0.0 and recorded.share_sd > 0.15


def test_a_share_below_none_makes_the_instants_unsure() -> None:
    """No loop has one: what was found says how far off the equation is, and was taken for sure."""
    rng, n = np.random.default_rng(5), 400
    X, rate = rng.standard_normal((n, 2)), rng.standard_normal(n)
    blank = np.ones(n)
    b = X @ np.array([2.0, 1.0]) + 0.25 * rate + 0.05 * rng.standard_normal(n)
    rows = Rows(b, X, 0.05 * blank, np.arange(n) // 50, blank, ("m", "F"))
    found = share_between(rows, rate, by_motor=True)
    assert found.value == 0.0 and found.sd == pytest.approx(0.25, abs=0.03)


@pytest.mark.parametrize("later", [0.03, 0.1])
def test_positions_a_part_of_a_sample_behind_hide_no_force(later: float) -> None:
    """As semi-implicit steps of a simulation put them: no loop is faster than the log."""
    log = driven(1, chatter=0.5)[0]
    y = np.asarray(log["y"])
    moved = log.with_signals(y=y + later * np.append(np.diff(y), 0.0))
    recorded = recorded_logs([moved], RIG)
    assert recorded.share == pytest.approx(later, abs=0.01)
    assert recorded.logs[0].noise.between == 0.0 and recorded.command_period is None
    assert not recorded.may_change_between
    assert any("behind the steps" in said for said in recorded.remarks)


def test_slow_motion_that_friction_does_not_explain_hides_no_share() -> None:
    recorded = recorded_logs([driven(4, slow=5.0)[0]], RIG)
    assert recorded.share == pytest.approx(0.375, abs=0.03)


@pytest.mark.parametrize("R", [2, 4, 50])
def test_the_mean_of_a_command_that_bends_is_exact(R: int) -> None:
    s = np.arange(40 * R) / R
    u = 1.0 + 0.3 * s - 0.02 * s**2
    t: Array = H * np.arange(40, dtype=np.float64)
    signals = {"t": t, "y": np.zeros(40), "u": u[::R]}
    log = Log("bends", signals)
    found = between_samples(log, (R - 1) / (2 * R), zoh=False)
    mean = u.reshape(40, R).mean(axis=1)
    assert found["u"][1:-2] == pytest.approx(mean[1:-2], rel=1e-12)


def test_what_acts_at_a_place_is_no_part_of_the_command_between_the_samples() -> None:
    """A tenth of gravity's step, taken for the command's, was 1 % of viscous friction, six of its
    deviations, of a rod in MuJoCo."""
    plain, _ = driven(4)
    pull = 0.5 * np.sin(9.0 * plain["t"])
    pulled = plain.with_signals(F=plain["F"] + pull, u=plain["u"] + pull)
    known = between_samples(replace(pulled, of_place=pull), 0.375, True)
    alone = between_samples(plain, 0.375, True)
    for key in ("F", "u"):
        assert known[key] == pytest.approx(alone[key] + pull, abs=1e-3)
    assert known.part(10, 20).of_place == pytest.approx(pull[10:20])


@pytest.mark.parametrize("R", [2, 8])
def test_the_logs_have_the_mean_force_until_the_next_sample(R: int) -> None:
    log, mean = driven(R)
    found = recorded_logs([log], RIG)
    slides = smooth(log)
    was = np.std((log["F"] - mean)[slides])
    now = np.std((found.logs[0].log["F"] - mean)[slides])
    assert now < 0.1 * was
    # A log that is read later is taken in the same way, and no log is changed.
    again = found.given(log)
    assert np.array_equal(again.log["F"], found.logs[0].log["F"])
    assert again.noise.F == found.logs[0].noise.F
    assert log["F"][0] != again.log["F"][0]


@pytest.mark.parametrize("chatter", [0.0, 0.5])
@pytest.mark.parametrize("R", [2, 4, 16])
def test_what_the_loop_adds_between_the_samples_is_noise(R: int, chatter: float) -> None:
    """The jumps of the force where friction turns with it: of them no parabola knows."""
    share = (R - 1) / (2 * R)
    log, mean = driven(R, chatter)
    means = between_samples(log, share, zoh=True)
    true = float(np.std(means["F"] - mean))
    assert true < unseen(means, share) < 1.6 * true
    assert unseen(log, 0.0) == 0.0


def test_where_an_effect_is_missing_the_commands_rate_is_no_share() -> None:
    assert recorded_logs([driven(2, ripple=3.0)[0]], RIG).share == 0.0


def test_a_measured_force_is_that_of_its_sample() -> None:
    found = recorded_logs([driven(4)[0]], Rig("force"), "force")
    assert found.share == 0.0
    assert found.logs[0].noise.between == 0.0


def behind_valve(R: int, chatter: float = 0.0) -> Log:
    """A cylinder whose force follows a command of R periods a sample, that steps between them."""
    n, tick = round(SECONDS / H), H / R
    t = tick * np.arange(n * R)
    u = sum(np.sin(w * t + w) for w in (3.0, 8.0, 21.0))
    u = u + chatter * np.random.default_rng(R).standard_normal(len(t))
    y = 0.05 * np.sin(2.0 * t)
    F = 900.0 * tick * np.concatenate([[0.0], np.cumsum(u)[:-1]]) - 4000.0 * (y - y[0])
    rng = np.random.default_rng(2)
    signals = {"t": t[::R], "u": u[::R], "F": F[::R] + 0.05 * rng.standard_normal(n)}
    signals["y"] = y[::R] + 1e-6 * rng.standard_normal(n)
    return Log("behind valve", signals)


CYLINDER = Rig("electro-pneumatic", area_p=1e-3, area_n=1e-3, supply_pressure=6e5)


@pytest.mark.parametrize(("R", "share"), [(1, 0.0), (2, 0.25), (8, 0.4375)])
@pytest.mark.parametrize("chatter", [0.0, 0.05])
def test_the_share_shows_behind_an_actuator_too(R: int, share: float, chatter: float) -> None:
    log = behind_valve(R, chatter)
    found = recorded_logs([log], CYLINDER, "command")
    assert found.share == pytest.approx(share, abs=0.03)
    assert np.array_equal(found.logs[0].log["F"], log["F"])  # that is measured


@pytest.mark.parametrize("R", [1, 2, 8])
def test_what_the_loop_adds_between_the_samples_drifts(R: int) -> None:
    """One sample of the command has been logged, and so many more were not."""
    log = behind_valve(R, chatter=0.05)
    found = recorded_logs([log], CYLINDER, "command").logs[0]
    tick = H / R
    unlogged = 900.0 * tick * 0.05 * np.sqrt((R - 1) + (R - 1) ** 2)
    assert found.noise.random_walk == pytest.approx(unlogged, rel=0.35, abs=2e-4)
