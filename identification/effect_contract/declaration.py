"""What every effect must hold to, checked on its declaration and its kernels alone.

Each check raises `Broken` with what it found; `runs` has those that need a run. The equation is
read by a computer-algebra package, so it is no copy of the kernel: where the two differ, one of
them is wrong.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.effects._base import AT_REST, MAX_PARAMS, MAX_SIGNALS, Effect
from identification.errors import UserError

STATE_NAMES = ("t", "y", "v", "F", "u", "d", "z", "c", "f")
HISTORY = frozenset({"rest", "reversal"})  # names of what a state may keep of the motion before
POINTS_DRAWN = 120
PARTS = ("value", "evolve", "initial")
SAME = 1e-12  # relative difference of two ways to work out one number


class Broken(UserError):
    """An effect that does not hold to what it declares."""


@dataclass(frozen=True)
class Draw:
    """Arguments of a kernel: the nine of its state, signals, parameters, and a step."""

    x: dict[str, float]
    s: Array
    p: Array
    dt: float


def drawn_arguments(effect: Effect, rng: np.random.Generator) -> Draw:
    """Every argument at random, parameters within their bounds, around what is typical."""
    y = float(rng.normal(0.0, 0.1))
    near = y + float(rng.normal(0.0, 2e-4))
    x = dict(
        t=rng.uniform(0.0, 60.0), y=y, v=rng.normal(0.0, 0.2), F=rng.normal(0.0, 30.0),
        u=rng.normal(0.0, 0.2), d=rng.choice([-1.0, 1.0]),
        z=near if rng.random() < 0.5 else rng.normal(0.0, 10.0),
        c=rng.uniform(1.0, 30.0), f=rng.uniform(1.0, 60.0),
    )  # fmt: skip
    p = np.zeros(MAX_PARAMS)
    for i, one in enumerate(effect.params):
        value = one.typical * np.exp(rng.normal())
        if one.typical == 0.0:
            value = rng.uniform(max(one.low, -1.0), min(one.high, 1.0))
        elif one.low < 0.0 and rng.random() < 0.5:
            value = -value
        p[i] = np.clip(value, one.low, one.high)
    s = rng.uniform(1e5, 6e5, MAX_SIGNALS)
    return Draw({k: float(a) for k, a in x.items()}, s, p, float(rng.uniform(1e-5, 1e-2)))


def compiled_answer(effect: Effect, part: str, one: Draw) -> float:
    """The compiled kernel's answer."""
    pointer = effect.pointers[PARTS.index(part)].ctypes
    at = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (one.s, one.p)]
    return float(pointer(*([one.dt] if part == "evolve" else []), *one.x.values(), *at))


def python_answer(effect: Effect, part: str, one: Draw) -> float:
    """The same kernel run by Python."""
    kernel = {"value": effect.value, "evolve": effect.evolve, "initial": effect.initial}[part]
    assert kernel is not None
    step = [one.dt] if part == "evolve" else []
    return float(kernel(*step, *one.x.values(), tuple(one.s), tuple(one.p)))


def check_declaration(effect: Effect) -> None:
    """Meaning, source and every parameter say what they are; sizes may be 0."""
    for text, what in ((effect.meaning, "meaning"), (effect.source, "source")):
        if not text.strip():
            raise Broken(f"its {what} is empty; say it in a few words")
    for p in effect.params:
        if not p.meaning.strip():
            raise Broken(f"{p.name} has no meaning; say it in a few words")
        if p.linear and not p.low <= 0.0 <= p.high:
            raise Broken(
                f"{p.name} is linear with bounds {p.low:g} to {p.high:g}, which must hold 0, so"
                " that a regression can leave it out"
            )


def check_equation(effect: Effect) -> None:
    """Compiled kernel, plain Python and written equation give the same at random arguments."""
    rng, equation = np.random.default_rng(7), _written(effect)
    for _ in range(POINTS_DRAWN):
        one = drawn_arguments(effect, rng)
        expected = equation(one)
        size = SAME * max(1.0, abs(expected), abs(one.x["y"]))
        for how, found in (
            ("run by Python", python_answer(effect, "value", one)),
            ("compiled", compiled_answer(effect, "value", one)),
        ):
            if not abs(found - expected) <= size:
                raise Broken(
                    f"the equation gives {expected:.6g}, value {how} {found:.6g} at"
                    f" {_shown(effect, one)}"
                )
        for part in PARTS[1:]:
            if getattr(effect, part) is not None:
                by_hand = python_answer(effect, part, one)
                found = compiled_answer(effect, part, one)
                if not abs(found - by_hand) <= SAME * max(1.0, abs(by_hand)):
                    raise Broken(
                        f"{part} gives {by_hand:.6g} run by Python and {found:.6g} compiled at"
                        f" {_shown(effect, one)}"
                    )


def check_linear(effect: Effect) -> None:
    """`value` is affine in the parameters that are declared linear, together."""
    rng = np.random.default_rng(8)
    where = [i for i, p in enumerate(effect.params) if p.linear]
    for _ in range(POINTS_DRAWN if where else 0):
        one, other = drawn_arguments(effect, rng), drawn_arguments(effect, rng)
        first, second, middle, nought = one.p, one.p.copy(), one.p.copy(), one.p.copy()
        share = float(rng.uniform(-2.0, 3.0))
        second[where] = other.p[where]
        middle[where] = share * first[where] + (1.0 - share) * second[where]
        nought[where] = 0.0
        a, b, c, none = (
            python_answer(effect, "value", Draw(one.x, one.s, p, one.dt))
            for p in (first, second, middle, nought)
        )
        size = 1e-9 * (abs(a) + abs(b) + abs(none)) + 1e-300  # a number may lose its digits
        if not abs(share * a + (1.0 - share) * b - c) <= size:
            raise Broken(f"value is not linear in {', '.join(effect.linear)}, declared to be so")
        if not effect.place.shows and none != 0.0:  # its value is the position, nothing added
            raise Broken(f"with {', '.join(effect.linear)} at 0 it still gives {none:.3g}")


def check_depends_on(effect: Effect) -> None:
    """Declared signals are those that move the contribution or its state; no parameter is idle."""
    found = {name for name in ("t", "y", "v", "F", "u") if moved_by(effect, name)}
    by_friction = moved_by(effect, "f")  # or it only distinguishes sliding from rest
    found |= {"v"} if by_friction and not set(AT_REST) & set(effect.names) else set()
    found |= {"u"} if effect.place.delays else set()
    found |= {name for name in effect.signals if moved_by(effect, name)}
    remembers = moved_by(effect, "z")  # a bristle's state is the simulation's own
    by_state = remembers and effect.evolve is not None
    of_state = {
        name for name in ("t", "y", "v", "F", "u") if by_state and moved_by(effect, name, "evolve")
    }
    declared = set(effect.depends_on)
    missing = sorted(found - declared)
    if missing:
        raise Broken(f"it varies with {', '.join(missing)}, which depends_on does not name")
    idle = sorted(declared - found - of_state - HISTORY)
    if idle:
        raise Broken(f"depends_on names {', '.join(idle)}, with which nothing of it varies")
    if declared & HISTORY and not remembers:
        raise Broken("depends_on names rest or reversal, and no state of it keeps anything")
    if remembers and not declared & (HISTORY | of_state):
        raise Broken("it has a state, and depends_on names nothing that changes the state")
    parts = [part for part in PARTS if getattr(effect, part) is not None]
    for name in effect.names:
        if not any(moved_by(effect, name, part) for part in parts):
            raise Broken(f"{name} does nothing")


def moved_by(effect: Effect, name: str, part: str = "value") -> bool:
    """Whether an argument of the state, a signal or a parameter moves the contribution, or another
    kernel's answer."""
    rng = np.random.default_rng(9)
    place = effect.place
    own = "y" if place.shows else "u" if place.on_command and not place.delays else None
    base = own if part == "value" else None
    for _ in range(POINTS_DRAWN):
        one, other = drawn_arguments(effect, rng), drawn_arguments(effect, rng)
        two = Draw(dict(one.x), one.s.copy(), one.p.copy(), one.dt)
        if name in STATE_NAMES:
            two.x[name] = other.x[name]
        elif name in effect.signals:
            two.s[effect.signals.index(name)] = other.s[effect.signals.index(name)]
        else:
            two.p[effect.names.index(name)] = other.p[effect.names.index(name)]
        a, b = (python_answer(effect, part, k) - (k.x[base] if base else 0.0) for k in (one, two))
        if abs(a - b) > 1e-9 * max(abs(a), abs(b), 1e-9):
            return True
    return False


def parsed(effect: Effect) -> Any:
    """The written equation; its names are those of the state, the signals and the parameters."""
    import sympy  # type: ignore[import-untyped]

    names = (*STATE_NAMES, *effect.signals, *effect.names)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise Broken(f"{twice[0]} has two meanings: a kernel's argument, signal or parameter")
    symbols = {name: sympy.Symbol(name, real=True) for name in names}
    try:
        found = sympy.parse_expr(effect.equation, local_dict=symbols)
    except Exception as error:  # the package raises what it meets, of any kind
        said = " ".join(str(error).split())[:80] or type(error).__name__
        raise Broken(f"its equation {effect.equation!r} cannot be read ({said})") from None
    unknown = sorted(str(one) for one in found.free_symbols - set(symbols.values()))
    if unknown:
        raise Broken(f"its equation names {', '.join(unknown)}, no argument, signal or parameter")
    return found


def _written(effect: Effect) -> Callable[[Draw], float]:
    """The written equation as a function."""
    import sympy

    names = (*STATE_NAMES, *effect.signals, *effect.names)
    function = sympy.lambdify([sympy.Symbol(n, real=True) for n in names], parsed(effect), "math")

    def of(one: Draw) -> float:
        signals, p = one.s[: len(effect.signals)], one.p[: len(effect.params)]
        return float(function(*one.x.values(), *signals, *p))

    return of


def _shown(effect: Effect, one: Draw) -> str:
    """The arguments at which two ways differ, in short."""
    values = {**one.x, **dict(zip(effect.names, one.p.tolist(), strict=False))}
    return ", ".join(f"{name} = {value:.4g}" for name, value in values.items())
