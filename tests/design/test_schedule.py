"""A gain schedule in the loop: at one law it is that law, and nothing leaps where it changes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from design.controller_program import ProgramUnits, controller_program
from design.drive_law import DriveLaw, drive_law
from design.feed_forward import FeedForward
from design.pid import pd_to_rst, pid_to_rst
from design.present import cascade_to_rst
from design.program_run import ProgramRun
from design.schedule import Over, Schedule
from design.servo import Servo, simulate_servo
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant

H, FORGET = 1e-3, 0.05
AHEAD = FeedForward(10.0, 12.0, 20.0, 25.0, 2e-3, 3.0, 60.0)
FRICTION = (10.0, 12.0, 20.0, 25.0)
PLANT = Plant(Karnopp(3.0, 10.0, 12.0, 20.0, 25.0, 5e-3, -5e-3, 14.0, -15.0), Motor(1.0))


def cascade(times: float = 1.0) -> DriveLaw:
    return drive_law(cascade_to_rst(20.0, 300.0 * times, 0.1, H, eps=1e-3, v_ff=1.0), FORGET)


def pid(times: float = 1.0) -> DriveLaw:
    return drive_law(pid_to_rst(5000.0 * times, 0.2, 0.05, 2e-3, H, b=0.4, c=0.2), FORGET)


def schedule(over: Over, at: tuple[float, ...], *laws: DriveLaw) -> Schedule:
    friction = tuple((10.0 + 4.0 * i, 12.0, 20.0, 25.0 + i) for i in range(len(at)))
    return Schedule(over, at, laws, friction, FORGET, 5e-3)


def servo(law: DriveLaw, own: Schedule | None, limit: float = 25.0) -> Servo:
    return Servo(
        law.rst, None, friction=AHEAD, control_limit=limit, W=law.W, rate=0.3, acceleration=5.0,
        schedule=own,
    )  # fmt: skip


def steps(offset: float = 0.0) -> Array:
    rng = np.random.default_rng(0)
    r = np.repeat(0.05 * rng.integers(-2, 3, size=8), 400).astype(np.float64)
    r[:400] = 0.0
    return r + offset


@pytest.mark.parametrize("law", [cascade(), pid()])
def test_a_schedule_of_one_law_is_that_law_at_its_limit_too(law: DriveLaw) -> None:
    own = Schedule("place", (-0.1, 0.1), (law, law), (FRICTION, FRICTION), FORGET, 5e-3)
    fixed, scheduled = (simulate_servo(PLANT, servo(law, one), steps(), H) for one in (None, own))
    assert np.max(np.abs(fixed.u)) == 25.0  # it is clipped
    np.testing.assert_allclose(scheduled.u, fixed.u, atol=1e-6)
    np.testing.assert_allclose(scheduled.y, fixed.y, atol=1e-10)


@pytest.mark.parametrize("law", [cascade, pid])
def test_it_does_not_matter_where_the_position_is_counted_from(
    law: Callable[[float], DriveLaw],
) -> None:
    runs = []
    for offset in (0.0, 3.0):
        own = schedule("place", (offset - 0.1, offset + 0.1), law(0.5), law(1.5))
        r = steps(offset)
        one = replace(servo(law(1.0), own), acceleration=None)
        runs.append(simulate_servo(PLANT, one, r, H, start=(offset, 0.0, 0.0)))
    np.testing.assert_allclose(runs[1].y - 3.0, runs[0].y, atol=1e-8)


def test_at_rest_nothing_leaps_where_the_numbers_change() -> None:
    # The same machine is held at both ends of a table whose gains differ three times.
    own = schedule("place", (-0.1, 0.1), pid(0.5), pid(1.5))
    r = np.where(np.arange(8000) < 4000, -0.1, 0.1)
    run = simulate_servo(PLANT, servo(pid(), own, 100.0), r, H)
    assert abs(run.y[3999] + 0.1) < 1e-3 and abs(run.y[-1] - 0.1) < 1e-3


@pytest.mark.parametrize("over", ["place", "load", "direction"])
def test_the_program_of_a_schedule_gives_what_the_simulation_gave_in_every_bit(over: Over) -> None:
    at = {"place": (-0.1, 0.0, 0.1), "load": (0.0, 10.0, 40.0), "direction": (-1.0, 0.0, 1.0)}[over]
    one = servo(cascade(), schedule(over, at, cascade(0.6), cascade(), cascade(1.5)))
    run = simulate_servo(PLANT, one, steps(), H)
    program = controller_program("axis", one, H, ProgramUnits(), 1.0)
    assert {"points", "schedule"} <= {table.name for table in program.tables}
    step = ProgramRun(program, 0.0).step
    found = np.array([step(a, b) for a, b in zip(steps(), run.y_measured, strict=True)])
    np.testing.assert_array_equal(found, run.u)
    fixed = simulate_servo(PLANT, servo(cascade(), None), steps(), H)
    assert np.max(np.abs(fixed.u - run.u)) > 0.1  # the table counts


def test_what_is_no_schedule_is_refused() -> None:
    with pytest.raises(BadSpecification, match="that rise"):
        schedule("place", (0.1, 0.1), cascade(), cascade())
    with pytest.raises(BadSpecification, match="one of each"):
        schedule("place", (0.0, 0.1), cascade())
    no_sum = drive_law(pd_to_rst(100.0, 0.1, 1e-3, H), FORGET)
    with pytest.raises(BadSpecification, match="integrator"):
        schedule("place", (0.0, 0.1), no_sum, no_sum)
