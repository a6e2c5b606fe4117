"""The program of a servo does what the simulation does, in every bit; the reader's rules."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.compensator import INNERS, Compensator
from design.controller_program import ProgramUnits, controller_program
from design.filters import filters_at, rig_filters, simulation_filters
from design.force_pi import ForcePI
from design.kernel_reader import KernelReader, NamedArray
from design.loop import LoopNoise
from design.pid import pd_to_rst, pid_to_rst
from design.program import Assign, Choice, Constant, Number, Program, Repeat, Variable, flat
from design.program_run import ProgramRun, self_test
from design.rivals import RULES, DisturbanceObserver, Dither, FrictionObserver, IntegralPID
from design.rst import RST
from design.servo import Compensation, Servo, simulate_servo
from identification.arrays import Array
from identification.compiled import compiled_exact
from identification.errors import BadModel
from identification.model.plant import Motor, Plant
from tests.identification.plants import ACTUATOR, table

H, N, K_A = 1e-3, 300, 35.0
UNITS = ProgramUnits()


def bits(values: Sequence[float] | Array) -> Array:
    return np.asarray(values, dtype=np.float64).view(np.int64)


def positions(h: float) -> st.SearchStrategy[RST | IntegralPID]:
    """PD, PID and others with a tracking model, and PIDs with a rule for their integral."""
    pd, pid = pd_to_rst(200.0, 0.1, 0.2, h), pid_to_rst(1754.0, 0.072, 0.018, 0.2, h)
    model = RST(pid.R, pid.S, pid.T, h, B_m=np.array([0.0, 0.2]), A_m=np.array([1.0, -0.8]))
    scaled = RST(2.0 * pid.R, 2.0 * np.convolve(pid.S, [1.0, 0.3]), 2.0 * pid.T, h)
    ruled = [IntegralPID(1754.0, 0.072, 0.018, 0.2, h, rule, 0.001) for rule in RULES]
    return st.sampled_from([pd, pid, model, scaled, *ruled])


@st.composite
def servos(draw: st.DrawFn) -> tuple[Servo, bool]:
    """A servo and whether it drives a motor."""
    motor = draw(st.booleans())
    ratio = 1 if motor else draw(st.sampled_from([1, 3, 10]))
    h = ratio * H
    inner, stick, viscous = draw(st.sampled_from(INNERS)), draw(st.booleans()), draw(st.booleans())
    own = Compensator(table(draw(st.integers(1, 3))), 2.0, 0.003, inner, stick, viscous)
    filters = draw(st.sampled_from([filters_at(h), rig_filters(h), simulation_filters(h)]))
    position = draw(positions(h))
    if motor and isinstance(position, RST):
        position = RST(
            position.R / K_A, position.S, position.T / K_A, h, B_m=position.B_m, A_m=position.A_m
        )
    servo = Servo(
        position,
        None if motor else ForcePI(0.02, 0.05),
        draw(st.sampled_from([None, Compensation(own, filters)])),
        control_limit=draw(st.sampled_from([None, 0.3, 5.0])),
        force_limit=draw(st.sampled_from([None, 25.0])),
        anti_windup=draw(st.sampled_from([None, 0.0, 0.05])),
        rate=draw(st.sampled_from([None, 0.2])),
    )
    return servo, motor


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(servos(), st.integers(0, 2**31))
def test_the_program_is_the_simulations_step(made: tuple[Servo, bool], seed: int) -> None:
    servo, motor = made
    rng = np.random.default_rng(seed)
    plant = Plant(table(1), Motor(K_A) if motor else ACTUATOR)
    y_0 = float(rng.uniform(-0.1, 0.1))
    r = y_0 + 0.05 * np.repeat(rng.standard_normal(3), N // 3)
    noise = LoopNoise.draw(N, 1e-4, 1.0, rng)
    run = simulate_servo(plant, servo, r, H, noise=noise, start=(y_0, 0.0, 0.0))
    program = controller_program("one", servo, H, UNITS, K_A if motor else 0.0)
    step = ProgramRun(program, y_0)
    columns = {"r": r, "y": run.y_measured, "F_e": run.F_measured}
    inputs = zip(*(columns[one.name].tolist() for one in program.inputs), strict=True)
    assert np.array_equal(bits([step.step(*row) for row in inputs]), bits(run.u))


@pytest.mark.method
@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(servos())
def test_the_test_vector_takes_every_branch_of_a_friction_compensator(
    made: tuple[Servo, bool],
) -> None:
    servo, motor = made
    program = controller_program("one", servo, H, UNITS, K_A if motor else 0.0)
    vector = self_test(program, table(1), 0.003)
    run = ProgramRun(program)
    for row in vector.inputs.tolist():
        run.step(*row)
    friction = [
        one for one in flat(program.statements)
        if isinstance(one, Choice) and "dv_p" in repr(one.condition)
    ]  # fmt: skip
    assert (len(friction) > 0) == (servo.friction is not None)
    for one in friction:
        assert {(id(one), True), (id(one), False)} <= run.visited


def test_names_are_distinguished_in_small_letters() -> None:
    servo = Servo(
        pid_to_rst(1754.0, 0.072, 0.018, 0.2, H), ForcePI(0.02, 0.05),
        Compensation(Compensator(table(1), 2.0, 0.003), filters_at(H)), control_limit=1.0, rate=1.0,
    )  # fmt: skip
    program = controller_program("one", servo, H, UNITS)
    groups = (program.inputs, program.constants, program.tables, program.states, program.locals)
    names = [one.name.lower() for group in groups for one in group]
    assert len(set(names)) == len(names)
    assert program.output.name not in names


@pytest.mark.parametrize(
    "servo",
    [
        Servo(pd_to_rst(200.0, 0.1, 0.2, H), ForcePI(0.02, 0.05), dither=Dither(0.2, 50.0)),
        Servo(
            pd_to_rst(200.0, 0.1, 0.2, H),
            ForcePI(0.02, 0.05),
            FrictionObserver(1.0, 300.0, 200.0, 0.05, 200.0, 1e-5),
        ),
        Servo(
            pd_to_rst(200.0, 0.1, 0.2, H),
            ForcePI(0.02, 0.05),
            DisturbanceObserver(1.0, 250.0, 40.0),
        ),
    ],
)
def test_what_no_program_holds_is_refused(servo: Servo) -> None:
    with pytest.raises(BadModel):
        controller_program("one", servo, H, UNITS)


@compiled_exact
def swapped(s: Array) -> float:
    s[0], s[1] = s[1], s[0]
    return float(s[0])


@compiled_exact
def raised(s: Array, x: float) -> float:
    s[0] = s[0] + x
    return float(s[0])


@compiled_exact
def read_too_late(s: Array, x: float) -> float:
    return float(s[0] + raised(s, x))


@compiled_exact
def argument_changes(s: Array, x: float) -> float:
    raised(s, 1.0)
    return float(x)


@compiled_exact
def passes_a_state(s: Array) -> float:
    return float(argument_changes(s, s[0]))


@compiled_exact
def sums(s: Array, x: float) -> float:
    total = 0.0
    for j in range(3):
        total = total + s[j] * x
    return float(total)


@compiled_exact
def scaled(s: Array, x: float) -> None:
    for j in range(3):
        s[j] = s[j] * x


@compiled_exact
def nested(s: Array, x: float) -> None:
    for j in range(2):
        s[j] = x
        scaled(s, x)


@compiled_exact
def branches(s: Array, x: float) -> float:
    level = 1.0
    if x > 0.0:
        level = 2.0
    if s[0] > level:
        return float(s[0])
    for j in range(1):
        s[j] = x
    return float(level if x < -1.0 else s[1])


def read(kernel: Any, *arguments: Any, size: int = 4) -> tuple[KernelReader, Any]:
    reader = KernelReader(["x"], ["s"])
    return reader, reader.read(kernel, (NamedArray("s", size, ""), *arguments))


@pytest.mark.parametrize("kernel", [swapped, read_too_late, passes_a_state])
def test_a_value_that_would_have_changed_is_refused(kernel: Any) -> None:
    given = () if kernel in (swapped, passes_a_state) else (Variable("x"),)
    with pytest.raises(BadModel, match="used after it has changed"):
        read(kernel, *given)


@pytest.mark.parametrize("kernel", [sums, nested])
def test_a_sum_over_a_loop_and_a_loop_in_a_loop_of_one_index_are_refused(kernel: Any) -> None:
    with pytest.raises(BadModel, match="loop"):
        read(kernel, Variable("x"))


@given(st.floats(-3.0, 3.0), st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=2))
def test_branches_and_returns_are_those_of_the_kernel(x: float, start: list[float]) -> None:
    reader, result = read(branches, Variable("x"), size=2)
    statements = (*reader.statements, Assign(Variable("u"), result))
    program = Program(
        "one", 1.0, 1, (), _signal("u"), (), (), (), tuple(reader.locals.values()), statements
    )
    run = ProgramRun(program)
    run._values["x"], run._arrays["s"] = x, list(start)
    state = np.array(start)
    assert run.step() == branches.py_func(state, x)  # type: ignore[attr-defined]
    assert run._arrays["s"] == state.tolist()
    assert not any(isinstance(one, Repeat) for one in statements)


def _signal(name: str) -> Any:
    from design.program import Signal

    return Signal(name, "1", "")


@compiled_exact
def limited(x: float, limit: float) -> float:
    return float(min(max(x, -limit), limit))


@pytest.mark.parametrize(("limit", "bounded"), [(np.inf, False), (2.0, True)])
def test_a_bound_that_nothing_reaches_is_left_out(limit: float, bounded: bool) -> None:
    reader = KernelReader(["x"], ["limit"])
    result = reader.read(limited, (Variable("x"), Constant("limit", limit)))
    assert (result != Variable("x")) == bounded


@compiled_exact
def unknown(x: float) -> float:
    return float(np.exp(x))


@compiled_exact
def endless(x: float) -> float:
    while x > 0.0:
        x -= 1.0
    return float(x)


@pytest.mark.parametrize("kernel", [unknown, endless])
def test_what_the_reader_does_not_know_is_named(kernel: Any) -> None:
    with pytest.raises(BadModel, match=kernel.__name__):
        KernelReader(["x"], []).read(kernel, (Variable("x"),))


def test_a_function_that_is_no_kernel_is_refused() -> None:
    with pytest.raises(BadModel, match="len"):
        KernelReader([], []).read(len, (Number(1.0),))
