"""Overlap of a valve, or of an amplifier: small commands do nothing."""

from identification.effects._base import Effect, Param, R, Rs, asymmetry


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """u -+ the width in the command's direction d, 0 within it."""
    width = p[0] * (1.0 + p[1] * d)
    left = max(abs(u) - width, 0.0)
    return left if u >= 0.0 else -left


EFFECT = Effect(
    key="valve_dead_zone",
    meaning="small commands do nothing, larger ones lack the width (valve overlap)",
    equation="sign(u)*Max(Abs(u) - u_d*(1 + asymmetry*d), 0)",
    source="Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities,"
    " Wiley 1996, dead zone",
    acts="command",
    params=(Param("u_d", "V", 0.0, 1e3, 0.1, "half width of the dead zone"), asymmetry()),
    value=value,
    depends_on=("u",),
)
