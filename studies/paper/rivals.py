"""The countermeasures that the paper's introduction names, beside its compensator, in one table.

Each is tuned on the plant it is judged on, by the sum of squared errors under other noise: the
rivals get the benefit of the doubt.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from design.rivals import DisturbanceObserver, Dither, FrictionObserver, IntegralPID
from design.servo import Servo
from identification.errors import BadModel
from identification.model.karnopp import Karnopp
from studies.paper.measures import Case, measure
from studies.paper.settings import (
    NOISE_Y,
    TABLE_1_ESTIMATED,
    SetUp,
    friction_of,
    simulation,
    simulation_pd,
    simulation_pid,
)

GAINS = (3.0, 10.0, 30.0, 100.0, 300.0)
ZONES = (3e-4, 1e-3, 3e-3, 1e-2)  # m
DITHER_FREQUENCIES = (20.0, 50.0, 100.0)  # Hz
EXCESS = (1.2, 2.0, 4.0)  # of the dither's force over the largest stick force, actuator alone
BANDS = (10.0, 20.0, 40.0, 80.0)  # rad/s
RANDOM_WALKS = (50.0, 200.0, 1000.0)  # N per root s
DRIVEN = 0.05  # m/s per root s: what drives the observer's velocity besides the forces


@dataclass(frozen=True)
class RivalServo:
    """A countermeasure with the setting that was best for it, in words."""

    setting: str
    case: Case


def rivals(table: int, seeds: Sequence[int], tuning_seed: int) -> dict[str, RivalServo]:
    """All of them on the plant of `table`, with the compensator and the plain PD and PID.

    What rests on a model has, on table 1, the paper's estimates of it, on table 3 the true values.
    """
    set_up, truth = simulation(), friction_of(table)
    known = TABLE_1_ESTIMATED if table == 1 else truth
    out = {}
    for name, choices in rival_servos(set_up, known):
        tried = []
        for setting, servo in choices:
            try:
                case = measure(set_up, truth, servo, [tuning_seed])
            except BadModel:  # this setting's loop runs away
                continue
            tried.append((case.figures.squared_error, setting, servo))
        _, setting, servo = min(tried, key=lambda one: one[0])
        out[name] = RivalServo(setting, measure(set_up, truth, servo, seeds))
    return out


def rival_servos(set_up: SetUp, known: Karnopp) -> Iterable[tuple[str, list[tuple[str, Servo]]]]:
    """Every rival with the settings to choose from, each in words and as a servo."""
    pd, pid, compensation = simulation_pd(), simulation_pid(), set_up.compensation(known)
    yield "PD", [("k_d = 200 N/m", set_up.servo(pd))]
    yield (
        "PD, high gain",
        [(f"k_d = {200 * gain:g} N/m", set_up.servo(simulation_pd(gain))) for gain in GAINS],
    )
    yield "PD, dither", list(_dithered(set_up, known))
    yield (
        "PD, disturbance observer",
        [
            (f"{w:g} rad/s", set_up.servo(pd, DisturbanceObserver(known.m, _viscous(known), w)))
            for w in BANDS
        ],
    )
    yield (
        "PD, Kalman friction observer",
        [(f"q_F = {q:g} N/s^0.5", set_up.servo(pd, _observer(known, q))) for q in RANDOM_WALKS],
    )
    yield "PD, compensator (4)", [("paper's", set_up.servo(pd, compensation))]
    yield "PID", [("paper's", set_up.servo(pid))]
    yield (
        "PID, dead zone in the integral",
        [(f"{1e3 * zone:g} mm", set_up.servo(_integral(zone))) for zone in ZONES],
    )
    reset = IntegralPID(1754.0, 0.072, 0.018, 0.2, set_up.h, "reset")
    yield "PID, integral reset", [("where the error changes sign", set_up.servo(reset))]
    yield "PID, compensator (4)", [("paper's", set_up.servo(pid, compensation))]


def _dithered(set_up: SetUp, known: Karnopp) -> Iterable[tuple[str, Servo]]:
    for frequency in DITHER_FREQUENCIES:
        for excess in EXCESS:
            force = excess * max(known.F_sp, -known.F_sn)
            amplitude = force * 2.0 * np.pi * frequency / set_up.actuator.k1
            yield (
                f"{amplitude:.2g} V at {frequency:g} Hz",
                Servo(
                    simulation_pd(),
                    set_up.force,
                    dither=Dither(amplitude, frequency),
                    control_limit=set_up.control_limit,
                ),
            )


def _integral(zone: float) -> IntegralPID:
    return IntegralPID(1754.0, 0.072, 0.018, 0.2, 1e-3, "dead-zone", zone)


def _observer(known: Karnopp, random_walk: float) -> FrictionObserver:
    return FrictionObserver(known.m, known.F_vp, known.F_vn, DRIVEN, random_walk, NOISE_Y)


def _viscous(p: Karnopp) -> float:
    return 0.5 * (p.F_vp + p.F_vn)
