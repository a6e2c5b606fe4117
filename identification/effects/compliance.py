"""A transducer on the drive's side of an elastic coupling, which the applied force stretches."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """y + flexibility F, without the coupling's own dynamics."""
    return y + p[0] * F


EFFECT = Effect(
    key="compliance",
    meaning="elastic coupling between the position transducer and the load",
    equation="y + flexibility*F",
    source="Spong, ASME Journal of Dynamic Systems, Measurement, and Control 109 (1987) 310,"
    " elastic joint; its quasi-static limit",
    acts="sensor",
    params=(
        Param("flexibility", "m/N", -1e-2, 1e-2, 1e-5, "1 over the coupling's stiffness", True),
    ),
    value=value,
    depends_on=("F",),
)
