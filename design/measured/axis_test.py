"""One log of an axis as a maintenance engineer reads it: its numbers, their limits, and a light.

A number is green within its limits, red where its whole 95 % interval lies beyond one, yellow
where the log cannot decide on which side it is. Limits are the card's, else what the machine's own
logs have shown.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from design.machine.readable import Display, number, shown_unit
from design.machine.source import MachineLogs, Source
from design.measured.axis_limits import MEANING_OF, Allowed, Light, light_of, limits_of
from identification.arrays import Array
from identification.estimation.axis_equation import AxisEquation, axis_equation
from identification.estimation.estimates import counted, reported_estimate
from identification.estimation.prescribed_motion import WHY_NOT
from identification.estimation.surroundings import surroundings
from identification.model.estimates import NORMAL_95, Estimate
from identification.model.surroundings import Surroundings
from identification.signals.check import check_driven
from identification.thresholds import HALF

LEAST_EXPLAINED = 0.8  # of the force, below which something acts that the numbers do not hold
ALONG_PLACES = 24  # along the travel
FEWEST_THERE = 3  # windows of sliding at a place
BESIDE_COULOMB = "less sure than Coulomb friction is large; add slow motion in both directions"
NO_BACKLASH = "the active model has no play; `workbench trace` finds one in this log"

WORST: tuple[Light, ...] = ("red", "yellow", "green", "")


@dataclass(frozen=True)
class Quantity:
    """One line of the test: its estimate, its limits, its light ("": no limits, or not
    identifiable)."""

    name: str
    meaning: str
    estimate: Estimate
    allowed: Allowed | None
    light: Light
    why: str


@dataclass(frozen=True)
class Earlier:
    """What the registry has of a machine: values of its last logs by quantity, oldest first, with
    the seconds since 1970 at which they were recorded; version: of the active model.

    estimates: of this log, by the fit of the active model, where that has effects which the
    equation of motion alone does not hold. said: why there are no limits, where there are none;
    remarks: on these, a line each.
    """

    machine: str
    values: Mapping[str, Sequence[tuple[float, float]]]
    version: int | None = None
    estimates: Mapping[str, Estimate] | None = None
    said: str = ""
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Travel:
    """Coulomb friction along the travel, both directions as sizes: place [m], mean [N] and sd of
    it at each, (p,); NaN where a direction hardly passes."""

    place: Array
    positive: Array
    negative: Array
    positive_sd: Array
    negative_sd: Array


@dataclass(frozen=True, eq=False)
class AxisTest:
    """The test of one log."""

    machine: str
    source: Source
    display: Display
    quantities: tuple[Quantity, ...]
    travel: Travel
    breakaways: tuple[int, int]
    earlier: Earlier | None
    remarks: tuple[str, ...]

    @property
    def light(self) -> Light:
        """The worst light; yellow where nothing has limits, or a Coulomb friction is not
        identified."""
        found = {one.light for one in self.quantities}
        worst = next(light for light in WORST if light in found)
        if worst == "red" or not (self.untested or self.blind):
            return worst
        return "yellow"

    @property
    def blind(self) -> bool:
        """Whether the log does not identify Coulomb friction of both directions."""
        return any(self.of(name).estimate.value is None for name in ("F_cp", "F_cn"))

    @property
    def untested(self) -> bool:
        """Whether no number of the machine has limits."""
        return all(one.allowed is None or one.allowed.source == "usual" for one in self.quantities)

    def of(self, name: str) -> Quantity:
        """The quantity of that name."""
        return next(one for one in self.quantities if one.name == name)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is not green, the worst first."""
        order = sorted(self.quantities, key=lambda one: WORST.index(one.light))
        out = [one.why for one in order if one.light in ("red", "yellow")]
        if self.blind:
            found = (self.of(name).estimate for name in ("F_cp", "F_cn"))
            why = next(one.reason or "" for one in found if one.value is None)
            out.append(f"Coulomb friction is not identifiable: {why.partition(';')[0]}")
        if self.untested:
            why = self.earlier.said if self.earlier else "give --registry, or the card [limits]"
            out.append(f"no limits to test against: {why}")
        return tuple(out)


def axis_test(
    logs: MachineLogs,
    limits: Mapping[str, tuple[float, float]],
    units: Mapping[str, str],
    earlier: Earlier | None = None,
    machine: str | None = None,
) -> AxisTest:
    """The test of the longest run of the log.

    limits: the card's, in SI, by quantity; units: of every quantity; earlier: what the registry has
    of the machine. Raises NotIdentifiable where too little slides.
    """
    source = max(logs.runs, key=lambda one: one.log.duration)
    check_driven([source.log])
    around = surroundings([source.log], logs.rig)
    found = axis_equation(around.taken_out(source.log), logs.rig)
    estimates = estimates_of(found, around, units)
    if earlier is not None and earlier.estimates is not None:
        estimates |= earlier.estimates
    travel = friction_along(found)
    # The largest deviation of either direction from its own mean [N].
    apart = [
        float(np.nanmax(np.abs(one - np.nanmean(one))))
        for one in (travel.positive, travel.negative)
        if np.count_nonzero(np.isfinite(one)) > 1
    ]
    estimates["along_travel"] = Estimate(max(apart, default=None), units["along_travel"])
    own = {name: Allowed(*ends, "card") for name, ends in limits.items()}
    earlier_values = earlier.values if earlier else {}
    past = {name: [value for _, value in every] for name, every in earlier_values.items()}
    usual = {"explained": Allowed(LEAST_EXPLAINED, 1.0, "usual")}
    allowed = {**usual, **limits_of(past), **own}
    runs = len(logs.runs)
    longest = (f"the log has {runs} runs; this is the longest",) if runs > 1 else ()
    return AxisTest(
        machine or logs.card, source, Display.of(logs.rig),
        tuple(judged(name, estimates[name], allowed.get(name)) for name in MEANING_OF),
        travel, found.breakaways, earlier,
        (*(earlier.remarks if earlier else ()), *longest, *logs.remarks),
    )  # fmt: skip


def estimates_of(
    found: AxisEquation, around: Surroundings, units: Mapping[str, str]
) -> dict[str, Estimate]:
    """Every quantity of the test, by name, as far as the equation of motion identifies it."""
    out = {}
    coulomb = [found.values.get(name, 0.0) for name in ("F_cp", "F_cn")]
    unheld = (
        f"mass and friction leave {100 * found.relative:.0f} % of the force, so no estimate is"
        " valid; `workbench trace` searches for the cause"
    )
    for name in ("F_cp", "F_cn", "F_vp", "F_vn", "F_sp", "F_sn", "m"):
        if name not in found.values:
            out[name] = Estimate(None, units[name], reason=_why_not(name, found))
        elif found.relative > HALF:
            out[name] = Estimate(None, units[name], reason=unheld)
        else:
            out[name] = reported_estimate(
                found.values[name],
                units[name],
                found.sd[name],
                bounds=(_least(name, found), np.inf),
            )
    value, sd = found.offset if not around.force.value else (around.force.value, around.force.sd)
    half = float(norm.ppf(0.975)) * sd
    constant = Estimate(value, units["constant_force"], sd, value - half, value + half)
    if found.relative > HALF:
        constant = Estimate(None, units["constant_force"], reason=unheld)
    elif not half < max(map(abs, coulomb)):
        constant = Estimate(None, units["constant_force"], reason=BESIDE_COULOMB)
    out["constant_force"] = constant
    out["backlash"] = Estimate(None, units["backlash"], reason=NO_BACKLASH)
    out["explained"] = Estimate(1.0 - found.relative, "1")
    return out


def _least(name: str, found: AxisEquation) -> float:
    """The least that a number can be: a breakaway force is no less than Coulomb friction, by the
    lower end of its 95 % interval."""
    level = {"F_sp": "F_cp", "F_sn": "F_cn"}.get(name)
    if level not in found.values:
        return 0.0
    return max(found.values[level] - NORMAL_95 * found.sd[level], 0.0)


def _why_not(name: str, found: AxisEquation) -> str:
    """Why a number is not identified."""
    if not name.startswith("F_s"):
        return WHY_NOT[name if name == "m" else name[:3]].format(share="next to nothing")
    if "m" not in found.values:
        return "without mass a start from rest is not placed; add faster reversals"
    many = found.breakaways[0 if name == "F_sp" else 1]
    return f"{counted(many, 'breakaway')}, too few; add starts from rest"


def friction_along(found: AxisEquation) -> Travel:
    """Coulomb friction of each direction at places along the travel."""
    edges = np.linspace(
        float(np.min(found.position)), float(np.max(found.position)), ALONG_PLACES + 1
    )
    at = np.clip(np.searchsorted(edges, found.position, side="right") - 1, 0, ALONG_PLACES - 1)
    columns = []
    for own in (found.up, ~found.up):
        count = np.bincount(at[own], minlength=ALONG_PLACES)
        enough = np.where(count >= FEWEST_THERE, count, np.nan)
        mean = np.bincount(at[own], found.level[own], ALONG_PLACES) / enough
        square = np.bincount(at[own], found.level[own] ** 2, ALONG_PLACES) / enough
        columns += [mean, np.sqrt(np.maximum(square - mean**2, 0.0) / enough)]
    up, up_sd, down, down_sd = columns
    return Travel(0.5 * (edges[1:] + edges[:-1]), up, down, up_sd, down_sd)


def judged(name: str, estimate: Estimate, allowed: Allowed | None) -> Quantity:
    """A quantity with its light and, where it is not green, the reason in a sentence."""
    meaning = MEANING_OF[name]
    if estimate.value is None and allowed is not None and allowed.source == "card":
        why = (estimate.reason or "not identifiable from this log").partition(";")[0]
        said = f"{_whole(meaning)} is not identifiable, and the card has limits for it: {why}"
        return Quantity(name, meaning, estimate, allowed, "yellow", said)
    if estimate.value is None or allowed is None:
        return Quantity(name, meaning, estimate, allowed, "", "")
    low = estimate.value if estimate.low is None else estimate.low
    high = estimate.value if estimate.high is None else estimate.high
    light = light_of(estimate.value, low, high, allowed)
    if light in ("green", "red"):
        said = _said(meaning, estimate, allowed, "") if light == "red" else ""
        return Quantity(name, meaning, estimate, allowed, light, said)
    outside = not allowed.low <= estimate.value <= allowed.high
    unsure = ", though not significantly by this log" if outside else " within its interval"
    if allowed.source == "usual":
        unsure = ": something else acts"
    said = _said(meaning, estimate, allowed, unsure)
    return Quantity(name, meaning, estimate, allowed, light, said)


def _said(meaning: str, estimate: Estimate, allowed: Allowed, unsure: str) -> str:
    """Why a light is not green."""
    (unit, factor), value = shown_unit(estimate.unit), estimate.value or 0.0
    above = value > 0.5 * (allowed.low + allowed.high)
    limit = allowed.high if above else allowed.low
    if estimate.unit == "1":
        unit, factor = "%", 100.0
    side = "above" if above else "below"
    last = f"its last {allowed.logs} sound logs'"
    whose = {"card": "the card's", "registry": last, "usual": "the usual"}
    moved = ""
    if allowed.mean and estimate.unit not in ("1", "") and "constant" not in meaning:
        moved = f" ({100 * (value / allowed.mean - 1):+.0f} % of their mean)"
    may = "perhaps " if unsure == " within its interval" else ""
    found, bound = (f"{number(factor * x, 4)} {unit}" for x in (value, limit))
    return (
        f"{_whole(meaning)} is {found}, {may}{side} {whose[allowed.source]} limit"
        f" {bound}{moved}{unsure}"
    )


def _whole(meaning: str) -> str:
    """A meaning as it stands in a sentence."""
    name, _, what = meaning.partition(": ")
    if what:
        return f"{name} ({what})"
    name, _, way = meaning.partition(", ")
    return f"{name} in {way} direction" if way else name
