"""Which column is which signal: what the headers say, weighed with how the columns hang together.

Every position is tried with every way to drive it, the other columns with every other role; the
largest sum of log-odds (`weights`) decides.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from identification.arrays import Array
from identification.log import RigKind
from identification.signals.relations import (
    ForceLaw,
    actuator_share,
    derivative,
    force_law,
    lead,
)
from workbench.steps.first_card.columns import Column, Columns
from workbench.steps.first_card.weights import (
    ALL_VELOCITY,
    AREA_RATIOS,
    LEAST_SCORE,
    LOOKS_LIKE_A_FORCE,
    MIRRORED,
    SURELY_TURNED,
    ahead_of,
    driving,
    in_one_unit,
    moves_like_a_body,
    of_a_motor,
    said,
    turned,
)

Sign = float


@dataclass(frozen=True, eq=False)
class Roles:
    """Signals by canonical name, their signs, and how sure each is (log-odds over the next).

    law: what of the driving signal is inertia and friction along y; area_ratio: of the chambers;
    why: reasons by signal.
    """

    kind: RigKind
    columns: Mapping[str, Column]
    signs: Mapping[str, Sign]
    odds: Mapping[str, float]
    why: Mapping[str, str]
    law: ForceLaw
    area_ratio: float = 1.0


@dataclass(frozen=True, eq=False)
class _Drive:
    """A way in which the body may be driven: the columns by role, their law, log-odds."""

    kind: RigKind
    columns: Mapping[str, Column]
    law: ForceLaw
    score: float
    area_ratio: float = 1.0


@dataclass(frozen=True, eq=False)
class _Choice:
    y: Column
    drive: _Drive
    others: Mapping[str, Column]
    gains: Mapping[str, float]
    score: float = field(default=0.0)


def told_roles(columns: Columns) -> Roles | None:
    """The signals of a log; None where no column moves as a body that another one drives."""
    choices = list(_choices(columns.signals))
    if not choices:
        return None
    best = max(choices, key=lambda one: one.score)
    found = {"y": best.y, **best.drive.columns, **best.others}
    return Roles(
        kind=best.drive.kind,
        columns=found,
        signs=_signs(best),
        odds=_odds(best, choices, found),
        why=_reasons(best),
        law=best.drive.law,
        area_ratio=best.drive.area_ratio,
    )


def _choices(signals: Sequence[Column]) -> Iterator[_Choice]:
    """Every position with every drive, and the best roles of the columns that are left."""
    derived = _derivatives(signals)
    for y in signals:
        head = said(y, "y")
        if y.motion is None or head <= -4.0:
            continue
        own = head + moves_like_a_body(y) + derived.get(y.raw.number, 0.0)
        for drive in _drives(y, [one for one in signals if one is not y]):
            taken = {y.raw.number, *(one.raw.number for one in drive.columns.values())}
            rest = [one for one in signals if one.raw.number not in taken]
            others, gains = _rest(y, drive, rest)
            yield _Choice(
                y, drive, others, {"y": own, **gains}, own + drive.score + sum(gains.values())
            )


def _derivatives(signals: Sequence[Column]) -> dict[int, float]:
    """Log-odds against being the position, of what is the derivative of another column."""
    out = dict[int, float]()
    for one in signals:
        for other in signals:
            if one is other or one.motion is None:
                continue
            share = derivative(one.motion, other.x).share
            if share > ALL_VELOCITY and said(one, "y") > -4.0:
                out[other.raw.number] = min(out.get(other.raw.number, 0.0), -4.0)
    return out


def _drives(y: Column, others: Sequence[Column]) -> Iterator[_Drive]:
    """What may drive the body: a force, the difference of two pressures, or the command itself."""
    assert y.motion is not None
    for one in others:
        law = force_law(y.motion, y.x, one.x)
        if law is None:
            continue
        physics = driving(y, one.x, law)
        as_force, as_command = said(one, "F"), said(one, "u")
        if as_force > -3.0:
            yield _Drive("force", {"F": one}, law, 0.5 + as_force + physics)
        if as_command > -3.0:
            yield _Drive("motor", {"u": one}, law, as_command + physics + of_a_motor(one))
    chambers = [one for one in others if said(one, "p") > -3.0 and one.x.min() >= 0.0]
    for one, other in combinations(chambers, 2):
        drive = _chambers(y, one, other)
        if drive is not None:
            yield drive


def _chambers(y: Column, one: Column, other: Column) -> _Drive | None:
    """Two pressures of one size as a drive, with the ratio of areas that explains most."""
    assert y.motion is not None
    first_x, second_x = in_one_unit(one, other)
    if not 0.2 < first_x.mean() / second_x.mean() < 5.0:
        return None
    best: tuple[float, ForceLaw] | None = None
    for ratio in AREA_RATIOS:
        difference = first_x - ratio * second_x
        law = force_law(y.motion, y.x, difference)
        if law is not None and (best is None or law.share > best[1].share):
            best = (ratio, law)
    if best is None:
        return None
    ratio, law = best
    score = driving(y, np.sign(law.way) * (first_x - ratio * second_x), turned(law))
    alone = [force_law(y.motion, y.x, x) for x in (first_x, second_x)]
    score += MIRRORED if _mirrored(alone) else 0.0
    first, second = (one, other) if law.way > 0 else (other, one)
    likely = 0.5 * (said(one, "p") + said(other, "p"))
    return _Drive(
        "electro-pneumatic", {"p_p": first, "p_n": second}, law, likely + score - 1.0,
        ratio if law.way > 0 else 1.0 / ratio,
    )  # fmt: skip


def _mirrored(laws: Sequence[ForceLaw | None]) -> bool:
    """Whether each of two columns alone looks like the force, but with opposite signs.

    Of two chambers the one is filled as the other is emptied; a force beside a pressure is no such.
    """
    known = [law for law in laws if law is not None]
    alike = len(known) == 2 and min(law.share for law in known) > LOOKS_LIKE_A_FORCE
    return alike and known[0].way * known[1].way < 0.0


def _rest(
    y: Column, drive: _Drive, rest: Sequence[Column]
) -> tuple[dict[str, Column], dict[str, float]]:
    """The best roles of the columns that are neither the position nor drive the body."""
    roles = ["r", "v", "a", "temperature"]
    roles += ["u"] if "u" not in drive.columns else []
    roles += ["F"] if drive.kind == "electro-pneumatic" else []
    if not rest:
        return {}, {}
    gain = np.array([[max(_gain(y, drive, one, role), LEAST_SCORE) for role in roles]
                     for one in rest])  # fmt: skip
    rows, places = linear_sum_assignment(-gain)
    found = {
        roles[j]: (rest[i], float(gain[i, j]))
        for i, j in zip(rows.tolist(), places.tolist(), strict=True)
        if gain[i, j] > LEAST_SCORE
    }
    return {k: one for k, (one, _) in found.items()}, {k: score for k, (_, score) in found.items()}


def _gain(y: Column, drive: _Drive, one: Column, role: str) -> float:
    """Log-odds of a role of one more column, beside position and drive."""
    head = said(one, role)
    if role in ("r", "u", "v", "a") and head < -3.0:
        return head
    assert y.motion is not None
    if role == "r":
        return head + ahead_of(y, one)
    if role == "v":
        share = derivative(y.motion, one.x).share
        return head + (2.5 if share > ALL_VELOCITY else -0.5 if share > 0.8 else -3.0)
    if role == "a":
        return head - 1.0
    if role == "u":
        return head + _commands(y, drive, one)
    if role == "F":
        return head + 1.0
    return head - 1.0


def _commands(y: Column, drive: _Drive, one: Column) -> float:
    """Log-odds that a column is the command behind the force of the rig."""
    assert y.motion is not None
    F = _force_of(drive)
    share, _ = actuator_share(F, y.motion.v, one.x, y.motion.cutoff)
    back, _ = actuator_share(one.x, y.motion.v, F, y.motion.cutoff)
    one_way = 1.5 if one.x.min() * one.x.max() > 0.0 else 0.0
    return float(np.clip(8.0 * (share - back) - 1.0 - one_way, -2.0, 4.0))


def _force_of(drive: _Drive) -> Array:
    """The driving signal, its sign that of a force, (k,)."""
    if drive.kind == "electro-pneumatic":
        p_p, p_n = in_one_unit(drive.columns["p_p"], drive.columns["p_n"])
        ratio = drive.area_ratio
        return np.asarray(p_p - ratio * p_n if ratio >= 1.0 else p_p / (1.0 / ratio) - p_n)
    (one,) = drive.columns.values()
    return drive.law.way * one.x


def _signs(best: _Choice) -> dict[str, Sign]:
    """1 or -1 by signal: with which a force drives the body, and a command the force."""
    out = dict.fromkeys(best.others, 1.0) | dict.fromkeys(best.drive.columns, 1.0) | {"y": 1.0}
    if best.drive.kind != "electro-pneumatic":
        (name,) = best.drive.columns
        out[name] = best.drive.law.way
    assert best.y.motion is not None
    if "u" in best.others:
        motion = best.y.motion
        u = best.others["u"].x
        out["u"] = actuator_share(_force_of(best.drive), motion.v, u, motion.cutoff)[1]
    if "r" in best.others:
        found = lead(best.others["r"].x, best.y.x)
        out["r"] = -1.0 if found.likeness < -SURELY_TURNED else 1.0
    if "F" in best.others:
        law = force_law(best.y.motion, best.y.x, best.others["F"].x)
        out["F"] = 1.0 if law is None else law.way
    return out


def _odds(
    best: _Choice, choices: Sequence[_Choice], found: Mapping[str, Column]
) -> dict[str, float]:
    """How far the best choice is ahead of the best that gives each signal another column."""

    def of(choice: _Choice, role: str) -> Column | None:
        return {"y": choice.y, **choice.drive.columns, **choice.others}.get(role)

    out = {}
    for role, column in found.items():
        rivals = [one.score for one in choices if of(one, role) is not column]
        ahead = best.score - max(rivals, default=-np.inf)
        own = best.gains.get(role)
        out[role] = min(ahead, own) if own is not None and role != "y" else ahead
    return out


def _reasons(best: _Choice) -> dict[str, str]:
    """In words why each column has its role."""
    law = best.drive.law
    of = f"{law.share:.0%} of it is inertia and friction along the position"
    work = f", and friction takes {abs(law.work):.0%} of its work" if abs(law.work) > 0.1 else ""
    out = {name: of + work for name in best.drive.columns}
    if best.drive.kind == "electro-pneumatic":
        out = dict.fromkeys(
            out, f"of the difference of the two {of[: -len(' along the position')]}"
        )
    out["y"] = "moves as a body does, and " + (
        "two pressures drive it" if best.drive.kind == "electro-pneumatic" else "a force drives it"
    )
    if "r" in best.others:
        found = lead(best.others["r"].x, best.y.x)
        out["r"] = f"the position follows it ({found.likeness:.0%} alike)"
    if "u" in best.others:
        out["u"] = "the force's change follows it"
    if "v" in best.others:
        out["v"] = "is the derivative of the position"
    return out
