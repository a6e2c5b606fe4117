"""A force in proportion to position: a return spring, a cable, a bellows."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """-k y; a preload is a constant force, which the asymmetric levels absorb."""
    return -p[0] * y


EFFECT = Effect(
    key="spring",
    meaning="a force in proportion to position",
    equation="-k*y",
    source="Hooke's law",
    acts="force",
    params=(Param("k", "N/m", -1e7, 1e7, 50.0, "stiffness", linear=True),),
    value=value,
    depends_on=("y",),
)
