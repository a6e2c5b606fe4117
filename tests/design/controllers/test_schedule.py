"""Gain schedules of models: where friction changes with the place, the load or the direction."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from design.closed_loop.driven_loop import driven_loop, scheduled_loop
from design.closed_loop.local_friction import asked_for, local
from design.controllers import schedule
from design.controllers.clear_win import Contest, contest, strokes, that_may_be
from design.controllers.schedule import scheduled
from design.controllers.validate import validate
from design.generated.exported import exported
from design.machine.documents import design_document
from design.machine.model import Model
from identification.errors import BadModel
from identification.model.estimates import Estimate
from tests.chain import EMPS, model_of
from tests.workbench.export.designs import RUBS, case
from workbench.documents.result_files import read_design
from workbench.output import dumps
from workbench.report.design_tables import schedule_lines, schedule_rows
from workbench.report.view import view


def grown(key: str, **sizes: float) -> Model:
    """The motor with an effect of these sizes."""
    values = {name: Estimate(value, "N/m", 0.0, value, value) for name, value in sizes.items()}
    return replace(case("emps").model, effects={key: values})


def test_what_changes_over_a_place_or_a_load_is_in_the_nine_there() -> None:
    place = grown("position_dependent_friction", c1=100.0, period=0.05, at_rest_p=0.5)
    here = local(place, "place", 0.05).karnopp
    assert here.F_cp - place.karnopp.F_cp == pytest.approx(5.0)
    assert here.F_sp - place.karnopp.F_sp == pytest.approx(2.5)
    assert here.F_sn - place.karnopp.F_sn == pytest.approx(-5.0)
    assert not local(place, "place", 0.05).effects
    load = grown("load_dependent_friction", mu=0.2, asymmetry=0.5)
    here = local(load, "load", 40.0).karnopp
    assert here.F_cp - load.karnopp.F_cp == pytest.approx(12.0)
    assert here.F_cn - load.karnopp.F_cn == pytest.approx(4.0)
    assert here.F_vp == load.karnopp.F_vp
    down = local(load, "direction", -1.0).karnopp
    assert down.F_cp == down.F_cn == load.karnopp.F_cn


def test_over_what_a_model_asks_for_a_schedule() -> None:
    assert asked_for(model_of(EMPS, k_a=35.15)) == ()
    assert asked_for(model_of(replace(EMPS, F_vp=150.0), k_a=35.15)) == ("direction",)
    assert asked_for(grown("tight_spot", size=10.0, y_0=0.02, width=0.01)) == ("place",)
    assert asked_for(grown("load_dependent_friction", mu=0.2)) == ("load",)
    # 2 % of the friction ask for none, nor does an effect of speed.
    assert asked_for(grown("tight_spot", size=0.4, y_0=0.0, width=0.01)) == ()
    assert asked_for(grown("stribeck", F_s=5.0, v_s=0.01)) == ()


def test_a_schedule_that_nothing_asks_for_is_refused_in_a_line() -> None:
    model = case("emps").model
    with pytest.raises(BadModel, match=r"no schedule over place: no effect .* leave the fixed"):
        scheduled(model, case("cascade").design, "place")


@pytest.mark.slow
def test_a_p_pi_feeds_the_friction_of_the_place_forward_and_wins() -> None:
    model, found = case("schedule").model, case("schedule").design
    table = found.schedule
    assert table is not None and table.over == "place"
    assert table.at[0] == model.travel[0] and table.at[-1] == model.travel[1]
    levels = [row[0] for row in table.friction]
    assert levels == pytest.approx([RUBS.F_cp + 100.0 * at for at in table.at])
    p_pi, pid = table.controllers["p-pi"], table.controllers["pid"]
    assert p_pi.recommended and p_pi.why.startswith("clearly better than the fixed one: 0.")
    assert pid.why.startswith("leave it") is not pid.recommended
    # Its placement is the fixed one's: where the friction is the model's own, so are the gains.
    ours = local(model, "place", 0.0)
    assert ours.karnopp == model.karnopp
    assert any("friction changes with place: --schedule place" in line for line in found.remarks)
    lines = schedule_lines(found)
    assert lines[1].startswith("P-PI over place, ") and "clearly better" in lines[1]
    assert len(schedule_rows(found)) == 2 * len(table.at)


def test_a_schedule_that_loses_a_limit_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    def tried(*given: Any) -> tuple[Any, None]:
        missed = ("overshoot 13 %",) if given[3].schedule is not None else ()
        return SimpleNamespace(passed=not missed, missed=missed), None

    monkeypatch.setattr(schedule, "tried_loop", tried)
    model, found = case("schedule").model, case("schedule").design
    one = schedule._judged(model, found, "p-pi")
    assert one.why == "leave it: with it the loop misses a limit, overshoot 13 %"


@pytest.mark.slow
def test_it_is_validated_exported_written_and_read_again(tmp_path: Path) -> None:
    model, found = case("schedule").model, case("schedule").design
    file = tmp_path / "design.json"
    file.write_text(dumps(design_document(found)))
    assert read_design(file).schedule == found.schedule
    result, traces = validate(model, found, np.random.default_rng(0))
    page = view(result, traces, model.display).page()
    assert "P-PI + schedule" in page and "+table: with the gain schedule" in page
    assert {"pid + schedule", "p-pi + schedule"} <= set(result.figures)
    assert result.figures["p-pi + schedule"]["model"].stable
    what = exported(found, "p-pi")  # as it is recommended
    assert what.loop.schedule is not None
    assert any(line.startswith("scheduled over the place, ") for line in what.remarks)
    assert exported(found, "p-pi", scheduled=False).loop.schedule is None
    with pytest.raises(BadModel, match="no gain schedule of 'p-pi'"):
        exported(case("cascade").design, "p-pi", scheduled=True)


@pytest.mark.slow
def test_a_loop_does_not_clearly_win_over_itself_nor_the_fixed_one_over_the_schedule() -> None:
    model, found = case("schedule").model, case("schedule").design
    loop, fixed = scheduled_loop(model, found, "p-pi"), driven_loop(model, found, found.p_pi)  # type: ignore[arg-type]
    even = contest(model, None, fixed, fixed)
    np.testing.assert_allclose(even.error, 1.0)
    assert not even.clear and "1 times its error" in even.words
    assert contest(model, None, loop, fixed).clear
    assert not contest(model, None, fixed, loop).clear


def test_a_win_is_clear_on_nearly_all_machines_and_with_no_more_force() -> None:
    borne, force = np.ones(20, dtype=bool), np.ones(20)
    error = np.where(np.arange(20) < 18, 0.79, 1.5)
    assert Contest(error, force, borne).clear
    assert not Contest(np.where(np.arange(20) < 17, 0.79, 1.5), force, borne).clear
    assert not Contest(error, force, np.arange(20) > 0).clear


def test_the_machines_have_the_lag_that_no_log_would_have_shown_and_strokes_cover_the_travel() -> (
    None
):
    model = case("emps").model
    lags = [dict((one.key, one.p) for one in plant.effects)["input_delay"][0]
            for plant in that_may_be(model, np.random.default_rng(0), 4)]  # fmt: skip
    assert 0.0 <= min(lags) < max(lags) <= 0.4 * model.period


def test_strokes_cover_the_travel() -> None:
    model = case("emps").model
    r = strokes(model, None, 1e-3)
    assert np.ptp(r) == pytest.approx(0.9 * (model.travel[1] - model.travel[0]), rel=1e-3)
    v = np.diff(r) / 1e-3
    assert np.max(np.abs(v)) <= 1.01 * (model.travel[1] - model.travel[0])
