"""The inverse model on motions of known friction, and on the measured EMPS axis."""

import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from identification.arrays import Array
from identification.errors import BadLog, NotIdentifiable
from identification.log import Log
from identification.model.inverse_model import (
    SLIDING_NAMES,
    InverseModel,
    Smoothing,
    Viscous,
    fit_inverse,
    force_error,
    force_predicted,
    zoh_force,
)
from identification.model.karnopp import Karnopp, friction
from identification.signals.differentiate import Method

ROOT = Path(__file__).parents[3]
EMPS = Path(os.environ.get("WORKBENCH_DATA") or ROOT.parent / "shared" / "data") / "emps"
REFERENCE: dict[str, Any] = tomllib.loads((ROOT / "tests/reference/emps.toml").read_text())
PUBLISHED = Smoothing(
    cutoff=REFERENCE["procedure"]["cutoff_hz"], factor=REFERENCE["procedure"]["factor"]
)
TRUE = Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.004, -0.004, 20.6, -23.0)
needs_emps = pytest.mark.skipif(
    not (EMPS / "DATA_EMPS.mat").is_file(),
    reason="EMPS logs not found: set WORKBENCH_DATA to the folder that holds emps/",
)


def clock(n: int) -> Array:
    """Times of n samples at 1 kHz [s]."""
    return np.linspace(0.0, 1e-3 * (n - 1), n)


def moving(p: Karnopp, seed: int = 0, noise: float = 1e-6, seconds: float = 20.0) -> Log:
    """A log of a motion of five sines under the force that the model needs for it."""
    rng = np.random.default_rng(seed)
    t = clock(int(1e3 * seconds))
    w, phase = 2 * np.pi * rng.uniform(0.3, 4.0, 5), rng.uniform(0, 2 * np.pi, 5)
    A = 0.1 / w
    y = np.sum(A * np.sin(np.outer(t, w) + phase), axis=1)
    v = np.sum(A * w * np.cos(np.outer(t, w) + phase), axis=1)
    a = np.sum(-A * w**2 * np.sin(np.outer(t, w) + phase), axis=1)
    F = p.m * a + np.where(v > 0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v)
    return Log(
        "moving",
        {"t": t, "y": y + rng.normal(0, noise, len(t)), "F": F + rng.normal(0, 0.01, len(t))},
    )


def stopping(p: Karnopp) -> Log:
    """Strokes to and fro with stops of half a second between, at a force inside the limits."""
    s = np.linspace(0, 1, 1000, endpoint=False)
    stroke = 0.1 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    rest = np.zeros(500)
    cycle = np.concatenate([stroke, 0.1 + rest, 0.1 - stroke, rest])
    y = np.tile(cycle, 6)
    v = np.gradient(y, 1e-3)
    a = np.gradient(v, 1e-3)
    stuck = np.abs(v) < 1e-9
    slip = np.where(v > 0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v)
    F = np.where(stuck, 0.9 * p.F_sp, p.m * a + slip)
    t = clock(len(y))
    rng = np.random.default_rng(1)
    y = y + rng.normal(0, 1e-6, len(y))
    return Log("stopping", {"t": t, "y": y, "F": F})


def five(p: Karnopp) -> Array:
    return np.array([getattr(p, name) for name in SLIDING_NAMES])


@pytest.mark.parametrize("method", ["butterworth", "local"])
@pytest.mark.parametrize("log", [moving(TRUE), stopping(TRUE)], ids=["moving", "stopping"])
def test_recovers_known_friction(log: Log, method: Method) -> None:
    model = fit_inverse(log, how=Smoothing(method=method))
    np.testing.assert_allclose(model.array, five(TRUE), rtol=0.01)
    assert model.error.relative < 0.02


def test_deviations_hold_the_truth() -> None:
    """Over twenty seeds the errors are of the size that the deviations announce."""
    fits = [fit_inverse(moving(TRUE, seed, noise=1e-5)) for seed in range(20)]
    z = np.array([(f.array - five(TRUE)) / [f.sd[name] for name in SLIDING_NAMES] for f in fits])
    assert 0.2 < float(np.sqrt(np.mean(z**2))) < 3.0


def test_one_viscous_coefficient_and_an_offset() -> None:
    p = Karnopp(2.0, 17.0, 23.0, 200.0, 200.0, 0.0, 0.0, 30.0, -30.0)
    model = fit_inverse(moving(p), "symmetric")
    assert model.F_vp == model.F_vn == pytest.approx(200.0, rel=0.01)
    assert model.F_c == pytest.approx(20.0, rel=0.01)
    assert model.offset == pytest.approx(-3.0, rel=0.02)
    assert model.sd["F_c"] > 0
    assert model.covariance.shape == (5, 5)


def test_a_zero_order_hold_force_is_seen_half_a_sample_late() -> None:
    log = moving(TRUE)
    zoh = log.with_signals(F=np.append(0.5 * (log["F"][1:] + log["F"][:-1]), log["F"][-1]))
    blind, aware = (force_error(zoh, TRUE, Smoothing(zoh=k)).relative for k in (False, True))
    assert aware < 0.6 * blind
    np.testing.assert_allclose(zoh_force(np.array([1.0, 3.0, 5.0])), [1.0, 2.0, 4.0])


def test_predicted_force_is_the_applied_one() -> None:
    log = stopping(TRUE)
    error = force_predicted(log, TRUE, Smoothing(cutoff=60.0)) - log["F"]
    assert float(np.median(np.abs(error))) < 0.05
    beyond = log.with_signals(F=np.full(len(log), 100.0))
    stuck = np.abs(np.gradient(log["y"], 1e-3)) < 1e-9
    predicted = force_predicted(beyond, TRUE, Smoothing(cutoff=60.0))[stuck]
    assert np.all(predicted < 1.5 * TRUE.F_sp)
    assert friction(np.zeros(1), np.full(1, 100.0), TRUE)[0] == TRUE.F_sp


def test_one_direction_is_not_enough() -> None:
    t = clock(4000)
    log = Log("one way", {"t": t, "y": 0.1 * t + 0.01 * np.sin(t), "F": np.ones(4000)})
    with pytest.raises(NotIdentifiable, match="negative direction"):
        fit_inverse(log)


def test_one_speed_does_not_tell_coulomb_from_viscous() -> None:
    y: Array = np.tile(np.concatenate([np.linspace(0, 1, 2000), np.linspace(1, 0, 2000)]), 3)
    t = clock(len(y))
    log = Log("triangle", {"t": t, "y": y, "F": np.ones(len(y))})
    with pytest.raises(NotIdentifiable, match="not separable"):
        fit_inverse(log)


def test_an_uneven_clock_is_refused() -> None:
    log = moving(TRUE)
    t = log["t"] + np.where(np.arange(len(log)) > 100, 1e-3, 0)
    with pytest.raises(BadLog, match="even clock"):
        fit_inverse(log.with_signals(t=t))


def emps(name: str) -> Log:
    data = loadmat(EMPS / f"{name}.mat", squeeze_me=True)
    F = float(data["gtau"]) * data["vir"]
    return Log(name, {"t": data["t"], "y": data["qm"], "F": F})


@pytest.fixture(scope="module")
def published() -> dict[Viscous, InverseModel]:
    kinds: tuple[Viscous, ...] = ("symmetric", "directional")
    return {kind: fit_inverse(emps("DATA_EMPS"), kind, PUBLISHED) for kind in kinds}


@needs_emps
@pytest.mark.parametrize("name", ["m", "F_v", "F_c", "offset"])
def test_emps_published_parameters(published: dict[Viscous, InverseModel], name: str) -> None:
    expected = REFERENCE["symmetric"][name]
    found = getattr(published["symmetric"], "F_vp" if name == "F_v" else name)
    assert found == pytest.approx(expected["value"], rel=expected["tolerance"])


@needs_emps
@pytest.mark.parametrize(
    ("figure", "log", "viscous"),
    [
        ("training_symmetric", "DATA_EMPS", "symmetric"),
        ("training_directional", "DATA_EMPS", "directional"),
        ("pulses_symmetric", "DATA_EMPS_PULSES", "symmetric"),
    ],
)
def test_emps_published_force_errors(
    published: dict[Viscous, InverseModel], figure: str, log: str, viscous: Viscous
) -> None:
    expected = REFERENCE["force_relative"][figure]
    found = force_error(emps(log), published[viscous], PUBLISHED).relative
    assert found <= expected["value"] * (1 + expected["tolerance"])


@needs_emps
def test_emps_cutoff_from_the_log_agrees(published: dict[Viscous, InverseModel]) -> None:
    model = fit_inverse(emps("DATA_EMPS"), "symmetric")
    np.testing.assert_allclose(model.array, published["symmetric"].array, rtol=0.01)
