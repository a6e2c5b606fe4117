"""Friction in proportion to the force that a gear, a screw or a guide transmits."""

from identification.effects._base import Effect, Param, R, Rs, asymmetry


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """mu |F|."""
    return p[0] * (1.0 + p[1] * d) * abs(F)


EFFECT = Effect(
    key="load_dependent_friction",
    meaning="friction in proportion to the applied force, whichever its sign",
    equation="mu*(1 + asymmetry*d)*Abs(F)",
    source="Hamon, Gautier, Garrec, IEEE/RSJ IROS 2010, 6187: dry friction depending on load",
    acts="friction",
    params=(
        Param("mu", "1", 0.0, 0.95, 0.1, "friction per applied force; 1 locks itself", True),
        asymmetry(),
    ),
    value=value,
    depends_on=("F",),
)
