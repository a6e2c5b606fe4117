"""Information by the exact run: what adds up, what noise does to it, and what chance is worth."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.experiment.information import (
    Information,
    information,
    lasting_jacobian,
    rests_of,
    run_errors,
)
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run

H = 2e-3
MOTOR = Plant(Karnopp(10.0, 12.0, 11.0, 60.0, 66.0, 0.01, -0.012, 15.0, -14.0), Motor(35.0))


def pulses(signs: tuple[float, ...], size: float = 0.9) -> tuple[Log, Array]:
    """The motor's run along pulses of its command with rests between, and its velocity."""
    on, off = np.ones(200), np.zeros(250)
    u = np.concatenate([off, *(np.concatenate([s * size * on, off]) for s in signs)])
    t = H * np.arange(len(u), dtype=np.float64)
    blank = Log("pulses", {"t": t, "y": np.zeros(len(u)), "F": 35.0 * u, "u": u})
    run = free_run(MOTOR, blank, (0.0, 0.0, 0.0), "command")
    return blank.with_signals(y=run.y), run.v


def of_run(signs: tuple[float, ...], noise: float = 1e-5, size: float = 0.9) -> Information:
    log, v = pulses(signs, size)
    errors = run_errors(log, log["y"], rests_of(v, H, 0.5), noise, 0.0)
    return information(MOTOR, errors, "command")


def sd_of(*runs: Information) -> dict[str, float]:
    """Relative deviations by runs together."""
    together = replace(runs[0], matrix=np.sum([one.matrix for one in runs], axis=0))
    return dict(zip(together.names, together.deviations.tolist(), strict=True))


def test_half_the_noise_tells_four_times_as_much() -> None:
    assert of_run((1.0, -1.0), 0.5e-5).matrix == pytest.approx(4.0 * of_run((1.0, -1.0)).matrix)


def test_runs_of_their_own_add_up() -> None:
    up, down, both = of_run((1.0,)), of_run((-1.0,)), of_run((1.0, -1.0))
    joined = up.matrix + down.matrix
    size = np.sqrt(np.outer(np.diag(both.matrix), np.diag(both.matrix)))
    assert np.max(np.abs(joined - both.matrix) / size) < 0.02


def test_one_way_says_nothing_of_the_other() -> None:
    sd = sd_of(of_run((1.0, 1.0)))
    for name in ("F_cn", "F_vn", "dv_n", "F_sn"):
        assert sd[name] == np.inf, name
    assert sd["F_cp"] < np.inf


def test_one_pulse_cannot_tell_coulomb_from_mass_as_two_sizes_do() -> None:
    alike = of_run((1.0, 1.0)), of_run((-1.0, -1.0))
    varied = of_run((1.0,)), of_run((-1.0,)), of_run((1.0, -1.0), size=1.6)
    assert sd_of(*varied)["F_vp"] < 0.7 * sd_of(*alike)["F_vp"]


def test_the_bound_is_what_least_squares_scatters_by() -> None:
    log, v = pulses((1.0, -1.0, 1.0, -1.0), 1.2)
    at = rests_of(v, H, 0.5)
    errors = run_errors(log, log["y"], at, 1e-5, 0.0)
    found = information(MOTOR, errors, "command")
    J = np.linalg.cholesky(found.matrix[:5, :5])
    rng = np.random.default_rng(4)
    # Linear least squares on the information's own scale: scatter of the mass over its bound.
    draws = np.linalg.solve(J.T, rng.standard_normal((5, 4000)))[0]
    alone = Information(found.names[:5], found.matrix[:5, :5])
    assert np.std(draws) == pytest.approx(sd_of(alone)["m"], rel=0.05)


def test_what_hangs_on_chance_is_not_counted_on() -> None:
    def fun(x: Array) -> Array:
        smooth = 50.0 * x[0] * np.ones(80)
        jumps = np.where(x[0] > 1.0 + 1e-7, 1e4, 0.0) * np.ones(20)
        return np.concatenate([smooth, jumps])

    J, chaotic = lasting_jacobian(fun, np.array([1.0]), np.inf)
    assert J[:80, 0] == pytest.approx(50.0)
    assert not np.any(J[80:])
    assert chaotic == pytest.approx(0.2)


def test_rests_are_where_the_body_stands() -> None:
    log, v = pulses((1.0, -1.0, 1.0))
    at = rests_of(v, H, 0.3)
    assert at[0] == 0
    assert len(at) > 3
    assert not np.any(v[at[1:]])
    assert np.min(np.diff(at)) >= round(0.3 / H)
    assert len(log) > at[-1]
