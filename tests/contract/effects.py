"""What every effect must hold to, as functions of one effect: for the library and for mutants."""

import ctypes
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pint
import sympy  # type: ignore[import-untyped]

from identification.arrays import Array
from identification.effects._base import AT_REST, MAX_PARAMS, MAX_SIGNALS, Acts, Effect
from workbench.units import si_unit

STATE = ("t", "y", "v", "F", "u", "d", "z", "c", "f")
UNITS = dict(t="s", y="m", v="m/s", F="N", u="V", d="1", c="N", f="N")
STATE_UNITS = ("N", "m", "s", "m/s")
GIVEN_UNIT: Mapping[Acts, str] = {
    "slip": "N", "stiction": "N", "friction": "N", "bristle": "N/m", "force": "N",
    "actuator": "N/s", "command": "V", "delay": "s", "sensor": "m",
}  # fmt: skip
DRAWS = 120
PARTS = ("value", "evolve", "initial")


@dataclass(frozen=True)
class Draw:
    """Arguments of a kernel: the nine of its state, signals, parameters, and a step."""

    x: dict[str, float]
    s: Array
    p: Array
    dt: float


def draw(effect: Effect, rng: np.random.Generator) -> Draw:
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


def compiled(effect: Effect, part: str, one: Draw) -> float:
    """The compiled kernel's answer."""
    pointer = effect.pointers[PARTS.index(part)].ctypes
    at = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (one.s, one.p)]
    return float(pointer(*([one.dt] if part == "evolve" else []), *one.x.values(), *at))


def plain(effect: Effect, part: str, one: Draw) -> float:
    """The same kernel run by Python."""
    kernel = {"value": effect.value, "evolve": effect.evolve, "initial": effect.initial}[part]
    assert kernel is not None
    step = [one.dt] if part == "evolve" else []
    return float(kernel(*step, *one.x.values(), tuple(one.s), tuple(one.p)))


def parsed(effect: Effect) -> sympy.Expr:
    """The written equation; its names are those of the state, the signals and the parameters."""
    names = (*STATE, *effect.signals, *effect.names)
    assert len(set(names)) == len(names), "a name with two meanings"
    symbols = {name: sympy.Symbol(name, real=True) for name in names}
    found = sympy.parse_expr(effect.equation, local_dict=symbols)
    assert found.free_symbols <= set(symbols.values()), f"unknown: {found.free_symbols}"
    return found


def written(effect: Effect) -> Callable[[Draw], float]:
    """The written equation as a function."""
    names = (*STATE, *effect.signals, *effect.names)
    function = sympy.lambdify([sympy.Symbol(n, real=True) for n in names], parsed(effect), "math")

    def of(one: Draw) -> float:
        signals, p = one.s[: len(effect.signals)], one.p[: len(effect.params)]
        return float(function(*one.x.values(), *signals, *p))

    return of


def check_equation(effect: Effect) -> None:
    """Compiled kernel == plain Python == written equation, at random arguments."""
    rng, equation = np.random.default_rng(7), written(effect)
    for _ in range(DRAWS):
        one = draw(effect, rng)
        expected = equation(one)
        size = 1e-12 * max(1.0, abs(expected), abs(one.x["y"]))
        assert abs(plain(effect, "value", one) - expected) <= size, one
        assert abs(compiled(effect, "value", one) - expected) <= size, one
        for part in PARTS[1:]:
            if getattr(effect, part) is not None:
                again = plain(effect, part, one)
                assert abs(compiled(effect, part, one) - again) <= 1e-12 * max(1.0, abs(again))


def check_linear(effect: Effect) -> None:
    """`value` is affine in the parameters that are declared linear, together."""
    rng = np.random.default_rng(8)
    where = [i for i, p in enumerate(effect.params) if p.linear]
    for _ in range(DRAWS if where else 0):
        one, other = draw(effect, rng), draw(effect, rng)
        first, second, middle, nought = one.p, one.p.copy(), one.p.copy(), one.p.copy()
        share = float(rng.uniform(-2.0, 3.0))
        second[where] = other.p[where]
        middle[where] = share * first[where] + (1.0 - share) * second[where]
        nought[where] = 0.0
        a, b, c, none = (
            plain(effect, "value", Draw(one.x, one.s, p, one.dt))
            for p in (first, second, middle, nought)
        )
        size = 1e-9 * (abs(a) + abs(b) + abs(none)) + 1e-300  # a number may lose its digits
        assert abs(share * a + (1.0 - share) * b - c) <= size
        if effect.acts != "sensor":  # its value is the position, with nothing added
            assert none == 0.0


def _moves(effect: Effect, part: str, change: Callable[[Draw, Draw], Draw]) -> bool:
    """Whether the effect's contribution changes with an argument."""
    rng = np.random.default_rng(9)
    base = {"sensor": "y", "command": "u"}.get(effect.acts) if part == "value" else None
    for _ in range(DRAWS):
        one = draw(effect, rng)
        two = change(one, draw(effect, rng))
        a, b = (plain(effect, part, k) - (k.x[base] if base else 0.0) for k in (one, two))
        if abs(a - b) > 1e-9 * max(abs(a), abs(b), 1e-9):
            return True
    return False


def moved_by_state(effect: Effect, name: str, part: str = "value") -> bool:
    """Whether an argument of the state moves the contribution."""
    return _moves(
        effect, part, lambda a, b: Draw({**a.x, name: b.x[name]}, a.s, a.p, a.dt)
    )  # fmt: skip


def _moved_in(effect: Effect, which: str, i: int, part: str) -> bool:
    def change(a: Draw, b: Draw) -> Draw:
        s, p = a.s.copy(), a.p.copy()
        (s if which == "s" else p)[i] = (b.s if which == "s" else b.p)[i]
        return Draw(a.x, s, p, a.dt)

    return _moves(effect, part, change)


def check_depends_on(effect: Effect) -> None:
    """Declared signals are those that move the contribution; no parameter is idle."""
    found = {name for name in ("t", "y", "v", "F", "u") if moved_by_state(effect, name)}
    by_friction = moved_by_state(effect, "f")  # or it but tells sliding from rest
    found |= {"v"} if by_friction and not set(AT_REST) & set(effect.names) else set()
    found |= {"u"} if effect.acts == "delay" else set()
    found |= {k for i, k in enumerate(effect.signals) if _moved_in(effect, "s", i, "value")}
    history = {"rest", "reversal"} & set(effect.depends_on)
    assert set(effect.depends_on) - history == found
    assert bool(history) == moved_by_state(effect, "z")
    parts = [part for part in PARTS if getattr(effect, part) is not None]
    for i, p in enumerate(effect.params):
        assert any(_moved_in(effect, "p", i, part) for part in parts), f"{p.name} does nothing"


def check_units(effect: Effect) -> None:
    """The written equation multiplies out to the unit of what the effect gives."""
    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    equation, errors = parsed(effect), []
    units = {**UNITS, **{name: si_unit(name, "linear") or "1" for name in effect.signals}}
    for p in effect.params:
        units[p.name] = p.unit.replace("**n", "**2")  # a unit with the exponent's own value
    for unit in STATE_UNITS if equation.has(sympy.Symbol("z", real=True)) else ("1",):
        names = (*STATE, *effect.signals, *effect.names)
        values = [registry.Quantity(2.0, {**units, "z": unit}[n]) for n in names]
        numbers = [2 if n == "n" else a for n, a in zip(names, values, strict=True)]
        function = sympy.lambdify(
            [sympy.Symbol(n, real=True) for n in names], equation, [_QUANTITIES, "math"]
        )
        try:
            registry.Quantity(function(*numbers)).to(GIVEN_UNIT[effect.acts])
        except (pint.DimensionalityError, TypeError) as error:
            errors.append(error)
        else:
            return
    raise AssertionError(f"{effect.key}: units do not multiply out: {errors}")


def _with_unit(choose: Callable[..., Any]) -> Callable[..., Any]:
    """max or min of quantities, in which a plain 0 is a 0 of the others' unit."""

    def of(*given: Any) -> Any:
        unit = next((a.units for a in given if isinstance(a, pint.Quantity)), None)
        same = [a if unit is None or isinstance(a, pint.Quantity) else a * unit for a in given]
        return choose(*same)

    return of


_QUANTITIES = {
    "exp": np.exp, "sin": np.sin, "cos": np.cos, "Abs": abs,
    "copysign": lambda a, b: float(np.copysign(a, b.magnitude)),
    "Max": _with_unit(max), "Min": _with_unit(min),
}  # fmt: skip
