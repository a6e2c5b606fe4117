"""Air or oil that leaks past the piston: the force decays."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """-leak F."""
    return -p[0] * F


EFFECT = Effect(
    key="leakage",
    meaning="the applied force decays by itself (leakage past the piston)",
    equation="-leak*F",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, leakage in the pressure dynamics",
    acts="actuator",
    params=(Param("leak", "1/s", 0.0, 1e2, 0.5, "rate of decay", linear=True),),
    value=value,
    depends_on=("F",),
)
