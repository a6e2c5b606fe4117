"""The first sentences of a model, and what comes next."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from design.machine.model import Model
from design.machine.source import Source
from design.simulated.record import record
from identification.estimation.converged_fit import STOP_TURNS_ON_LESS
from identification.model.karnopp import Karnopp
from identification.simulation.free_run import FreeRun
from tests.chain import EMPS, model_of, short_recipe
from tests.workbench.trace_values import missing_force
from workbench.report.chart import Chart
from workbench.report.fit import fit_chart, residual
from workbench.report.model_tables import fit_lines, summary
from workbench.report.next_steps import after_identify


def by_equation(left: float, friction: Karnopp = EMPS) -> Model:
    """A model of the equation of motion alone, which leaves this mean square."""
    model = model_of(friction, k_a=35.15)
    entries = tuple(replace(one, position_rms=None) for one in model.log)
    fit = replace(model.fit, adequate=False, chi_square=left)
    return replace(model, log=entries, fit=fit)


@pytest.mark.parametrize(
    ("left", "said", "then"),
    [
        (1.0, "The equation of motion leaves nothing but noise", "whether an effect is missing"),
        (
            9.0,
            "The model leaves more than noise, 3 times the sensors' noise",
            "an effect is missing",
        ),
    ],
)
def test_what_an_equation_leaves_is_said_once(left: float, said: str, then: str) -> None:
    model = by_equation(left)
    assert said in summary(model, None)
    assert after_identify(model, ["a.csv"], "card.toml", Path("out")).why == then


def test_a_force_that_shows_is_not_called_noise() -> None:
    found = missing_force(["stribeck"])
    said = summary(by_equation(1.0, replace(EMPS, F_cp=2.0, F_cn=2.0)), found.before)
    assert "little more than noise, but a force is missing" in said
    assert "Force missing: " in said


def test_stops_that_turn_on_noise_are_no_noise_of_the_command() -> None:
    model = model_of(EMPS, k_a=35.15)
    entry = replace(model.log[0], position_rms=1e3 * model.fit.noise_y)
    fit = replace(model.fit, drive="command", adequate=True)
    for remarks, said in (
        ((f"{WINDOWED}: {STOP_TURNS_ON_LESS}",), "sensor noise and stops that it shifts in time."),
        ((), "nothing but what noise of the command makes"),
    ):
        left = replace(model, log=(entry,), fit=replace(fit, remarks=remarks))
        assert said in summary(left, None)


def test_parameters_of_the_equation_are_not_said_to_be_of_a_run_that_was_followed() -> None:
    found = missing_force(["stribeck"])
    model = by_equation(9.0, replace(EMPS, F_cp=2.0, F_cn=2.0))
    model = replace(model, fit=replace(model.fit, adequate=True))
    said = summary(model, found.before)
    assert "The free run" not in said and "leaves nothing" not in said
    assert "follows the logs to the sensors' noise; the equation of motion leaves more." in said
    assert "A free run follows the logs to the sensors' noise." in summary(model, None)
    (line,) = [one for one in fit_lines(model) if "free run" in one]
    assert line == "the parameters are those of the equation of motion, not of a free run"


WINDOWED = "the model follows the logs in windows of 2 s from measured states, but not the whole"


def test_a_run_in_windows_says_so_in_its_line_and_under_its_pictures() -> None:
    model = model_of(EMPS, k_a=35.15)
    entry = replace(model.log[0], position_rms=2.9e-4, duration=30.0)
    fit = replace(model.fit, drive="command", adequate=True, chi_square=0.8)
    whole = replace(model, log=(entry,), fit=fit)
    windowed = replace(whole, fit=replace(fit, remarks=(WINDOWED,)))
    (line, *_), (other, *_) = fit_lines(windowed), fit_lines(whole)
    assert "within 0.29 mm rms in windows of 2 s from measured states over 30 s" in line
    assert "windows" not in other
    log = record("short", short_recipe()[1], 7)
    source = Source(log, "short.csv", "0" * 64, len(log))
    run = FreeRun(log["y"], log["y"], log["F"], np.zeros(len(log), np.int64), log["y"])
    for one, anew, left in (
        (windowed, "anew from the measured state every 2 s", "0.89 times what the noise of all"),
        (whole, "it never sees the measured position", "0.89 times the sensors' noise"),
    ):
        assert anew in fit_chart(one, [source], [run]).caption
        (section,) = residual(one, [source], [run], None, one.karnopp)
        assert isinstance(section.content, Chart) and left in section.content.caption
        assert "stick limits" not in section.content.caption
    (section,) = residual(windowed, [source], [run], None, replace(EMPS, F_sp=1.5 * EMPS.F_sp))
    assert isinstance(section.content, Chart)
    assert "The run has its own stick limits, 37.5 N and -19 N" in section.content.caption


def test_intervals_of_a_law_that_lacks_something_are_said_to_be_its_own() -> None:
    for left, said in ((1.0, False), (22.0, True)):
        lines = " ".join(fit_lines(by_equation(left)))
        assert ("the 95 % intervals hold for this law only" in lines) == said


def test_without_a_mass_no_noise_of_the_acceleration_is_in_the_force() -> None:
    model = by_equation(22.0)
    model = replace(model, fit=replace(model.fit, force_relative=0.3))
    blank = replace(model.friction["m"], value=None, sd=None, assumed=1.0, reason="too slow")
    without = replace(model, friction={**model.friction, "m": blank})
    assert "the noise of the acceleration in it" in " ".join(fit_lines(model))
    assert "the noise of the acceleration in it" not in " ".join(fit_lines(without))
