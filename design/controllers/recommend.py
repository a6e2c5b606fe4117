"""Which of several controllers, by what their loops come to in simulation, and why, in one line."""

import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from design.asked import Limits
from design.closed_loop.driven_loop import driven_loop, present_loop
from design.closed_loop.loop_figures import COMPENSATED, PRESENT, LoopFigures, tried_loops
from design.closed_loop.loop_motion import SETTLING_BAND, LimitCycle
from design.controllers.clear_win import contest
from design.machine.design import DESIGNED_STRUCTURES, Design, Recommendation, Structure
from design.machine.model import Model
from design.machine.readable import Display
from identification.errors import BadModel

USUAL_SEED = 0  # of the noise, where none is asked for: that of `validate`
EQUAL = 0.05  # mean relative difference of the measures below which two loops are as good
LEAST_ERROR = 1e-3  # error relative to step or amplitude below which less is no better


def recommended(model: Model, found: Design) -> Recommendation:
    """The controller of a design to take, by its loop on the model, as `validate` tests it.

    Of those that keep every goal: one whose loop keeps the limits of `validate` and comes to rest,
    where there is one, and of these the one that is better in the mean of standstill error,
    settling time, peak force and error along the smooth reference; where they are as good, the one
    with the larger modulus margin. The compensator only where it is clearly better with it. The
    present controller is to be kept where it is as good, or where the one that is taken does not
    clearly win over it on the machines that the model's errors allow.
    """
    candidates = [
        name
        for name in DESIGNED_STRUCTURES
        if (one := found.controllers.get(name)) and not one.missed
    ]
    if not candidates:
        said = "; ".join(
            f"{n.upper()}: {', '.join(c.missed)}" for n, c in found.controllers.items()
        )
        return Recommendation("none", False, f"none meets every goal ({said})")
    figures = compared(model, found)
    alone = _best(candidates, figures)
    both = (alone, alone + COMPENSATED)
    beside = figures.get(both[1])
    usable = (
        beside is not None
        and beside.passed
        and beside.limit_cycle is None
        and beside.standstill <= figures[alone].standstill
    )
    better = usable and _cost(both[1], both, figures) < _cost(alone, both, figures) - EQUAL
    said = reasons(alone, better, figures, model.display)
    taken = both[1] if better else alone
    stays = _present_as_good(taken, figures)
    present_said = "; the present controller is as good, keep it" if stays else ""
    if not stays and (unclear := _no_clear_win(model, found, alone, better)):
        stays = True
        present_said = f"; {unclear}: no clear win over the present controller, keep it"
    decisive = _decisive(alone, found, figures)
    missed = "".join(f"; it misses a limit, {one}" for one in figures[taken].missed[:1])
    why = f"{said}{f': {decisive}' if decisive else ''}{missed}{present_said}"
    return Recommendation(alone, better, why, stays)


def _no_clear_win(model: Model, found: Design, name: Structure, compensated: bool) -> str:
    """Why a controller does not clearly win over the present one, "" where it does or there is
    none that can be simulated."""
    if model.controller is None:
        return ""
    beside = found.compensator.value if compensated else None
    try:
        now = present_loop(model, model.controller)
        loop = driven_loop(model, found, found.controllers[name], beside)
        against = contest(model, found.force, loop, now)
    except BadModel:  # `validate` says why
        return ""
    return "" if against.clear else against.words


def compared(model: Model, found: Design) -> dict[str, LoopFigures]:
    """Figures of every loop of a design on its model, and of the present one, with its noise."""
    rng = np.random.default_rng(USUAL_SEED)
    return {name: one for name, (one, _) in tried_loops(model, model, found, Limits(), rng).items()}


def reasons(
    name: str, compensator: bool, figures: Mapping[str, LoopFigures], units: Display
) -> str:
    """Why this controller, in one line with its numbers and those of the others."""
    taken = name + (COMPENSATED if compensator else "")
    every = (*DESIGNED_STRUCTURES, name + COMPENSATED, PRESENT)
    others = [other for other in every if other in figures and other != taken]
    one, most = figures[taken], ""
    if one.force_limit is not None:
        most = f" of {one.force_limit:.3g}"
    said = (
        f"{called(taken)}: static error {_rest(one, units)} of the step, settling"
        f" time {settling_words(one)}, tracking error {percent(one.smooth_relative)} on the smooth"
        f" reference, peak force {one.force_peak:.3g}{most} {units.force}, modulus margin"
        f" {_modulus(one):.2f}"
    )
    beside = [
        f"{called(other)}: {_rest(it, units)}, {settling_words(it)},"
        f" {percent(it.smooth_relative)}, {it.force_peak:.3g} {units.force}, {_modulus(it):.2f}"
        for other, it in ((other, figures[other]) for other in others)
    ]
    return f"{said} ({'; '.join(beside)})" if beside else said


OTHERS = re.compile(r" \(([^()]*)\)(?=[:;]|$)")  # what `reasons` says of the other controllers


def own_figures(why: str) -> str:
    """A reason of `reasons` without the controller's name and the figures of the others."""
    return OTHERS.sub("", why).partition(": ")[2] or why


def other_figures(why: str) -> str:
    """The figures of the other controllers in a reason, in the order of its own; "" of none."""
    found = OTHERS.search(why)
    return f"the same five numbers of the others: {found[1]}" if found else ""


def settling_words(one: LoopFigures) -> str:
    """The settling time in words; never, where a step is still off by the band in the end."""
    if not one.stable or one.standstill_relative > SETTLING_BAND:
        return "never"
    return f"{one.settling:.2g} s"


def _best(candidates: Sequence[Structure], figures: Mapping[str, LoopFigures]) -> Structure:
    """The best of the controllers alone."""
    passing = [n for n in candidates if figures[n].passed]
    calm = [n for n in passing if figures[n].limit_cycle is None]
    pool = calm or passing or list(candidates)
    costs = {n: _cost(n, pool, figures) for n in pool}
    first = min(pool, key=lambda n: costs[n])
    equal = [n for n in pool if costs[n] - costs[first] < EQUAL]
    return max(equal, key=lambda n: _modulus(figures[n]))


def _decisive(name: Structure, found: Design, figures: Mapping[str, LoopFigures]) -> str:
    """What decided against the other controller, or against the best of several; "" where no other
    was asked for."""
    others = [one for one in DESIGNED_STRUCTURES if one != name]
    there = [one for one in others if one in found.controllers]
    if not there:
        refused = [one.upper() for one in others if one in found.refused]
        return f"there is no {' and no '.join(refused)}" if refused else ""
    sound = [one for one in there if not found.controllers[one].missed]
    other = min(sound or there, key=lambda n: _cost(n, (name, n), figures))
    called, rival = other.upper(), found.controllers[other]
    if rival.missed:
        return f"the {called} misses a goal, {rival.missed[0]}"
    one, its = figures[name], figures[other]
    if one.passed and not its.passed:
        return f"the {called} misses a limit, {its.missed[0]}"
    if one.limit_cycle is None and its.limit_cycle is not None:
        return f"the {called} does not come to rest"
    ahead = _cost(other, (name, other), figures) - _cost(name, (name, other), figures)
    if ahead >= EQUAL:
        return f"the first four are {100 * (np.exp(ahead) - 1):.0f} % larger with the {called}"
    return f"the {called} is as good in the first four, and has the smaller margin"


def _present_as_good(taken: str, figures: Mapping[str, LoopFigures]) -> bool:
    """Whether the present controller is as good, or better: in the mean where it keeps the limits,
    else, as where a step takes it to the limit of its command, in each error and in settling, with
    the modulus margin that is asked of a loop."""
    now, one = figures.get(PRESENT), figures[taken]
    if now is None or not now.stable or now.limit_cycle is not None:
        return False
    if not now.passed:
        if _modulus(now) < Limits().modulus:
            return False
        ahead = np.log(_measures(now)[:3] / _measures(one)[:3])
        return bool(one.stable and np.all(ahead < EQUAL))
    pool = (taken, PRESENT)
    return _cost(PRESENT, pool, figures) - _cost(taken, pool, figures) < EQUAL


def _cost(name: str, pool: Iterable[str], figures: Mapping[str, LoopFigures]) -> float:
    """Mean of the logarithms of a loop's measures, each over the least of the pool."""
    least = np.min([_measures(figures[n]) for n in pool], axis=0)
    with np.errstate(invalid="ignore"):
        ratios = np.log(_measures(figures[name]) / least)
    return float(np.mean(ratios)) if np.all(np.isfinite(ratios)) else np.inf


def _measures(one: LoopFigures) -> np.ndarray:
    errors = (one.standstill_relative, one.smooth_relative)
    return np.array(
        [*(max(e, LEAST_ERROR) for e in errors), max(one.settling, 1e-6), one.force_peak]
    )


def _modulus(one: LoopFigures) -> float:
    return one.margins.modulus if one.margins else 0.0


def called(name: str) -> str:
    """A loop's name in a sentence."""
    if name == PRESENT:
        return "the present controller"
    alone, *beside = name.split(" + ")
    return " with the ".join((alone.upper(), *beside))


def _rest(one: LoopFigures, units: Display) -> str:
    """The error at standstill, and the limit cycle in which it is."""
    if not one.stable:
        return "runs away"
    if not one.limit_cycle:
        return percent(one.standstill_relative)
    return f"{percent(one.standstill_relative)} in a {cycle_words(one.limit_cycle, units)}"


def cycle_words(cycle: LimitCycle, units: Display) -> str:
    """A limit cycle with its size, peak to peak, and its period."""
    size, unit = in_thousandths(cycle.amplitude, units)
    return f"limit cycle of {size:.2g} {unit} every {cycle.period:.2g} s"


def in_thousandths(length: float, units: Display) -> tuple[float, str]:
    """A length [m, rad] in mm or mrad."""
    return 1e3 * length, f"m{units.position}"


def percent(share: float) -> str:
    """A share with two digits; a hundredth of a percent is the least that is printed."""
    return f"{100 * share:.2g} %" if share >= 1e-4 else "< 0.01 %"
