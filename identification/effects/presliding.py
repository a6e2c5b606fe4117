"""Elastic micro-motion in place of sticking: the contact's bristles bend before they slide.

The level c falls from the stick limit at rest to the Coulomb level at speed as in the LuGre model,
with the Karnopp band as its Stribeck velocity. The stiffness has no asymmetry: were it to differ
between loading and unloading, a closed cycle could give energy; the level differs instead. The
stepper adds LuGre's micro-damping (`bristle_step.MICRO_DAMPING`), which no log could identify.
"""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """sigma_0 (1 - d z/c), z the elastic friction."""
    return p[0] * (1.0 - d * z / c)


def initial(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """At rest the elastic friction that holds the applied force, in motion the whole level."""
    return d * c if v != 0.0 else min(max(F, -c), c)


EFFECT = Effect(
    key="presliding",
    meaning="elastic micro-motion before breakaway in place of sticking (Dahl, LuGre)",
    equation="sigma_0*(1 - d*z/c)",
    source="Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1 (1968);"
    " Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Transactions on Automatic Control 40 (1995)"
    " 419",
    acts="bristle",
    params=(Param("sigma_0", "N/m", 1e2, 1e8, 1e5, "stiffness of the contact at rest"),),
    value=value,
    depends_on=("reversal",),
    initial=initial,
)
