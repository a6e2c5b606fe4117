"""Figures 6, 7 and 8: the compensator in the simulation of section 3.2."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from design.compensator import Inner
from design.servo import Compensation, Servo
from studies.paper.measures import Case, compare
from studies.paper.settings import (
    TABLE_1_ESTIMATED,
    SetUp,
    friction_of,
    simulation,
    simulation_pd,
    simulation_pid,
    steps,
)


@dataclass(frozen=True)
class SimulationFigures:
    """Servos by name: PD (figures 6 and 7), PID on table 1 (figure 8) and on table 3."""

    set_up: SetUp
    long: SetUp
    pd: dict[str, Case]
    pid: dict[str, Case]
    pid_table_3: dict[str, Case]


def variants(what: Compensation) -> dict[str, Compensation | None]:
    """No compensator and its forms; eq. (2): F_stick in the whole band, viscous terms."""

    def of(inner: Inner, *, viscous: bool = False, stick: bool = True) -> Compensation:
        one = replace(what.compensator, inner=inner, viscous=viscous, stick=stick)
        return replace(what, compensator=one)

    return {
        "none": None,
        "no zero-velocity": of("none"),
        "F_stick in the band": of("stick"),
        "eq. (2)": of("stick", viscous=True),
        "eq. (4)": what,
        "eq. (4), no F_stick": of("zero-velocity", stick=False),
    }


def simulation_figures(seeds: Sequence[int]) -> SimulationFigures:
    """Table 1's plant with the compensator of table 1's estimates, and table 3's with its own."""
    set_up = simulation()
    # A limit cycle may take seconds: one step and a long stand.
    long = set_up.along(steps(set_up.h, 0.1, 60.0, 1))

    def servos(position: str, what: Compensation) -> dict[str, Servo]:
        law = simulation_pd() if position == "PD" else simulation_pid()
        return {name: set_up.servo(law, one) for name, one in variants(what).items()}

    true, later = friction_of(1), friction_of(3)
    estimated = set_up.compensation(TABLE_1_ESTIMATED)
    own = set_up.compensation(later)
    return SimulationFigures(
        set_up=set_up,
        long=long,
        pd=compare(set_up, true, servos("PD", estimated), seeds),
        pid=compare(long, true, servos("PID", estimated), seeds),
        pid_table_3=compare(long, later, servos("PID", own), seeds),
    )
