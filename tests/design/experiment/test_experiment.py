"""The run to make next: within the limits on the true machine, and as sure as promised."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from design.asked import Wanted
from design.closed_loop.drawn_plants import drawn_plants, in_loop
from design.experiment.limits import MotionLimits
from design.experiment.plan import _remarks, bench_of, experiment, made_safe
from design.experiment.planned import Experiment, experiment_document, limits_of
from design.loop import LoopNoise
from design.machine.controller import CardController, present
from design.machine.model import Model
from design.pid import pid_to_rst
from identification.arrays import Array
from identification.effects._library import built_in
from identification.errors import BadModel, BadSpecification, NotIdentifiable
from identification.estimation.fit import fit_plant
from identification.log import Log
from identification.model.karnopp import NAMES
from identification.progress import KeepGoing, quiet
from tests.chain import TABLES, model_of
from workbench.documents.rivals import read_rivals
from workbench.report.experiment import reference_text
from workbench.report.view import view

pytestmark = pytest.mark.slow

K_A = 35.0
MOTOR = replace(TABLES["paper_table3"], dv_p=0.01, dv_n=-0.012)
WANTED = Wanted(stroke=(-0.05, 0.05), speed=0.4, force=120.0, seconds=8.0, seed=2)


def controlled(spread: float = 5e-3) -> Model:
    """A motor of roughly known parameters with the controller that it has now."""
    model = model_of(MOTOR, k_a=K_A, spread=spread)
    law = pid_to_rst(2000.0, 0.5, 0.1, 0.01, 2e-3)
    gains = {"R": tuple(law.R / K_A), "S": tuple(law.S), "T": tuple(law.T / K_A)}
    card = CardController("RST", {}, gains, 2e-3, "command", None, None, None)
    own = present(card, model.rig, 2e-3)
    entry = replace(model.log[0], speed=0.3, h=2e-3)
    return replace(model, controller=own, log=(entry,), fit=replace(model.fit, noise_F=0.0))


def after(evaluations: int) -> KeepGoing:
    """A search that is ended after it has asked so often."""
    left = [evaluations]

    def keep_going() -> bool:
        left[0] -= 1
        return left[0] > 0

    return keep_going


@pytest.fixture(scope="module")
def planned() -> Experiment:
    return experiment(controlled(), WANTED, None, quiet, after(80))


@pytest.mark.method
@pytest.mark.slow
def test_no_limit_is_exceeded_on_machines_that_it_may_be(planned: Experiment) -> None:
    assert planned.safety.exceeding == 0
    model = controlled()
    bench = bench_of(model, None)
    for plant in drawn_plants(model, np.random.default_rng(99), 8):
        run = bench.run(plant, planned.r)
        assert np.max(np.abs(run.y)) <= 0.05
        assert np.max(np.abs(run.v)) <= 0.4
        assert np.max(np.abs(run.F)) <= 120.0


@pytest.mark.slow
def test_a_fit_of_the_run_is_as_sure_as_promised(planned: Experiment) -> None:
    model = controlled()
    bench, (machine, *_) = bench_of(model, None), drawn_plants(model, np.random.default_rng(5), 1)
    noise = LoopNoise.draw(len(planned.r), 1e-5, 0.0, np.random.default_rng(6))
    log: Log = bench.log(bench.run(machine, planned.r, np.random.default_rng(6)))
    assert np.std(noise.y) == pytest.approx(model.fit.noise_y, rel=0.1)
    fit = fit_plant([log], np.random.default_rng(0), rig=model.rig)
    ratios = []
    for one in planned.promise:
        found = fit.estimates[one.name]
        assert one.after is not None, one.name
        assert found.low is not None and found.high is not None, one.name
        ratios.append(0.5 * (found.high - found.low) / one.after)
    assert 1 / 1.5 < float(np.median(ratios)) < 1.5
    assert np.sum(np.abs(np.log(ratios)) < np.log(1.5)) >= 7


def test_what_it_writes(planned: Experiment) -> None:
    document = json.loads(json.dumps(experiment_document(planned)))
    assert (document["schema"], document["criterion"]) == ("experiment/1", "D")
    assert set(document["promise"]) == set(NAMES)
    assert document["limits"]["stroke"] == [-0.05, 0.05]
    head, *rows = reference_text(planned).splitlines()
    assert head == "t [s],r [m]"
    read: Array = np.array([[float(x) for x in row.split(",")] for row in rows])
    assert read[:, 1] == pytest.approx(planned.r, abs=1e-9)
    assert np.diff(read[:, 0]) == pytest.approx(2e-3)
    page = view(planned).page()
    assert "What it promises" in page and "&lt;t" not in page
    assert page.count('<figure class="chart"') == 2


def test_the_parameters_asked_for_are_known() -> None:
    with pytest.raises(BadModel, match=r"no parameter 'F_x'.*F_cp"):
        experiment(controlled(), replace(WANTED, parameters=("F_x",)), None, quiet, after(1))


@pytest.mark.slow
def test_without_room_or_controller_it_is_refused() -> None:
    with pytest.raises(NotIdentifiable, match="widen the limits"):
        experiment(controlled(), replace(WANTED, speed=1e-6), None, quiet, after(1))
    with pytest.raises(BadModel, match="no controller"):
        experiment(model_of(MOTOR, k_a=K_A), WANTED, None, quiet, after(1))
    with pytest.raises(BadSpecification, match="stroke"):
        limits_of(controlled(), replace(WANTED, stroke=(0.1, 0.0)))


@pytest.mark.slow
def test_a_controller_that_hardly_moves_the_machine_is_reported() -> None:
    model = controlled()
    assert model.controller is not None
    law = model.controller.law
    weak = replace(law, R=tuple(0.01 * x for x in law.R), T=tuple(0.01 * x for x in law.T))
    with pytest.raises(NotIdentifiable, match="no parameter is identifiable from a run"):
        experiment(
            replace(model, controller=replace(model.controller, law=weak)), WANTED, None, quiet,
            after(1),
        )  # fmt: skip


def test_a_run_that_exceeds_a_limit_is_made_smaller_or_refused() -> None:
    model = controlled()
    bench, plants = bench_of(model, None), (in_loop(model),)
    r = 0.04 * np.sin(0.01 * np.arange(600.0))
    free = MotionLimits((-0.1, 0.1), 10.0, 20.0)
    _, seen = made_safe(bench, plants, r, free, np.random.default_rng(0))
    assert seen.scale == 1.0 and seen.exceeding == 0
    tight = replace(free, force=0.9 * seen.peaks.force)
    smaller, safe = made_safe(bench, plants, r, tight, np.random.default_rng(0))
    assert safe.scale < 1.0 and safe.exceeding == 0 and safe.peaks.force <= tight.force
    assert np.max(np.abs(smaller)) == pytest.approx(safe.scale * np.max(np.abs(r)))
    hopeless = replace(free, force=0.1 * seen.peaks.force)
    with pytest.raises(NotIdentifiable, match=r"1 of 1 machines .* \(force .* N\), .*--speed 7 "):
        made_safe(bench, plants, r, hopeless, np.random.default_rng(0))


def test_limits_that_are_not_given_are_those_of_the_logs() -> None:
    limits = limits_of(controlled(), Wanted())
    assert limits.stroke == (-0.1, 0.1)
    assert limits.speed == pytest.approx(0.45)
    assert limits.force == pytest.approx(240.0)


@pytest.mark.method
@pytest.mark.slow
def test_rivals_are_distinguished() -> None:
    wanted = replace(WANTED, rivals=("stribeck", "spring"))
    found = experiment(controlled(), wanted, None, quiet, after(40))
    assert found.criterion == "T"
    pairs = {(one.one, one.other): one.deviations for one in found.separation}
    assert len(pairs) == 4
    assert pairs["stribeck", "spring"] > 5.0
    assert pairs["spring", "no effect"] >= pairs["spring", "stribeck"]


@pytest.mark.parametrize(
    ("found", "keys"),
    [
        ({"verdict": "inseparable", "effects": [], "rivals": [
            {"key": "spring", "why_not": "explains as much as cogging on these logs"},
            {"key": "stribeck", "why_not": "gains 3 % of what cogging does"}]},
         {"cogging", "spring"}),
        ({"verdict": "unknown", "effects": [], "rivals": []},
         {key for key, one in built_in().items() if not one.signals}),
    ],
)  # fmt: skip
def test_rivals_are_those_that_a_trace_leaves_open(
    tmp_path: Path, found: dict[str, object], keys: set[str]
) -> None:
    path = tmp_path / "trace.json"
    path.write_text(json.dumps({"schema": "trace/1", **found}))
    assert set(read_rivals(path, controlled(), built_in())) == keys


def test_a_trace_that_leaves_nothing_open_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trace.json"
    path.write_text(json.dumps({"schema": "trace/1", "verdict": "effect"}))
    with pytest.raises(BadModel, match="verdict is 'effect'"):
        read_rivals(path, controlled(), built_in())
    path.write_text("{}")
    with pytest.raises(BadModel, match="trace/1"):
        read_rivals(path, controlled(), built_in())


def test_a_motor_whose_force_is_noisy_logs_another_command_than_it_got() -> None:
    model = controlled()
    bench = bench_of(replace(model, fit=replace(model.fit, noise_F=0.3)), None)
    run = bench.run(model.simulated, np.zeros(2000))
    logged = bench.log(run, rng=np.random.default_rng(0))
    assert np.std(logged["F"] - K_A * run.u) == pytest.approx(0.3, rel=0.1)
    assert np.allclose(logged["F"], K_A * logged["u"])
    assert np.array_equal(bench.log(run)["u"], run.u)


def test_what_is_promised_of_an_assumed_band_is_reported() -> None:
    fast = replace(controlled().log[0], speed=1e3)  # of which any band is next to none
    bare = replace(controlled(), log=(fast,))
    assert any("the logs show no band" in one for one in _remarks(bare, 1.0))
    assert not any("the logs show no band" in one for one in _remarks(controlled(), 1.0))


def test_a_band_next_to_none_is_taken_for_one_that_no_log_identified() -> None:
    model = controlled()
    narrow = replace(model.friction["dv_p"], value=1e-8, low=0.9e-8, high=1.1e-8, sd=1e-9)
    lost = replace(model, friction={**model.friction, "dv_p": narrow})
    assert in_loop(lost).friction.dv_p == pytest.approx(0.009)
    drawn = [one.friction.dv_p for one in drawn_plants(lost, np.random.default_rng(0), 30)]
    assert 0.15 < float(np.std(np.log(drawn))) < 0.6
