"""Trace: the right effect on a log that has it, nothing on one that lacks none, drift as drift."""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import Library, built_in
from identification.errors import NotIdentifiable
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Plant
from identification.model.surroundings import NO_SURROUNDINGS
from identification.simulation.free_run import free_run
from identification.tracing.result import Trace
from identification.tracing.trace import trace

H = 2e-3
RIG = Rig("force")
PLAIN = Karnopp(2.5, 15.0, 18.0, 120.0, 150.0, 0.008, -0.01, 19.0, -23.0)
ACTUATOR = Actuator(19530.0, 10405.0)


def command(n: int, seed: int) -> Array:
    """A command that moves the body as slow sines and a few steps would have it, at rest first."""
    rng = np.random.default_rng(seed)
    t = H * np.arange(n)
    lines = rng.uniform(0.05, 1.5, 12)
    r = sum(
        a * np.sin(2 * np.pi * f * t + p)
        for a, f, p in zip(1 / lines, lines, rng.uniform(0, 6.3, 12), strict=True)
    )
    r = 0.06 * r / np.std(r) + np.repeat(rng.uniform(-0.02, 0.02, n // 1000 + 1), 1000)[:n]
    u = np.diff(r, append=r[-1]) / H * ACTUATOR.k2 / ACTUATOR.k1
    u[:200] = 0.0
    return np.asarray(np.clip(u, -3.0, 3.0), dtype=np.float64)


def made(
    seed: int,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    plain: Karnopp = PLAIN,
    n: int = 15_000,
) -> Log:
    """30 s at 500 Hz of the plant with these effects, with the paper's noise."""
    acting = tuple(built_in()[key].acting(values) for key, values in (effects or {}).items())
    rng = np.random.default_rng(seed + 1)
    blank = Log(
        f"run{seed}",
        {
            "t": H * np.arange(n, dtype=np.float64),
            "u": command(n, seed),
            "y": np.zeros(n),
            "F": np.zeros(n),
        },
    )
    run = free_run(Plant(plain, ACTUATOR, acting), blank, (0.0, 0.0, 0.0), "command")
    return blank.with_signals(
        y=run.shown + 1e-5 * rng.standard_normal(n), F=run.F + 1e-2 * rng.standard_normal(n)
    )


def traced(train: Log, *test: Log, library: Library | None = None) -> Trace:
    return trace([train], list(test), RIG, library or built_in(), np.random.default_rng(0))


@pytest.mark.parametrize(("way", "missing"), [(1.0, "negative"), (-1.0, "positive")])
def test_motion_in_one_direction_alone_is_refused(way: float, missing: str) -> None:
    t = H * np.arange(15_000, dtype=np.float64)
    speed = 0.1 * np.maximum(np.sin(2.0 * np.pi * 0.5 * t), 0.0)
    noise = 1e-5 * np.random.default_rng(0).standard_normal(len(t))
    y, force = way * H * np.cumsum(speed) + noise, way * (5.0 + 20.0 * speed)
    one = Log("oneway.csv", {"t": t, "y": y, "F": force})
    with pytest.raises(NotIdentifiable, match=f"oneway.csv: no stretch .* in {missing} direction"):
        trace([one], [], RIG, built_in(), np.random.default_rng(0))


def test_nothing_is_missing_where_nothing_is() -> None:
    before = made(11)
    copies = {key: np.array(values) for key, values in before.signals.items()}
    found = traced(before, made(12))
    assert found.verdict == "none"
    assert not found.effects and not found.drift and not found.unknown.depends_on
    assert found.after["test"].force_rms == pytest.approx(found.noise_force, rel=0.15)
    for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn", "dv_p", "dv_n", "F_sp", "F_sn"):
        value = found.parameters_after[name].value
        assert value == pytest.approx(getattr(PLAIN, name), rel=5e-3), name
    for key, values in copies.items():
        assert np.array_equal(before[key], values)
    run = found.run
    assert run is not None and len(run.t) == len(before)
    for model, errors in ((found.before, run.before), (found.after, run.after)):
        assert np.sqrt(np.mean(errors**2)) == pytest.approx(model["train"].position_rms)


@pytest.mark.method
@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("stribeck", {"F_s": 3.5, "v_s": 0.04}),
        ("warmup", {"a": -0.25, "tau": 10.0}),
        ("valve_dead_zone", {"u_d": 0.03}),
        ("cogging", {"a": 2.0, "b": 1.5, "period": 0.03}),
        ("sensor_nonlinearity", {"a": 0.05}),
    ],
)
def test_the_effect_is_named_and_its_size_found(key: str, values: dict[str, Any]) -> None:
    found = traced(made(21, {key: values}), made(22, {key: values}))
    assert found.verdict == "effect"
    assert [e.effect.key for e in found.effects] == [key]
    for name, value in values.items():
        assert found.effects[0].params[name].value == pytest.approx(value, rel=0.1), name
    assert found.effects[0].p_value <= 0.01
    errors = "actuator_rms" if key == "valve_dead_zone" else "force_rms"
    before, after = getattr(found.before["test"], errors), getattr(found.after["test"], errors)
    assert after < 0.6 * before
    for curve in found.curves:  # what is there without the effect, free of its law, is its law
        assert curve.effect == key and np.ptp(curve.law) > 1.0
        assert np.mean(((curve.free - curve.law) / curve.sd) ** 2) < 2.0
    assert bool(found.curves) == (key in ("stribeck", "warmup", "cogging"))


@pytest.mark.method
@pytest.mark.parametrize(
    ("key", "values", "signal"),
    [
        ("warmup", {"a": -0.25, "tau": 10.0}, "t"),
        ("position_dependent_friction", {"a": 3.0, "period": 0.1}, "y"),
    ],
)
def test_an_effect_that_the_library_lacks_is_unknown(
    key: str, values: dict[str, Any], signal: str
) -> None:
    library = {k: e for k, e in built_in().items() if k != key}
    found = traced(made(31, {key: values}), made(32, {key: values}), library=library)
    assert found.verdict == "unknown"
    assert signal in found.unknown.depends_on
    assert found.next_experiment


@pytest.mark.slow
def test_what_an_actuator_lacks_is_not_laid_to_friction() -> None:
    """A valve whose leakage the library does not know: friction is traced by the measured force."""
    library = {k: e for k, e in built_in().items() if k != "leakage"}
    leaking = {"leakage": {"leak": 4.0}}
    found = traced(made(31, leaking), made(32, leaking), library=library)
    assert found.verdict == "none"
    assert found.actuator_like is not None and found.plant.actuator is None
    for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn"):
        one = found.parameters_after[name]
        assert one.low is not None and one.high is not None
        assert one.low < getattr(PLAIN, name) < one.high


@pytest.mark.parametrize(
    ("verdict", "complete", "effects", "error", "actuator_noise", "asked"),
    [
        ("none", False, (), 5e-5, 1.0, True),
        ("none", False, (), 5e-5, 1.15, False),  # a linear actuator leaves noise alone
        ("none", False, (), 1e-5, 1.0, False),  # which is noise
        ("drift", False, (), 1e-5, 1.0, True),
        ("unknown", False, ("spring",), 5e-5, 1.0, True),
        ("none", True, (), 5e-5, 1.0, False),
        ("effect", False, ("spring",), 5e-5, 1.0, False),  # which the force alone might not have
    ],
)
def test_the_measured_force_is_asked_where_the_command_leaves_something_and_nothing_is_found(
    verdict: str, complete: bool, effects: tuple[str, ...], error: float, actuator_noise: float,
    asked: bool, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    by_command = SimpleNamespace(
        verdict=verdict,
        complete=complete,
        effects=effects,
        before={"train": SimpleNamespace(actuator_rms=1.2)},
        after={"test": SimpleNamespace(position_rms=error)},
        noise_y=1e-5,
        noise_actuator=actuator_noise,
        plant=SimpleNamespace(actuator=ACTUATOR),
    )
    by_force = SimpleNamespace(verdict="none", complete=True, effects=())
    module = "identification.tracing.trace"
    monkeypatch.setattr(f"{module}.what_acts_beside", lambda *_: NO_SURROUNDINGS)
    monkeypatch.setattr(f"{module}._traced", lambda *_: by_command)
    monkeypatch.setattr(f"{module}._by_force", lambda *_: by_force)
    log = made(31, n=2000)
    found: object = trace([log], [log], RIG, {}, np.random.default_rng(0))
    assert (found is by_force) == asked


@pytest.mark.slow
def test_other_parameters_are_drift() -> None:
    worn = replace(PLAIN, F_cp=12.0, F_vn=180.0)
    found = traced(made(41), made(42, plain=worn))
    assert found.verdict == "drift"
    changes = {change.name: change for change in found.drift}
    assert set(changes) == {"F_cp", "F_vn"}
    assert changes["F_cp"].after == pytest.approx(12.0, rel=0.01)
    assert changes["F_vn"].after == pytest.approx(180.0, rel=0.01)


@pytest.mark.slow
def test_a_slower_test_log_is_no_drift_of_the_mass() -> None:
    slow = made(51)
    u = 0.15 * np.sin(2 * np.pi * 0.1 * slow["t"])
    blank = slow.with_signals(u=u)
    run = free_run(Plant(PLAIN, ACTUATOR), blank, (0.0, 0.0, 0.0), "command")
    rng = np.random.default_rng(3)
    n = len(slow)
    calm = blank.with_signals(
        y=run.shown + 2e-5 * rng.standard_normal(n), F=run.F + 0.4 * rng.standard_normal(n)
    )
    found = traced(made(11), calm)
    assert found.verdict == "none", found.drift


def quick_and_slow() -> tuple[Log, Log]:
    """Quick strokes and slow ones of a body whose friction falls from 15 to 10 N over 30 mm/s."""
    stribeck = {"stribeck": {"F_s": 5.0, "v_s": 0.03}}
    even = Karnopp(2.5, 10.0, 10.0, 120.0, 120.0, 1e-3, -1e-3, 15.0, -15.0)
    t = H * np.arange(15_000, dtype=np.float64)
    swelling = 1.0 + 0.5 * np.sin(0.31 * t)
    quick, slow = (
        driven(seed, size * swelling * np.sin(2 * np.pi * f * t), even, stribeck)
        for seed, size, f in ((61, 0.3, 0.9), (62, 0.04, 0.12))
    )
    return quick, slow


@pytest.mark.slow
def test_an_effect_of_slow_motion_that_the_test_log_alone_has_is_no_drift() -> None:
    """Quick training strokes do not show it, and the trace ended with "nothing is missing", or with
    friction that had "changed"."""
    found = traced(*quick_and_slow())
    (one,) = found.effects
    assert one.effect.key == "stribeck" and not found.drift
    assert one.params["F_s"].value == pytest.approx(5.0, rel=0.02)
    assert any("first half" in remark for remark in found.remarks)


@pytest.mark.slow
def test_what_the_test_log_alone_lacks_is_looked_for_there() -> None:
    """Of an effect that is in no library: what is left of the training log depends on nothing."""
    quick, slow = quick_and_slow()
    constant = {"constant_force": built_in()["constant_force"]}
    found = traced(quick, slow, library=constant)
    assert found.verdict == "unknown" and not found.effects
    assert "v" in found.unknown.depends_on


def driven(seed: int, u: Array, plain: Karnopp, effects: Mapping[str, Mapping[str, float]]) -> Log:
    """`made`, driven by another command."""
    acting = tuple(built_in()[key].acting(values) for key, values in effects.items())
    log = made(seed, n=len(u)).with_signals(u=u)
    run = free_run(Plant(plain, ACTUATOR, acting), log, (0.0, 0.0, 0.0), "command")
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((2, len(u)))
    return log.with_signals(y=run.shown + 1e-5 * noise[0], F=run.F + 1e-2 * noise[1])


@pytest.mark.slow
def test_scale_of_forces_is_as_exact_as_its_interval() -> None:
    found = traced(made(11))
    for name, true in (("k1", ACTUATOR.k1), ("k2", ACTUATOR.k2), ("m", PLAIN.m)):
        estimated = found.parameters_after[name]
        assert estimated.value is not None and estimated.sd is not None
        assert abs(estimated.value - true) < 4.0 * estimated.sd, name


@pytest.mark.method
def test_an_effect_of_the_command_is_no_rival_without_one() -> None:
    effects = {"stribeck": {"F_s": 5.0, "v_s": 0.04}}
    train = made(61, effects)
    bare = Log(train.name, {k: v for k, v in train.signals.items() if k != "u"})
    found = traced(bare)
    named = {one.key for one in found.rivals} | {e.effect.key for e in found.effects}
    assert not named & {"input_delay", "valve_dead_zone", "leakage"}


@pytest.mark.method
def test_a_stand_in_is_not_named_beside_unknown() -> None:
    values = {"width": 4e-4}
    library = {k: e for k, e in built_in().items() if k != "backlash"}
    found = traced(made(71, {"backlash": values}), library=library)
    assert found.verdict == "unknown" and not found.effects
