"""A trace in words: its verdict, and what to do next."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from design.identified.trace_logs import Traced
from design.machine.model import used
from design.machine.readable import Display, number, shown_unit
from identification.estimation.latent_force import LatentForces
from identification.model.estimates import Estimate
from identification.thresholds import OF_ACCOUNT
from identification.tracing.probability import is_probable
from identification.tracing.result import Change, Dependence, Trace
from identification.tracing.trace import MOVE_IT
from identification.tracing.verdict import listed

FORCE_ERROR_LEFT = 0.8  # of the force error; an effect that leaves more shows in another error
MOST = 1000.0  # change shown [%]
CERTAIN = 0.99  # probability above which digits say nothing
FOLLOWS_NOT = 10.0  # times the position's noise, from which a free run follows no log
NO_DEPENDENCE = "shows no dependence on a signal"  # which is not that there is none
NOISE = 1.5  # times the sensors' noise, up to which nothing is left


class ReportedError(NamedTuple):
    """The error by which a trace is reported: its name, before, after, its noise, and how each is
    written."""

    name: str
    before: float
    after: float
    noise: float | None
    write: Callable[[float], str]


def two_masses_sentence(resonance: Mapping[str, Estimate]) -> str:
    """At which frequency two masses swing."""
    hertz = number(used(resonance["frequency"]), 4)
    return f"two masses with a spring between them swing at {hertz} Hz."


def words(key: str) -> str:
    """An effect's key as words."""
    return key.replace("_", " ")


def trace_sentence(traced: Traced) -> str:
    """The verdict in one or two plain sentences, how much of friction the model lacks, and whether
    it is a verdict for the time being."""
    found, said = traced.trace, _verdict_sentence(traced)
    if found.actuator_like is not None:
        like = " and ".join(map(words, found.actuator_like))
        said += (
            " That is by the measured force; between it and the command something is missing"
            + (f", which acts like {like}." if like else ": the actuator is not linear.")
        )
    force = found.missing_force
    if found.missing is not None and force and not traced.model.coulomb_unknown:
        was, now = map(share_of_friction, found.missing, (force.before, force.after))
        both = f"{was} of friction before, {now} after" if force.lessened else f"{now} of friction"
        said += f" Force missing: {both}."
    if found.not_tried:
        said += f" Ended early, so this is for now; not tried: {'; '.join(found.not_tried)}."
    return said


def share_of_friction(part: float, of: LatentForces) -> str:
    """A part of the Coulomb level as text [%]; a bound where the log does not show the force, and
    nothing where that is more than friction itself."""
    if of.is_a_bound and part >= 1.0:
        return "an unknown share"
    said = f"{100 * part:.2g} %" if part < 1.0 else f"{100 * part:.0f} %"
    return f"at most {said}" if of.is_a_bound else said


def _verdict_sentence(traced: Traced) -> str:
    found = traced.trace
    names = "; and ".join(_named(found))
    error, errors = reported_error(traced) if found.effects else None, ""
    if error is not None:
        noise = "" if error.noise is None else f" (sensors' noise {error.write(error.noise)})"
        fall = f"{error.write(error.before)} -> {error.write(error.after)}"
        errors = f" {error.name} {fall}{noise}."
    changed = ", ".join(_changed(one, found) for one in found.drift)
    if found.next_experiment.startswith(MOVE_IT):  # nothing was sought or tested
        return f"Unknown: {unexplained(traced)}"
    match found.verdict:
        case "unknown" if found.not_tried and not found.effects:
            return f"Open: {unexplained(traced, found.unknown.depends_on)}"
        case "none":
            return nothing_missing(found, traced.model.display)
        case "effect":
            also = f" The test logs also differ in {changed}." if changed else ""
            return f"Missing: {names}.{share_explained(traced)}{errors}{also}"
        case "drift":
            return (
                f"Drift: between training and test logs the machine changed in {changed};"
                " its structure holds."
            )
        case "inseparable":
            equal = [r for r in found.rivals if r.why_not.startswith("explains as much")]
            keys = dict.fromkeys(one.key for one in equal or found.rivals[:1])
            others = " or ".join(map(words, keys))
            rival = f" It is not distinguishable from {others}." if others else ""
            return f"Inseparable: these logs call for {names}.{rival}{errors}"
        case _ if found.effects:
            return _partly(traced, names, errors)
        case _ if traced.model.resonance is not None:
            return f"No effect of the library: {two_masses_sentence(traced.model.resonance)}"
        case _ if found.unknown.depends_on:
            left = _on_signals(found.unknown)
            return f"Unknown: what is left {left}, and no effect of the library explains it."
        case _:
            return f"Unknown: {unexplained(traced)}"


def _named(found: Trace) -> list[str]:
    """The effects, each with what it is and its probability; orders of a turn as the one cogging
    that they are."""
    orders = found.surroundings.orders
    of_a_turn = {one.key for one in found.surroundings.cogging} if len(orders) > 1 else set[str]()
    out, cogging = list[str](), False
    for e in found.effects:
        name, meaning = words(e.effect.key), e.effect.meaning
        if e.effect.key in of_a_turn:
            if cogging:
                continue
            cogging, name = True, "cogging"
            *most, last = (str(one.order) for one in orders)
            meaning = f"torques {', '.join(most)} and {last} times in a turn (magnets, teeth)"
        out.append(f"{name} – {meaning} (probability {chance(e.probability)})")
    return out


def chance(probability: float) -> str:
    """A probability as text [%]."""
    return "over 99 %" if probability > CERTAIN else f"{100 * probability:.0f} %"


def _partly(traced: Traced, names: str, errors: str) -> str:
    """What was found comes before what is still missing."""
    unknown = traced.trace.unknown
    if not any(is_probable(e.probability) for e in traced.trace.effects):
        return (
            f"Unknown: what is missing acts like {names}.{share_explained(traced)}{errors} It is"
            " rather an effect that the library lacks."
        )
    rest = _on_signals(unknown) if unknown.depends_on else NO_DEPENDENCE
    return (
        f"Found in part: {names}.{errors} What is left {rest}, and no effect of the library"
        " explains that."
    )


def _on_signals(unknown: Dependence) -> str:
    share = f"{100 * unknown.explained:.0f} %"
    return f"depends on {listed(unknown.depends_on)} (which accounts for {share} of it)"


def share_explained(traced: Traced) -> str:
    """How much of what was missing the effects explain, and on what the rest depends."""
    found = traced.trace
    if reported_error(traced) is None:  # no error in which they would show
        return ""
    share = 100 * found.left.share
    it, where = (
        "It explains" if len(found.effects) == 1 else "They explain",
        "on the held-out logs" if traced.test else "on the stretches left out",
    )
    if found.complete:
        return f" {it} all of what was missing {where}, down to the sensors' noise."
    rest = f"the rest {NO_DEPENDENCE}"
    if found.verdict == "effect" and found.drift:
        rest = "the machine has changed beside"
    elif found.left.depends_on:
        rest = f"the rest depends on {listed(found.left.depends_on)}"
    return f" {it} {100 - share:.3g} % of what was missing {where}; {rest}."


def unexplained(traced: Traced, signals: Sequence[str] = ()) -> str:
    """What is left where it is far more than noise; signals: on which it depends."""
    depends = f"depends on {listed(signals)}" if signals else NO_DEPENDENCE
    found, display = traced.trace, traced.model.display
    rest = f"and it {depends}"
    if found.next_experiment.startswith(MOVE_IT):
        few = found.next_experiment.removeprefix(MOVE_IT)
        rest = f"but the held-out logs slide too little to test on what it depends{few}"
    left, off = found.after["train"].force_rms, found.after["train"].position_rms
    if left is not None and left <= NOISE * found.noise_force and off is not None:
        return (
            f"the free run has an error of {display.length_text(off)} in 2 s (sensors' noise"
            f" {display.length_text(found.noise_y)}), {rest}."
        )
    said = "an unknown part" if left is None else display.force_text(left)
    return (
        f"the model leaves {said} of force, the sensors' noise alone"
        f" {display.force_text(found.noise_force)}, {rest}."
    )


def nothing_missing(found: Trace, display: Display) -> str:
    """The verdict "none" in words; what is left may be more than noise, without a structure."""
    left, noise = found.after["test"].force_rms, display.force_text(found.noise_force)
    if left is None:
        return "Open: no row was held out on which it would show whether something is missing."
    bound = found.missing[1] if found.missing is not None else 0.0
    if bound > OF_ACCOUNT:
        return (
            f"Open: a force of {100 * bound:.2g} % of friction would not show in these logs, of"
            f" which the model leaves {display.force_text(left)} and the sensors' noise {noise}."
        )
    if left <= NOISE * found.noise_force:
        where = "" if found.noise_actuator is not None else " in the equation of motion"
        off = found.after["test"].position_rms
        astray = (
            f" Its free run does not follow: in 2 s it is {display.length_text(off)} off (rms)."
            if off is not None and off > FOLLOWS_NOT * found.noise_y
            else ""
        )
        return (
            f"Nothing is missing{where}: the model leaves {display.force_text(left)} of force, the"
            f" sensors' noise alone {noise}.{astray}"
        )
    return (
        f"No effect is missing that these logs show: what is left ({display.force_text(left)},"
        f" sensors' noise {noise}) {NO_DEPENDENCE}."
    )


def reported_error(traced: Traced) -> ReportedError | None:
    """The force error, or where that hardly falls the one that falls most."""
    found, display = traced.trace, traced.model.display
    before, after = found.before["test"], found.after["test"]
    where = "Held-out" if traced.test else "On stretches left out,"
    every: tuple[tuple[str, str, float | None, Callable[[float], str]], ...] = (
        ("force_rms", "force error", found.noise_force, display.force_text),
        ("actuator_rms", "error of the actuator equation", found.noise_actuator,
         lambda x: f"{display.force_text(x)}/s"),
        ("position_rms", "position error in 2 s", found.noise_y, display.length_text),
    )  # fmt: skip
    known = {
        key: ReportedError(f"{where} {name}", was, now, noise, write)
        for key, name, noise, write in every
        for was, now in [(getattr(before, key), getattr(after, key))]
        if was is not None and now is not None and math.isfinite(was) and was > 0
    }
    of_force = known.get("force_rms")
    if of_force is not None and of_force.after <= FORCE_ERROR_LEFT * of_force.before:
        return of_force
    return min(known.values(), key=lambda error: error.after / error.before, default=None)


def percent(before: float, after: float) -> str:
    """Change in percent; empty where there is nothing to compare with."""
    if before == 0:
        return ""
    change = 100 * (after - before) / before
    if abs(change) > MOST:
        return f"over {MOST:+.0f} %" if change > 0 else f"below {-MOST:+.0f} %"
    if round(change, 4) == 0:
        return "0 %"
    return f"{change:+.0f} %" if abs(change) >= 10 else f"{change:+.2g} %"


def by_regression(change: Change, found: Trace) -> bool:
    """Whether a change is that of the regression on the equations of training and test logs, alike
    on both, whose training value is not the reported one of the fit."""
    reported = found.parameters_after.get(change.name)
    return reported is None or not math.isclose(used(reported), change.before)


def _changed(change: Change, found: Trace) -> str:
    """One change in words; of a regression, whose values are not those reported, its share."""
    by = percent(change.before, change.after)
    if by and by_regression(change, found):
        return f"{change.name} by {by}"
    unit, factor = shown_unit(change.unit)
    before, after = (number(factor * value, 4) for value in (change.before, change.after))
    return f"{change.name} from {before} to {after} {unit}{f' ({by})' if by else ''}"


def advice(traced: Traced) -> list[str]:
    """What to do next, beside a command."""
    found, out = traced.trace, []
    if found.not_tried:
        out.append("trace again with a larger `--budget`, to try what was left out")
    if found.next_experiment:
        out.append(f"record more, {found.next_experiment.rstrip('.')}; then trace with it too")
    left = found.after["test"].force_rms
    if found.verdict == "none" and (left is None or left > NOISE * found.noise_force):
        out.append("what is left is more than noise: check a controller on the machine with care")
    seen = traced.model.resonance is None and found.unknown.depends_on
    if found.verdict == "unknown" and seen:
        out.append(
            "if you know what it is, write it as an effect of your own: `workbench effects check"
            " FOLDER`, then `workbench trace ... --effects FOLDER`"
        )
    return out
