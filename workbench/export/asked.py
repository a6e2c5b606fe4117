"""What a user says beside a model, as texts with units, in SI."""

import math

from identification.errors import BadModel
from workbench.cards.quantities import in_unit_of
from workbench.export.compensation import AtMotor, Encoder, TablesAsked


def tables_asked(
    rotary: bool,
    name: str | None,
    speed: str | None,
    per_turn: str | None,
    rated: str | None,
    encoder: Encoder | None,
) -> TablesAsked:
    """The options in SI; raises BadModel where one is no positive number of its kind."""
    turn = _positive(per_turn, "deg" if rotary else "mm", "--per-turn")
    travel = None if turn is None else (math.radians(turn) if rotary else 1e-3 * turn)
    high = _positive(speed, "rad/s" if rotary else "mm/s", "--speed")
    unit = AtMotor(rotary, travel).torque_unit
    return TablesAsked(
        name=name,
        high=high if high is None or rotary else 1e-3 * high,
        per_turn=travel,
        rated=_positive(rated, unit, "--rated"),
        encoder=encoder,
    )


def _positive(written: str | None, unit: str, option: str) -> float | None:
    """The number in `unit`, which it has where it says none."""
    if written is None:
        return None
    found = in_unit_of(written, unit, option)
    if found is None or not (math.isfinite(found) and found > 0):
        raise BadModel(f"{option} {written!r}: a number above 0 needed, in {unit!r} or its like")
    return found
