"""Which kind a log looks like: said where it is taken for the other one, and only there."""

from design.identified.velocity import looks_like_friction, looks_like_velocity
from identification.log import Rig
from identification.velocity.fit import fit
from identification.velocity.record import recorded
from identification.velocity.rivals import held_out
from tests.identification.motor_logs import made as made_motor
from tests.identification.velocity.made import made

MOTOR, FORCE = Rig("motor", force_per_command=1.0), Rig("force")
VALVE = made(90, duration=30.0)


def test_a_valve_taken_for_a_motor() -> None:
    (said,) = looks_like_velocity([VALVE], MOTOR)
    assert said.startswith('the log looks like kind = "velocity"') and "0.2" in said


def test_a_valve_whose_command_is_taken_for_a_force() -> None:
    log = VALVE.with_signals(F=VALVE["u"])
    alone = type(log)(log.name, {name: log[name] for name in ("t", "y", "F")})
    assert looks_like_velocity([alone], FORCE)
    assert looks_like_velocity([log], FORCE) == ()  # F is measured beside the command


def test_a_motor_is_none() -> None:
    log = made_motor(3)
    assert looks_like_velocity([log], MOTOR) == ()
    record = recorded([log])
    found = fit(record)
    errors = held_out(record, found.valve, found.free, None)
    (said,) = looks_like_friction(record, found.valve, errors, Rig("velocity"))
    assert said.startswith('the log looks like kind = "motor"')


def test_a_log_too_short_to_tell_says_nothing() -> None:
    assert looks_like_velocity([made(91, duration=6.0)], MOTOR) == ()
