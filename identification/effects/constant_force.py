"""A force that is always there: weight on a tilted axis, or the force sensor's offset.

In positive direction it acts as less friction and in negative as more, so from sliding and sticking
alone it is not distinguishable from unequal levels F_cp, F_cn and F_sp, F_sn: Trace counts it as
absorbed by these.
"""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """F_0."""
    return p[0]


EFFECT = Effect(
    key="constant_force",
    meaning="a constant force (tilt, offset); unequal F_cp, F_cn and F_sp, F_sn absorb it",
    equation="F_0",
    source="Janot, Gautier, Brunot, Data set and reference models of EMPS, Workshop on Nonlinear"
    " System Identification Benchmarks 2019: the offset of the inverse dynamic model",
    acts="force",
    params=(Param("F_0", "N", -1e6, 1e6, 1.0, "the force, towards +y", linear=True),),
    value=value,
    depends_on=(),
)
