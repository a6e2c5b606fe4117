"""The nine-parameter fit on logs of known plants, and its honesty where a log is silent."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.arrays import Array
from identification.errors import BadLog, NotIdentifiable
from identification.estimation import fit as fitting
from identification.estimation import run_or_equation
from identification.estimation.fit import fit_plant
from identification.estimation.prescribed_motion import fit_prescribed
from identification.estimation.recorded_logs import RecordedLogs, recorded_logs
from identification.estimation.regression.equation_rows import FIVE
from identification.estimation.run_or_equation import LeftOfEquation, left_by
from identification.estimation.structure_fit import FittedStructure, plain_structure
from identification.estimation.windowed_run.refinement import Refit
from identification.log import Log, Rig
from identification.model.estimates import Estimate, KarnoppFit, LogFit
from identification.model.karnopp import NAMES, Karnopp
from identification.model.plant import Actuator, Motor, Plant
from tests.identification.motor_logs import K_A, NINE, made
from tests.identification.plants import ACTUATOR, made_log, table

FORCE = Rig("force")


def fitted(log: Log, seed: int = 7) -> KarnoppFit:
    return fit_plant([log], np.random.default_rng(seed), rig=FORCE)


def errors(fit: KarnoppFit, truth: Karnopp) -> np.ndarray:
    return np.abs(fit.friction.array / truth.array - 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3])
def test_recovers_the_papers_plants(number: int) -> None:
    truth = table(number)
    fit = fitted(made_log(truth, seed=number))
    assert fit.adequate
    assert fit.drive == "command"
    assert fit.chi_square == pytest.approx(1.0, abs=0.15)
    assert np.max(errors(fit, truth)) < 0.01
    assert isinstance(fit.actuator, Actuator)
    assert fit.actuator.k1 == pytest.approx(ACTUATOR.k1, rel=1e-3)
    assert fit.actuator.k2 == pytest.approx(ACTUATOR.k2, rel=1e-3)
    for name, value in zip(NAMES, truth.array, strict=True):
        found = fit.estimates[name]
        assert found.value is not None, found.reason
        assert found.sd is not None
        assert abs(found.value - value) < 5 * found.sd + 1e-4 * abs(value)


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "off"), [(3e-5, 0.003), (1e-4, 0.01), (1e-3, 0.03)])
def test_noise_of_the_logged_command_is_the_logs_and_not_the_plants(
    noise: float, off: float
) -> None:
    """The valve did not see it: its integral drifts, and the measured force tells how far."""
    truth = table(2)
    log = made_log(truth, seed=2)
    heard = log.with_signals(
        u=log["u"] + noise * np.random.default_rng(5).standard_normal(len(log))
    )
    fit = fitted(heard)
    assert fit.adequate and fit.drive == "command"
    assert fit.chi_square < 1.15
    assert any("command has noise" in remark for remark in fit.remarks)
    assert np.max(errors(fit, truth)) < off
    for name, value in zip(NAMES, truth.array, strict=True):
        found = fit.estimates[name]
        assert found.value is not None and found.sd is not None, found.reason
        assert abs(found.value - value) < 4 * found.sd


@pytest.mark.slow
def test_recovers_a_plant_from_the_force_alone() -> None:
    truth = table(2)
    log = made_log(truth, seed=3)
    alone = Log(log.name, {key: log[key] for key in ("t", "y", "F")})
    fit = fitted(alone)
    assert fit.drive == "force"
    assert fit.actuator is None
    assert np.max(errors(fit, truth)[:5]) < 0.02
    assert np.max(errors(fit, truth)) < 0.10


@pytest.mark.method
def test_motor_is_driven_by_its_command() -> None:
    log = made_log(table(2), seed=4, seconds=3.0)
    motor = Log(log.name, {"t": log["t"], "y": log["y"], "F": 2.0 * log["u"], "u": log["u"]})
    fit = fit_plant([motor], np.random.default_rng(1), rig=Rig("motor", force_per_command=2.0))
    assert fit.actuator == Motor(2.0)


@pytest.mark.method
@pytest.mark.slow
def test_two_logs_make_one_fit_with_smaller_spread() -> None:
    truth = table(3)
    logs = [made_log(truth, seed=seed, seconds=6.0) for seed in (1, 2)]
    one = fit_plant(logs[:1], np.random.default_rng(2), rig=FORCE)
    both = fit_plant(logs, np.random.default_rng(2), rig=FORCE)
    assert both.adequate
    assert len(both.logs) == 2
    assert np.max(errors(both, truth)) < 0.01
    assert np.trace(both.covariance[:1, :1]) < np.trace(one.covariance[:1, :1])


@pytest.mark.method
@pytest.mark.slow
def test_a_log_that_goes_one_way_says_nothing_of_the_other() -> None:
    t = np.arange(8000, dtype=np.float64) * 1e-3
    both = (np.sin(2 * np.pi * 0.5 * t) > 0) & (np.sin(2 * np.pi * 2.0 * t) > -0.2)
    pushes: Array = np.where(both, 0.05, 0.0)
    log = made_log(table(2), u=pushes, seconds=8.0)
    assert np.min(np.diff(log["y"][::100])) > -1e-4
    fit = fitted(log)
    for name in ("F_cn", "F_vn", "dv_n", "F_sn"):
        found = fit.estimates[name]
        assert found.value is None
        assert found.assumed is not None
        assert found.reason is not None
        assert "negative direction" in found.reason or "not identifiable" in found.reason
    together = fit.estimates["F_cp"]  # as one with a constant force, if there is any
    assert together.value is None and "any constant force" in str(together.reason)
    assert together.assumed == pytest.approx(table(2).F_cp, rel=0.02)


@pytest.mark.method
@pytest.mark.slow
def test_same_seed_gives_the_same_fit() -> None:
    log = made_log(table(1), seed=5, seconds=5.0)
    one, two = fitted(log), fitted(log)
    for field in fields(Karnopp):
        assert getattr(one.friction, field.name) == getattr(two.friction, field.name)


@pytest.mark.slow
def test_arrays_of_the_caller_are_not_changed() -> None:
    log = made_log(table(1), seed=6, seconds=4.0)
    before = {key: values.copy() for key, values in log.signals.items()}
    fitted(log)
    for key, values in before.items():
        assert np.array_equal(log[key], values)


def test_progress_is_reported_by_stage() -> None:
    seen: list[tuple[str, float]] = []
    fit_plant(
        [made_log(table(2), seconds=4.0)],
        np.random.default_rng(0),
        rig=FORCE,
        on_progress=lambda stage, share: seen.append((stage, share)),
    )
    assert {"refining", "weighing"} <= {stage for stage, _ in seen}
    assert all(0.0 <= share <= 1.0 for _, share in seen)


@pytest.mark.method
@pytest.mark.slow
def test_a_wrong_structure_is_not_called_adequate() -> None:
    log = made_log(table(2), seed=8, seconds=6.0)
    spring = log.with_signals(F=log["F"] + 300.0 * log["y"] ** 2 / np.max(log["y"]))
    fit = fit_plant([spring], np.random.default_rng(3), rig=FORCE)
    assert not fit.adequate
    assert any("effect is missing" in r or "no free run follows" in r for r in fit.remarks)


def test_a_fit_by_force_keeps_the_actuator_that_a_regression_gives() -> None:
    log = made_log(table(2), seed=5, seconds=6.0)
    fit = fit_plant([log], np.random.default_rng(1), rig=FORCE, drive="force")
    assert fit.drive == "force"
    assert not {"k1", "k2"} & set(fit.estimates)
    assert isinstance(fit.actuator, Actuator)
    assert fit.actuator.k1 == pytest.approx(ACTUATOR.k1, rel=0.01)


def test_the_active_plant_is_kept_where_a_new_start_ends_farther_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log = made_log(table(2), seed=9, seconds=4.0)
    usual = fitted(log)
    truth = Plant(table(2), ACTUATOR)
    astray = replace(table(2), F_cp=1.3 * table(2).F_cp)

    def unsure(plant: Plant, *_: object, **__: object) -> Refit:
        """The plant as it is, with more than noise left."""
        return Refit(plant, 1.2, (), {}, lambda: np.zeros((0, 0)))

    def lost(recorded: RecordedLogs, rng: np.random.Generator) -> FittedStructure:
        """What the equations lead to, far from the log."""
        return replace(plain_structure(recorded, rng), plant=Plant(astray, ACTUATOR), misfit=9.0)

    monkeypatch.setattr(fitting, "refit", unsure)
    monkeypatch.setattr(fitting, "plain_structure", lost)
    begun: list[FittedStructure] = []

    def goes_on(found: FittedStructure, *_: object, **__: object) -> KarnoppFit:
        """Remembers where the fit goes on from."""
        begun.append(found)
        return usual

    monkeypatch.setattr(fitting, "finished", goes_on)
    fit_plant([log], np.random.default_rng(1), rig=FORCE, prior=truth)
    assert begun[0].plant == truth and begun[0].misfit == 1.2


def test_refusals() -> None:
    log = made_log(table(2), seconds=2.0)
    with pytest.raises(BadLog, match="no applied force"):
        fitted(Log("bare", {"t": log["t"], "y": log["y"]}))
    rng = np.random.default_rng(0)
    still = log.with_signals(y=1e-5 * rng.standard_normal(len(log)))
    with pytest.raises(NotIdentifiable, match="no motion"):
        fitted(still)
    alone = Log("alone", {key: log[key] for key in ("t", "y", "F")})
    with pytest.raises(BadLog, match="no command u"):
        fit_plant([alone], rng, rig=FORCE, drive="command")


@dataclass(frozen=True)
class Told:
    """What is asked of a fit before the equation of motion takes its place."""

    friction: Karnopp
    adequate: bool
    name: str
    logs: tuple[LogFit, ...]
    estimates: Mapping[str, Estimate]
    effects: tuple[()] = ()


@pytest.mark.parametrize(("adequate", "left", "identified", "by"), [
    (True, 2.0, 5, "equation"),  # more than 1 % of the Coulomb level beyond it
    (True, 1.02, 5, "run"),
    (False, 2.0, 5, "equation"),
    (True, 1.02, 3, "equation"),  # a noisy force leaves the run's friction open
])  # fmt: skip
def test_the_equation_takes_the_place_of_a_run_that_leaves_more_of_it(
    monkeypatch: pytest.MonkeyPatch, adequate: bool, left: float, identified: int, by: str
) -> None:
    """Where the run is followed to the noise, nothing is missing beside the equation's numbers."""
    log = made_log(table(1), seconds=0.5)
    near = LogFit("made", (0.0, 0.0, 0.0), 1e-9, None, 1.0)
    known, open_ = Estimate(1.0, "N", 0.05, 0.9, 1.1), Estimate(None, "N", reason="drifts")
    every = {name: known for name in FIVE}
    run: Any = Told(
        table(1), adequate, "run", (near,),
        {name: known if i < identified else open_ for i, name in enumerate(FIVE)},
    )  # fmt: skip
    other = replace(run, adequate=False, name="equation", estimates=every)
    recorded: Any = SimpleNamespace(plain=[log], logs=())
    monkeypatch.setattr(run_or_equation, "left_by", lambda *_: LeftOfEquation(left, 1.0, 100.0))
    monkeypatch.setattr(run_or_equation, "_by_equation", lambda *_: other)
    monkeypatch.setattr(run_or_equation, "likeliest", lambda fit, _: fit)
    monkeypatch.setattr(run_or_equation, "as_sliding_shows", lambda fit, _: fit)
    found: Any = run_or_equation.on_the_floor(run, recorded)
    assert (found.name, found.adequate) == (by, adequate)


def test_a_run_of_which_sliding_shows_less_than_it_states_leaves_the_equation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By one seed the run was taken for four parameters, and gave one in the end; by another the
    equation gave four."""
    log, known = made_log(table(1), seconds=0.5), Estimate(1.0, "N", 0.05, 0.9, 1.1)
    near = LogFit("made", (0.0, 0.0, 0.0), 1e-9, None, 1.0)
    run: Any = Told(table(1), True, "run", (near,), dict.fromkeys(FIVE, known))
    none = dict.fromkeys(FIVE, Estimate(None, "N", reason="wider"))
    recorded: Any = SimpleNamespace(plain=[log], logs=())
    compared, likelier = list[Karnopp](), replace(run, friction=table(2))

    def left_by(friction: Karnopp, _: RecordedLogs) -> LeftOfEquation:
        compared.append(friction)
        return LeftOfEquation(1.0, 1.0, 100.0)

    monkeypatch.setattr(run_or_equation, "left_by", left_by)
    monkeypatch.setattr(run_or_equation, "_by_equation", lambda *_: replace(run, name="equation"))
    monkeypatch.setattr(run_or_equation, "likeliest", lambda *_: likelier)
    monkeypatch.setattr(
        run_or_equation, "as_sliding_shows",
        lambda fit, _: replace(fit, estimates=none) if fit.name == "run" else fit,
    )  # fmt: skip
    found: Any = run_or_equation.on_the_floor(run, recorded)
    assert found.name == "equation"
    assert compared == [run.friction]  # its own, which the run has been followed with


def equation_beside_a_lost_run(
    identified: int, monkeypatch: pytest.MonkeyPatch, *, share: float = 0.3, left: float = 10.0
) -> KarnoppFit:
    """What answers for a motor whose run leaves so much, with so many of the five known, in a band
    that takes the sliding; its equation of motion leaves far more than noise too, and this share of
    the force."""
    recorded = recorded_logs([made(3)], Rig("motor", force_per_command=K_A))
    equation = replace(fit_prescribed(recorded, "lost"), chi_square=1e3, left=(share, 1.0))
    none = Estimate(None, "N", reason="found 1, but the interval is wider")
    run = replace(
        equation, friction=replace(NINE, dv_p=10.0, dv_n=-10.0), chi_square=left,
        estimates={n: equation.estimates[n] if n in FIVE[:identified] else none for n in NAMES},
    )  # fmt: skip
    monkeypatch.setattr(run_or_equation, "_by_equation", lambda *_: equation)
    monkeypatch.setattr(run_or_equation, "likeliest", lambda fit, _: fit)
    return run_or_equation.on_the_floor(run, recorded)


def test_an_equation_beside_a_lost_run_predicts_and_reports_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = equation_beside_a_lost_run(0, monkeypatch)
    assert found.friction.dv_p < 10.0 and found.left is not None
    assert all(found.estimates[name].value is None for name in NAMES)
    assert "neither the run nor the equation" in str(found.estimates["m"].reason)
    assert equation_beside_a_lost_run(2, monkeypatch).friction.dv_p == 10.0
    # A run that is none has no number, however narrow its interval.
    lost = equation_beside_a_lost_run(2, monkeypatch, left=1e2)
    assert all(lost.estimates[name].value is None for name in NAMES)


def test_an_equation_that_explains_nearly_all_of_the_force_answers_for_a_lost_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = equation_beside_a_lost_run(1, monkeypatch, share=0.05, left=1e2)
    assert found.friction.dv_p < 10.0
    assert found.estimates["F_cp"].value is not None


def test_a_band_that_takes_the_sliding_does_not_hide_what_a_plant_leaves() -> None:
    by_force = recorded_logs([made(3)], Rig("force"), "force")
    own = left_by(NINE, by_force)
    swollen = replace(NINE, dv_p=10.0, dv_n=-10.0, F_cp=2.0 * NINE.F_cp)
    wide = left_by(swollen, by_force)
    assert own is not None and own.by_plant < 2.0 * own.by_equation
    assert wide is not None and wide.by_plant > 3.0 * wide.by_equation
    # A run by the command is followed as a whole, with its stops.
    assert left_by(swollen, recorded_logs([made(3)], Rig("motor", force_per_command=K_A))) is None
