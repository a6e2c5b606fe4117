"""Plants with effects by plain Euler in fine steps, from the written equations; no kernel runs.

Levels of eq. (1) as in `tests.identification.oracle`; effects as in `identification.effects._base`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import sympy  # type: ignore[import-untyped]

from identification.arrays import Array
from identification.effects._base import Acting
from identification.model.karnopp import Karnopp

STATE = ("t", "y", "v", "F", "u", "d", "z", "c", "f")
Evolve = Callable[[float, dict[str, float], float], float]


@dataclass(frozen=True)
class Written:
    """An effect's equation with its parameters as numbers, and its state's law: dt, x, rest."""

    acts: str
    value: Callable[..., float]
    evolve: Evolve | None = None

    @classmethod
    def of(cls, acting: Acting, evolve: Evolve | None = None, wrong: str = "") -> "Written":
        """From the declaration; `wrong` is an equation in its place."""
        names = {n: sympy.Symbol(n, real=True) for n in (*STATE, *acting.effect.names)}
        text = wrong or acting.effect.equation
        found = sympy.parse_expr(text, local_dict=names).subs(
            {names[k]: a for k, a in acting.values.items()}
        )
        function = sympy.lambdify([names[n] for n in STATE], found, "math")
        return cls(acting.effect.acts, function, evolve)


def euler(
    nine: Karnopp, k1: float, k2: float, effect: Written, u: Array, h: float, sub: int
) -> tuple[list[float], list[float], list[float]]:
    """Position, velocity and force before every sample, from rest, `sub` steps a sample."""
    p: Mapping[str, float] = {name: getattr(nine, name) for name in nine.__dataclass_fields__}
    out: tuple[list[float], list[float], list[float]] = ([], [], [])
    y = v = F = z = t = 0.0
    dt, rest = h / sub, True
    slips, sticks = effect.acts in ("slip", "friction"), effect.acts in ("stiction", "friction")
    for command in u.tolist():
        for series, now in zip(out, (y, v, F), strict=True):
            series.append(now)
        for _ in range(sub):
            way = 1.0 if v > 0 or (v == 0 and F >= 0) else -1.0
            limit = {1.0: p["F_sp"], -1.0: -p["F_sn"]}
            coulomb = p["F_cp"] if way > 0 else p["F_cn"]
            whole = coulomb + (p["F_vp"] if way > 0 else p["F_vn"]) * abs(v)

            def value(d: float, c: float, f: float, speed: float) -> float:
                return effect.value(t, y, speed, F, command, d, z, c, f)  # noqa: B023

            driving = F + (value(way, coulomb, whole, v) if effect.acts == "force" else 0.0)
            rate = value(way, coulomb, whole, v) if effect.acts == "actuator" else 0.0
            in_band = p["dv_n"] < v < p["dv_p"]
            if in_band:
                high, low = (
                    max(limit[d] + (value(d, limit[d], limit[d], 0.0) if sticks else 0.0), 0.0)
                    for d in (1.0, -1.0)
                )
                rest = -low <= driving <= high
                v = 0.0 if rest else v
                friction = driving if rest else (high if driving > high else -low)
            else:
                rest = False
                friction = way * max(whole + (value(way, coulomb, whole, v) if slips else 0.0), 0.0)
            if effect.evolve:
                c = limit[way] if rest else coulomb
                x = {"d": 0.0 if rest else way, "F": F, "f": c if rest else whole, "v": v}
                z = effect.evolve(dt, x, z)
            v_next = v + dt * (driving - friction) / p["m"]
            F += dt * (k1 * command - k2 * v + rate)
            y += dt * v
            v, t = v_next, t + dt
    return out
