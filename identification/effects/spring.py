"""A force that position sets: a return spring, a cable, a bellows, one that stiffens on its way."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """-k y - k_3 y^3; a preload is a constant force, which the asymmetric levels absorb."""
    return -(p[0] + p[1] * y * y) * y


EFFECT = Effect(
    key="spring",
    meaning="a force in proportion to position, and to its cube",
    equation="-k*y - k_3*y**3",
    source="Hooke's law; the cube: Duffing, Erzwungene Schwingungen bei veraenderlicher"
    " Eigenfrequenz, Vieweg 1918",
    acts="force",
    params=(
        Param("k", "N/m", -1e7, 1e7, 50.0, "stiffness", linear=True),
        Param("k_3", "N/m**3", -1e12, 1e12, 1e4, "how it stiffens (or softens)", True, 0.0),
    ),
    value=value,
    depends_on=("y",),
)
