"""Elastic stops at both ends of the stroke."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """-k_p max(0, y - y_p) + k_n max(0, y_n - y)."""
    return p[1] * max(0.0, p[3] - y) - p[0] * max(0.0, y - p[2])


EFFECT = Effect(
    key="end_cushion",
    meaning="elastic stops or cushions at the ends of the stroke",
    equation="-k_p*Max(0, y - y_p) + k_n*Max(0, y_n - y)",
    source="Gilardi, Sharf, Mechanism and Machine Theory 37 (2002) 1213, linear elastic contact",
    acts="force",
    params=(
        Param("k_p", "N/m", 0.0, 1e7, 1e4, "stiffness at the positive end", True, 0.0),
        Param("k_n", "N/m", 0.0, 1e7, 1e4, "stiffness at the negative end", True, 0.0),
        Param("y_p", "m", -1e2, 1e2, 0.05, "where the positive cushion begins"),
        Param("y_n", "m", -1e2, 1e2, -0.05, "where the negative cushion begins"),
    ),
    value=value,
    depends_on=("y",),
)
