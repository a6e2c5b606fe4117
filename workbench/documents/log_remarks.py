"""What to say of logs whose sizes no machine has: a remark changes nothing, it names what to look
at."""

from collections.abc import Mapping, Sequence

import numpy as np

from design.machine.plausible import extremes, rig_remarks, size_remark, travel_of
from identification.log import Log, Rig
from workbench.cards.card_tables import SignalSpec
from workbench.cards.headers import contradicted_units

_UNUSED = 1e-3  # share of the command's limit that a log reaches at least


def log_remarks(
    logs: Sequence[Log], rig: Rig, signals: Mapping[str, SignalSpec]
) -> tuple[str, ...]:
    """A line for each signal, and each number of the rig, whose size no machine has, or whose unit
    is not that of its header.

    signals: how the card reads them, for the units in the lines.
    """
    other = contradicted_units(signals, rig)
    named = {name: f"signals.{name}, read in {spec.unit!r}" for name, spec in signals.items()}

    def peak(name: str, logged: str = "") -> float:
        return max(float(np.max(np.abs(log.signals.get(logged, log[name])))) for log in logs)

    periods = [log.h for log in logs]
    seen = [("t", "period", h, "sampled every") for h in extremes(periods)]
    seen += [("y", "travel", max(map(travel_of, logs)), "the position covers")]
    if "F" in signals:
        seen += [("F", "force", peak("F", "F_logged"), "the force is at most")]
    pressures = (name for name in ("p_p", "p_n") if name in signals)
    seen += [(name, "pressure", peak(name), "the pressure is at most") for name in pressures]
    lines = [*other.values()] + [
        size_remark(quantity, value, rig, named.get(name, f"signals.{name}"), said)
        for name, quantity, value, said in seen
        if name not in other
    ]
    if rig.control_limit and "u" in signals and "u" not in other:
        most = peak("u")
        if 0 < most < _UNUSED * rig.control_limit:
            lines += [
                f"{named['u']}: the command reaches {most:.3g} of a control_limit_v ="
                f" {rig.control_limit:g}; check both units"
            ]
    return tuple(dict.fromkeys(line for line in (*lines, *rig_remarks(rig)) if line))
