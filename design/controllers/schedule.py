"""Model + Design -> a gain schedule: the same controllers, designed at points along the travel,
over the load or for each direction, and judged against the fixed ones in simulation."""

from dataclasses import replace

import numpy as np

from design.asked import Limits
from design.closed_loop.driven_loop import driven_loop, scheduled_loop
from design.closed_loop.local_friction import (
    CHANGES_FROM,
    asked_for,
    change_over,
    levels_over,
    local,
    range_over,
)
from design.closed_loop.loop_figures import tried_loop
from design.compensation_tables import spread_points, table_points
from design.controllers.clear_win import contest
from design.controllers.design import effort_limit, placed_design
from design.controllers.recommend import USUAL_SEED
from design.machine.design import Controller, Design, GainSchedule, ScheduledController, Structure
from design.machine.model import Model
from design.schedule import Over
from design.tune import Asked, Goals
from identification.errors import BadModel, BadSpecification

SCHEDULED_STRUCTURES: tuple[Structure, ...] = ("pid", "p-pi")
MOST_POINTS, FEWEST_POINTS = 17, 3  # of a table
ALONG_THE_TABLE = 400  # points at which the friction is looked at
OF_FRICTION = 0.02  # that straight lines between the points may be off


def scheduled(
    model: Model, found: Design, over: Over, asked: Asked | None = None, goals: Goals | None = None
) -> Design:
    """The design with a schedule of its PID and P-PI over what is asked, each with its verdict.

    Each point is designed by the same placement as the fixed controller, at its period, on the
    model's friction there. Raises BadModel where the friction does not change over it, or a
    controller could not be designed at a point.
    """
    if change_over(model, over) <= CHANGES_FROM:
        also = asked_for(model)
        also_said = f"; it changes with {' and '.join(also)}" if also else ""
        raise BadModel(
            f"no schedule over {over}: no effect of the model changes its friction with it by"
            f" {100 * CHANGES_FROM:g} %; leave the fixed controller{also_said}"
        )
    at = _points(model, over)
    names = [n for n in SCHEDULED_STRUCTURES if n in found.controllers]
    if not names:
        raise BadModel("the design has no PID and no P-PI to schedule; add --structure")
    each = [_designed_at(model, over, value, found, (asked, goals), names) for value in at]
    # Of a direction each controller has its own friction fed forward anyway.
    here = [model if over == "direction" else local(model, over, value) for value in at]
    rows = tuple((p.F_cp, p.F_cn, p.F_vp, p.F_vn) for p in (one.karnopp for one in here))
    controllers: dict[Structure, ScheduledController] = {
        name: ScheduledController(tuple(one[name] for one in each), False, "") for name in names
    }
    table = GainSchedule(over, at, rows, controllers)
    judged = {name: _judged(model, replace(found, schedule=table), name) for name in names}
    return replace(found, schedule=replace(table, controllers=judged))


def _points(model: Model, over: Over) -> tuple[float, ...]:
    """The points of the table: as few as straight lines need."""
    if over == "direction":
        return (-1.0, 1.0)
    low, high = range_over(model, over)
    curve = levels_over(model, over)
    x = np.linspace(low, high, ALONG_THE_TABLE)
    table = table_points(curve, x, MOST_POINTS, OF_FRICTION)
    few = spread_points(table, curve, max(len(table.x), FEWEST_POINTS))
    return tuple(few.x.tolist())


def _designed_at(
    model: Model, over: Over, value: float, found: Design,
    wanted: tuple[Asked | None, Goals | None], names: list[Structure],
) -> dict[Structure, Controller]:  # fmt: skip
    """The controllers at a point, by the placement of the fixed ones."""
    here = local(model, over, value)
    asked, goals = wanted
    own = replace(goals or Goals(), effort=effort_limit(here))
    try:
        made = placed_design(
            here, asked, goals=own, source=found.plant.source, period=found.plant.h,
            structures=names,
        )  # fmt: skip
    except BadSpecification as error:
        raise BadModel(f"no schedule over {over}: at {value:.4g} {error}") from None
    missing = [name for name in names if name not in made.controllers]
    if missing:
        why = made.refused.get(missing[0], "none")
        raise BadModel(f"no schedule over {over}: no {missing[0].upper()} at {value:.4g}: {why}")
    return {name: made.controllers[name] for name in names}


def _judged(model: Model, found: Design, name: Structure) -> ScheduledController:
    """A controller's schedule against its fixed one, on the machines that there may be."""
    assert found.schedule is not None
    one = found.schedule.controllers[name]
    loop = scheduled_loop(model, found, name)
    fixed = driven_loop(model, found, found.controllers[name])
    missed = next((each.missed[0] for each in one.points if each.missed), None)
    if missed is not None:
        return replace(one, why=f"leave it: a point misses a goal, {missed}")
    rng, limits = np.random.default_rng(USUAL_SEED), Limits()
    ours, its = (tried_loop(model, model, found, it, limits, rng)[0] for it in (loop, fixed))
    if its.passed and not ours.passed:
        return replace(one, why=f"leave it: with it the loop misses a limit, {ours.missed[0]}")
    against = contest(model, found.force, loop, fixed)
    if not against.clear:
        return replace(one, why=f"leave it, no clear win over the fixed one: {against.words}")
    return replace(one, recommended=True, why=f"clearly better than the fixed one: {against.words}")
