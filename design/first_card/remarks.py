"""What a first card cannot hold: gaps, delays, axes, doubled names, a clock that a velocity denies;
logs of which no card is proposed, each with its reason; and the columns of one axis."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations

import numpy as np

from design.identified.hardly_identifiable import said_without_sign
from identification.columns.column import Column
from identification.columns.comparable import NEARLY_ALIKE
from identification.columns.header import is_position, words_of
from identification.columns.log_columns import PHASE_CURRENT, Columns
from identification.columns.motion_guess import UnitGuess
from identification.columns.pairs import follows
from identification.columns.roles import MOSTLY_ITS_LAW, Roles, are_constant
from identification.columns.unit_guess import contradicted_clock
from identification.columns.weights import SURE, said, together
from identification.errors import BadLog
from identification.signals.delays import are_exchanged
from identification.signals.even_clock import rows_lost
from identification.signals.relations import FEWEST_MOVING, force_law, lead, moving
from identification.thresholds import OF_ACCOUNT, TWICE

CONTROLLERS = {"controller", "pid", "pi", "pd", "regler", "regulator"}  # in a header
DRIVING = ("F", "u", "p_p", "p_n")
DIRECTIONS = 2  # that a flag tells
BALANCED = 2.0  # times the Coulomb level, that a force has to be off zero for a pressure's area


def remarks_on(columns: Columns, roles: Roles, units: Mapping[str, UnitGuess]) -> Iterator[str]:
    """The remarks of a card, each a line."""
    clock = units["t"]
    gain = clock.gain
    second = columns.notation.factor(clock.unit) if gain is None else 1.0 / float(gain.split()[0])
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
        middle, coulomb = abs(roles.law.balance), abs(roles.law.coulomb)
        never = np.min(roles.columns["u"].x) > OF_ACCOUNT * middle  # near 0, be it at rest
        if both and never and middle > BALANCED * coulomb:
            unsigned = (
                f"{roles.columns['u'].shown} goes up and down about {middle:.4g}, as what a"
                f" converter makes of a signal with a sign: write offset = {middle:.4g} in its line"
            )
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
    """Samples by which the position follows its reference; None where it follows none."""
    if "r" not in roles.columns:
        return None
    found = lead(roles.columns["r"].x, roles.columns["y"].x)
    return found.samples if follows(found) else None


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


FOLLOWED = 0.95  # likeness of a position and its reference in a log without a drive
NO_DRIVE = 0.0  # log-odds of a force by its header, of what may be a reference at most
BESIDE_ZERO = 0.05  # of its range, that a signal of both ways goes below zero and above at least
SAID_SO = 2.0  # log-odds of a command by its header, from which it is no force rather


def no_body(columns: Columns) -> BadLog:
    """The one line for a log of which no column moves as a body that is driven."""
    phases = [o.shown for o in columns.read if columns.left_out.get(o.raw.number) == PHASE_CURRENT]
    if phases:
        return BadLog(
            f"{columns.log.where}: columns {', '.join(phases)} are the three phase currents of a"
            " motor (their sum is 0), of which none is its force, and no other drive is logged; log"
            " the current that makes the torque too (the drive's q current), or add a column of it"
            " by Park's transform with the electrical angle"
        )
    pair = _followed(columns.signals)
    if pair is not None and (reason := _hardly_moves(pair, columns.signals)):
        return BadLog(f"{columns.log.where}: {reason}")
    if pair is not None:
        return BadLog(
            f"{columns.log.where}: column {pair[0].shown} follows its reference {pair[1].shown},"
            " and no force and no command of the motor is logged; log its current, torque or force"
            " too: reference and position alone identify no friction"
        )
    unsigned = f"; {reason}" if (reason := without_sign(columns.signals)) else ""
    clock = columns.clock
    if "time" not in clock.header.means:
        unsigned += f"; {clock.shown} is taken for the clock as it goes up: is it one?"
    there = ", ".join(one.shown for one in columns.signals) or "none"
    left_out = "; ".join(
        f"left out: column {one.shown}: {why}"
        for one in columns.read if (why := columns.left_out.get(one.raw.number))
    )  # fmt: skip
    return BadLog(
        f"{columns.log.where}: no column moves as a body that another one drives (tried: {there}"
        f"{'; ' if left_out else ''}{left_out}){unsigned}; a position is"
        " needed that goes both ways, and"
        " beside it a force, two pressures or a motor's command; or write the card by hand"
        " (manual: The card, key by key)"
    )


def without_sign(signals: Sequence[Column]) -> str:
    """What is said of a command without a sign beside a column that goes back and forth."""
    for one, y in permutations(signals, 2):
        other = bool(one.axis and y.axis) and one.axis != y.axis
        if said(one, "u") >= SAID_SO and np.min(one.x) >= 0.0 and not other and _both_ways(y):
            return said_without_sign(one.shown, y.shown)
    return ""


def _both_ways(one: Column) -> bool:
    """Whether a column goes both ways: a position there and back, all else below zero and above."""
    if one.way_gone <= TWICE:
        return False
    least = BESIDE_ZERO * float(np.ptp(one.x))
    return said(one, "y") >= SAID_SO or bool(np.min(one.x) < -least and np.max(one.x) > least)


def _followed(signals: Sequence[Column]) -> tuple[Column, Column] | None:
    """A position and the reference that it follows; None where there are no such two."""
    for y, r in permutations(signals, 2):
        other = max(said(r, "F"), said(r, "p")) <= NO_DRIVE and r.header.purpose != "model"
        other &= not r.header.speed
        if said(y, "y") >= SAID_SO and other and lead(r.x, y.x).likeness > FOLLOWED:
            return y, r
    return None


def _hardly_moves(pair: Sequence[Column], signals: Sequence[Column]) -> str:
    """Why a drive that is logged is not known beside a position and its reference: too few rows in
    which the body moves; empty where no header speaks of a drive, or enough moves."""
    y = pair[0]
    drives = [one for one in signals if max(said(one, "F"), said(one, "u")) >= SAID_SO]
    drives = sorted((one for one in drives if one not in pair), key=lambda one: -together(y, one))
    rows = 0 if y.motion is None else int(np.sum(moving(y.motion)))
    if not drives or rows >= FEWEST_MOVING:
        return ""
    return (
        f"column {y.shown} moves in {rows} of its {len(y.x)} rows, too few to see whether"
        f" {drives[0].shown} drives it (at least {FEWEST_MOVING} needed); log more strokes, or more"
        " rows of each"
    )


def of_axis(columns: Columns, axis: str | None) -> tuple[Sequence[Column], Column | None]:
    """The columns that belong to an axis, and the one that is to be its position, if any."""
    if axis is None:
        return columns.signals, None
    name = axis.strip().casefold()
    called = " ".join(words_of(name))
    said = ((one.axis, f" {' '.join(words_of(one.raw.header))} ") for one in columns.signals)
    places = [axis for axis, text in said if axis and called and f" {called} " in text]
    own = {name} & set(columns.axes) or set(places)
    if len(own) == 1:
        (name,) = own
        return [one for one in columns.signals if one.axis in ("", name)], None
    named = [one for one in columns.signals if one.raw.header.strip().casefold() == name]
    if len(named) == 1:
        return columns.signals, named[0]
    there = ", ".join(columns.axes) or "its headers name one alone"
    raise BadLog(
        f"{columns.log.where}: no axis {axis!r} (axes: {there}); give one of them, or the header of"
        " a position"
    )


def refuse_undriven(columns: Columns, roles: Roles, share: float) -> None:
    """Raises BadLog where a command is always 0 and the current is what the motor makes that the
    body turns: the velocity alone (share), against it."""
    if not roles.columns["u"].current or roles.signs["u"] > 0.0:
        return
    for one in columns.read:
        if columns.left_out.get(one.raw.number) == "is always 0" and said(one, "u") >= SAID_SO:
            raise BadLog(
                f"{columns.log.where}: nothing drives: the command {one.shown} is always 0, and"
                f" {roles.columns['u'].shown} is the velocity alone ({share:.0%}), against it, as"
                " of a motor that the body turns, whose braking is no friction; log a run with a"
                " command"
            )


def refuse_unsigned(columns: Columns, roles: Roles) -> None:
    """Raises BadLog where a command has its size alone, and a flag beside it its direction: with
    that it drives the body far more."""
    u, motion = roles.columns.get("u"), roles.columns["y"].motion
    if u is None or motion is None or u.x.min() < 0.0:
        return
    for flag in (one for one in columns.signals if one.flag and len(one.levels) == DIRECTIONS):
        signed = u.x * np.sign(flag.x - flag.levels.mean())
        law = force_law(motion, roles.columns["y"].x, signed)
        if law is not None and law.share > max(MOSTLY_ITS_LAW, TWICE * roles.law.share):
            raise BadLog(
                f"{columns.log.where}: column {u.shown} has no sign, {flag.shown} gives its"
                " direction; add a column of the one with the sign of the other, and give that log"
            )


def refuse_sign_bits(columns: Columns, roles: Roles) -> None:
    """Raises BadLog where a signal's sign is a bit of its own, which no card can undo."""
    for one in roles.columns.values():
        found = one.register
        if found is None or found.sign_bit is None:
            continue
        top = 2**found.sign_bit
        raise BadLog(
            f"{columns.log.where}: column {one.shown} jumps by {top} (data row {found.row}) where"
            f" it passes 0: sign and magnitude, bit {found.sign_bit} is the sign ({top} + n means"
            f" -n); write x where x < {top}, else {top} - x, and give that log"
        )


def refuse_error(columns: Columns, roles: Roles) -> None:
    """Raises BadLog where what may be the position is made of a following error, as the terms of a
    controller are: the error, its sum and its change."""
    y = roles.columns["y"]
    for one in columns.read if said(y, "y") < SAID_SO else ():
        e, x = one.values, y.values
        if {one.header.purpose, y.header.purpose} == {"error", "reference"}:
            raise BadLog(
                f"{columns.log.where}: no position but its reference {y.shown} and the error"
                f" {one.shown}; add a column of the one less the other (the position), and give it"
            )
        if one.header.purpose != "error" or len(e) != len(x) or not np.all(np.isfinite(e * x)):
            continue
        of_error = np.column_stack([e, np.cumsum(e), np.gradient(e), np.ones(len(e))])
        left = x - of_error @ np.linalg.lstsq(of_error, x)[0]
        reached = abs(float(np.corrcoef(e, x)[0, 1])) > NEARLY_ALIKE  # of a reference at rest
        if np.var(left) < OF_ACCOUNT**2 * np.var(x) and not reached:
            raise BadLog(
                f"{columns.log.where}: no position: {y.shown} is made of the error {one.shown}, as"
                " the terms of a controller are, and error and output alone identify no friction;"
                " log the position too"
            )


def refuse_resting(columns: Columns, roles: Roles) -> None:
    """Raises BadLog where a position by its header stands still, and another column is none."""
    y = roles.columns["y"]
    for one in columns.read:
        why = columns.left_out.get(one.raw.number, "")
        if why.startswith("is always") and said(one, "y") >= max(SURE, said(y, "y") + 1.0):
            raise BadLog(
                f"{columns.log.where}: column {one.shown}, the position by its header, {why};"
                " motion needed: check the sensor, or leave the column out"
            )
