"""The compensator that a design has: beside an integrator the excess alone, which does not hunt."""

from dataclasses import replace

import numpy as np

from design.asked import Limits
from design.closed_loop.driven_loop import driven_loop
from design.closed_loop.loop_figures import COMPENSATED, tried_loop
from design.controllers.recommend import compared
from design.controllers.usual_compensator import usual_compensator, whole_compensator
from design.machine.model import Model
from design.tune import Asked
from identification.model.karnopp import Karnopp
from tests.chain import designed, model_of

AXIS = Karnopp(4.0, 16.0, 14.0, 60.0, 50.0, 1e-4, -1e-4, 18.0, -16.0)


def axis() -> Model:
    model = model_of(AXIS, k_a=30.0)
    return replace(model, fit=replace(model.fit, noise_y=3e-7))


def test_beside_an_integrator_it_does_not_hunt_where_the_whole_friction_does() -> None:
    model = axis()
    found = designed(model, period=2e-3)
    assert found.compensator.excess
    figures = compared(model, found)
    for name, one in found.controllers.items():
        beside = figures[name + COMPENSATED]
        assert beside.limit_cycle is None
        assert beside.standstill <= max(figures[name].standstill, found.compensator.e_T)
        whole = whole_compensator(model, found.plant.h)
        loop = driven_loop(model, replace(found, compensator=whole), one, whole.value)
        hunts, _ = tried_loop(model, model, found, loop, Limits(), np.random.default_rng(0))
        assert hunts.limit_cycle is not None and hunts.standstill > 10.0 * beside.standstill


def test_without_an_integrator_it_gives_the_whole_friction() -> None:
    model = axis()
    found = designed(model, Asked(integrator=False), period=2e-3)
    assert found.compensator == whole_compensator(model, 2e-3) and not found.compensator.excess
    figures = compared(model, found)
    assert figures["rst" + COMPENSATED].standstill < 0.2 * figures["rst"].standstill


def test_without_noise_the_error_scale_is_that_of_the_whole_one() -> None:
    model = axis()
    quiet = replace(model, fit=replace(model.fit, noise_y=0.0))
    own = usual_compensator(quiet, 2e-3, designed(model, period=2e-3).controllers.values())
    assert own.excess and own.e_T == whole_compensator(quiet, 2e-3).e_T
