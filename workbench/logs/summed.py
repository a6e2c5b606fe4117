"""Signals of which a log has what they go by: of a clock its steps, of a position its speed."""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array, frozen
from workbench.cards.card_tables import SignalSpec


def summed(x: Array, step: Array | None = None) -> Array:
    """The sum of x (n,) up to each row, from 0 on: of steps, or of a speed by the rule of trapezia
    where `step` (n,) is the time since the row before. What is missing is taken from its
    neighbours; a time that goes back counts as none."""
    known, rows = np.isfinite(x), np.arange(len(x))
    whole = np.interp(rows, rows[known], x[known]) if np.any(known) else x
    if step is not None:
        forward = np.where(np.isfinite(step), np.maximum(step, 0.0), 0.0)
        whole = forward * 0.5 * (whole + np.concatenate([whole[:1], whole[:-1]]))
    return frozen(np.cumsum(whole) - whole[0])


def with_sums(
    signals: dict[str, Array], specs: Mapping[str, SignalSpec]
) -> tuple[dict[str, Array], list[str]]:
    """The signals, of which positions are summed where the log has their speed, and what is said
    of that."""
    said = list[str]()
    for name in (name for name, spec in specs.items() if spec.summed and name != "t"):
        with np.errstate(invalid="ignore"):  # of times that are none, which are refused later
            step = np.diff(signals["t"], prepend=signals["t"][:1])
        signals = {**signals, name: summed(signals[name], step)}
        said.append(
            f"{name!r} is the speed {specs[name].column!r} summed over time: so is its noise, which"
            " makes part of what a run leaves of the position, and of what seems missing"
        )
    return signals, said
