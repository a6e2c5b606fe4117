"""Intervals of a model beside those that its logs promised before the fit."""

from design.machine.model import Model
from identification.model.estimates import NORMAL_95

BROKEN = 2.0  # times what a log promised before the fit, above which an interval is reported


def broken_promises(model: Model) -> tuple[str, ...]:
    """A line where intervals are far wider than the logs promised before the fit."""
    wider, known = [], {**model.friction, **(model.actuator or {})}
    for one in model.identifiability:
        found = known.get(one.name)
        if not found or one.within is None or not found.value or found.sd is None:
            continue
        half = NORMAL_95 * found.sd / abs(found.value)
        if half > BROKEN * one.within:
            wider.append(f"{one.name} {100 * half:.2g} % ({100 * one.within:.2g} %)")
    if not wider:
        return ()
    why = "a stop is lost" if model.fit.adequate else "the model lacks an effect"
    return (
        f"intervals are wider than predicted from the logs (in brackets): {', '.join(wider)};"
        f" {why}, or their noise is not the sensors' alone",
    )
