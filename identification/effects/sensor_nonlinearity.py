"""A position transducer whose scale bends over the stroke."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """y + a y^2 + b y^3."""
    return y + y * y * (p[0] + p[1] * y)


EFFECT = Effect(
    key="sensor_nonlinearity",
    meaning="the position transducer's scale is not straight",
    equation="y + a*y**2 + b*y**3",
    source="Fraden, Handbook of Modern Sensors, Springer 2016, nonlinearity error",
    acts="sensor",
    params=(
        Param("a", "1/m", -1e2, 1e2, 0.1, "bend of the scale", True, 0.0, "bend"),
        Param("b", "1/m**2", -1e4, 1e4, 1.0, "s-shape of the scale", True, 0.0, "bend"),
    ),
    value=value,
    depends_on=("y",),
)
