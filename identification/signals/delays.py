"""How late signals act on each other, and whether a position comes before its reference."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.log import Log
from identification.signals.differentiate import Motion, low_pass
from identification.signals.relations import command_lag, lead
from identification.signals.sensor_state import SensorState

LONGEST_LAG = 0.1  # s that a command may act late
HALF_A_HOLD, LEAST_LAG = 0.5, 0.5  # samples: of a zero-order hold, and that are reported
SURE_LAG = 0.01  # share of the equation that a lag explains beyond none, to be reported


@dataclass(frozen=True)
class Delay:
    """By how much one signal acts late on another [s], None where none shows; alike: of a
    reference, the correlation that it then has with the position."""

    of: str
    on: str
    seconds: float | None
    alike: float | None = None


def are_exchanged(behind: float) -> bool:
    """Whether a position so many samples behind its reference comes before it."""
    return behind < -1.0


def delays_of(log: Log, motion: Motion, late_command: float | None) -> tuple[Delay, ...]:
    """How late the command acts, and how far the position is behind its reference.

    late_command [s]: of a motor, as the equation of motion or its run shows it, 0 where it shows
    none; None of an actuator.
    """
    out = []
    if "u" in log and "F" in log and np.ptp(log["u"]) > 0.0:
        if late_command is None:
            u, F = (low_pass(log[key], log.h, motion.cutoff) for key in ("u", "F"))
            others = np.column_stack([motion.v, np.ones(len(log))])
            longest = max(2, round(LONGEST_LAG / log.h))
            late, gain = command_lag(np.gradient(F, log.h), others, u, longest)
            late -= HALF_A_HOLD  # a zero-order hold acts half of it later on the average
            shown = late * log.h if gain > SURE_LAG and late > LEAST_LAG else None
            out.append(Delay("u", "force", shown))
        else:
            out.append(Delay("u", "motion", late_command or None))
    if "r" in log and np.ptp(log["r"]) > 0.0:
        found = lead(log["r"], log["y"])
        shown = found.samples * log.h if found.likeness > 0.5 else None
        out.append(Delay("r", "y", shown, found.likeness))
    return tuple(out)


def exchanged_columns(delays: Sequence[Delay], sensors: Sequence[SensorState], h: float) -> str:
    """What is said of a position that comes before its reference, and that has less of a sensor's
    noise than this, or is ahead by more than a sample; else empty."""
    late = next((one.seconds for one in delays if one.of == "r"), None)
    if late is None or late > -LEAST_LAG * h:
        return ""
    noise = {one.name: np.hypot(one.noise, one.step / np.sqrt(12.0)) for one in sensors}
    if not are_exchanged(late / h) and noise["r"] <= noise["y"]:
        return ""
    return (
        f"the position is ahead of its reference by {-1e3 * late:.3g} ms, as no loop makes it: the"
        " columns of r and y look exchanged; exchange them in the card"
    )
