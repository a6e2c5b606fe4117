"""What a first card cannot hold: gaps, delays, axes, doubled names, a clock that a velocity
denies."""

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from identification.signals.even_clock import rows_lost
from identification.signals.relations import lead
from workbench.cards.headers import words_of
from workbench.steps.first_card.axes import is_position
from workbench.steps.first_card.columns import NEARLY_ALIKE, Columns
from workbench.steps.first_card.pairs import follows
from workbench.steps.first_card.refusals import without_sign
from workbench.steps.first_card.roles import MOSTLY_ITS_LAW, Roles, are_constant
from workbench.steps.first_card.sizes import UnitGuess, factor
from workbench.steps.first_card.unit_guess import contradicted_clock

CONTROLLERS = {"controller", "pid", "pi", "pd", "regler", "regulator"}  # in a header
DRIVING = ("F", "u", "p_p", "p_n")
BALANCED = 2.0  # times the Coulomb level, that a force has to be off zero for a pressure's area


def remarks_on(columns: Columns, roles: Roles, units: Mapping[str, UnitGuess]) -> Iterator[str]:
    """The remarks of a card, each a line."""
    clock = units["t"]
    second = factor(clock.unit) if clock.gain is None else 1.0 / float(clock.gain.split()[0])
    h = columns.step * second
    yield from _of_clock(columns, second, h)
    yield from _of_names(columns, roles)
    if (ratio := contradicted_clock(columns, roles, dict(units))) is not None:
        slow = f"{ratio:.3g} times too fast" if ratio > 1.0 else f"{1.0 / ratio:.3g} times too slow"
        yield (
            f"the velocity {roles.columns['v'].shown} is {ratio:.3g} times the derivative of the"
            f" position by this clock: the clock runs {slow}, or the unit of position"
            f" ({units['y'].unit}) or velocity ({units['v'].unit}) is another"
        )
    both = roles.law.friction is not None  # of a motion one way, what is off zero may be friction
    if both and roles.kind == "force" and not {"p_p", "p_n"} & set(roles.columns):
        balance, coulomb = abs(roles.law.balance), abs(roles.law.coulomb)
        if balance > BALANCED * coulomb:
            yield (
                f"the force is {balance:.3g} {units['F'].unit} off zero between its two directions,"
                f" friction {coulomb:.3g}: a pressure on an area, a weight or an offset is in it"
            )
    drives = {name: roles.columns[name] for name in DRIVING if name in roles.columns}
    if roles.law.share < MOSTLY_ITS_LAW and not are_constant(drives):
        yield (
            f"inertia and friction explain only {roles.law.share:.0%} of what drives: a weight or a"
            " spring is in it, or it is not what drives this position"
        )
    if "u" in roles.columns and (unsigned := without_sign([roles.columns[k] for k in "uy"])):
        yield unsigned
    if "u" in roles.columns and set(words_of(roles.columns["u"].raw.header)) & CONTROLLERS:
        yield (
            f"by its header {roles.columns['u'].shown} is a controller's output: where the drive"
            " adds a feedforward of its own, this is missing here, and friction comes out too"
            " small; log what drives the motor, the sum of both (total current or torque)"
        )
    behind = behind_reference(roles)
    if behind is not None:
        late = 1e3 * behind * h * columns.grid
        said = f"the position follows the reference by {late:.3g} ms"
        if late < 0.0:
            said = "the position follows the reference within a sample"
        if are_exchanged(behind):
            said = (
                f"the position is ahead of the reference by {-late:.3g} ms, as no loop makes it:"
                " the two columns may be the other way round"
            )
        yield said


def behind_reference(roles: Roles) -> float | None:
    """Samples of the columns by which the position follows its reference; None where it follows
    none."""
    if "r" not in roles.columns:
        return None
    found = lead(roles.columns["r"].x, roles.columns["y"].x)
    return found.samples if follows(found) else None


def are_exchanged(behind: float) -> bool:
    """Whether a position so many samples behind its reference comes before it."""
    return behind < -1.0


def _of_clock(columns: Columns, second: float, h: float) -> Iterator[str]:
    """Rows, their period, how even it is, and gaps."""
    steps = np.diff(columns.clock.values) * second
    uneven = float(np.std(steps[steps < 3.0 * h]) / h)
    even = "an even clock" if uneven < 1e-3 else f"a clock that jitters by {uneven:.1%}"
    lost = rows_lost(second * columns.clock.values, h)
    if uneven >= 1e-3 and lost:
        even = f"an even clock, {lost} of whose rows are lost"
    yield f"{len(columns.clock.values)} rows every {h:.4g} s, {even}"
    gaps = int(np.sum(steps > 5.0 * h))
    if gaps:
        many = f"{gaps} gap" + ("s" if gaps > 1 else "")
        yield f"{many} in the clock, the longest of {float(np.max(steps)):.4g} s"


def _of_names(columns: Columns, roles: Roles) -> Iterator[str]:
    """Axes of the log, and names that several columns have."""
    if columns.axes:
        y = roles.columns["y"]
        said = f"this card is of {y.axis}" if y.axis else "this card is of none of them"
        yield (
            f"{len(columns.axes)} axes in this log: {', '.join(columns.axes)}; {said}, another is"
            " had by --axis NAME"
        )
        others = [one for one in columns.signals if one.axis not in ("", y.axis)]
        twins = [one for one in others if is_position(one.header)
                 and np.corrcoef(one.x, y.x)[0, 1] > NEARLY_ALIKE]  # fmt: skip
        if twins:
            yield (
                f"{twins[0].shown} moves as {y.shown} does: where two drives push one body, what"
                f" drives here is that of {y.axis} alone, and mass and friction come out as its"
                " share; add a column of the sum"
            )
    raw = [one.raw for one in columns.read if one.raw.header and isinstance(one.raw.key, int)]
    for name in (name for name, many in Counter(one.header for one in raw).items() if many > 1):
        places = [str(one.number) for one in raw if one.header == name]
        yield f"columns {' and '.join(places)} (from 0) are all named {name!r}: taken by number"
