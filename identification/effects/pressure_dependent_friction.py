"""Friction of lip seals, which chamber pressure presses against rod and bore."""

from identification.effects._base import Effect, Param, R, Rs, asymmetry, at_rest


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """mu_p p_p + mu_n p_n, a share of it at rest."""
    share = 1.0 if f > c else p[3] if d > 0.0 else p[4]
    return (p[0] * s[0] + p[1] * s[1]) * (1.0 + p[2] * d) * share


EFFECT = Effect(
    key="pressure_dependent_friction",
    meaning="friction that grows with the pressure in the chambers",
    equation="(mu_p*p_p + mu_n*p_n)*(1 + asymmetry*d)"
    "*Piecewise((1, f > c), (at_rest_p, d > 0), (at_rest_n, True))",
    source="Belforte, D'Alfio, Raparelli, Journal of Fluid Control 20 (1989) 42",
    acts="friction",
    params=(
        Param("mu_p", "N/Pa", 0.0, 0.1, 2e-5, "of the chamber that drives towards +y", True, 0.0),
        Param("mu_n", "N/Pa", 0.0, 0.1, 2e-5, "of the other chamber", True, 0.0),
        asymmetry(),
        *at_rest(),
    ),
    value=value,
    depends_on=("p_p", "p_n"),
    signals=("p_p", "p_n"),
)
