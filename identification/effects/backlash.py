"""Play between the load and the transducer: after a reversal the reading waits for the load."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """The position z shown before, dragged along where the load is at either end of the play."""
    return min(max(z, y - 0.5 * p[0]), y + 0.5 * p[0])


def evolve(dt: R, t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """As `value`: the reading stays where the load leaves it."""
    return min(max(z, y - 0.5 * p[0]), y + 0.5 * p[0])


def initial(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """The middle of the play."""
    return y


EFFECT = Effect(
    key="backlash",
    meaning="play between the load and the position transducer",
    equation="Min(Max(z, y - width/2), y + width/2)",
    source="Nordin, Gutman, Automatica 38 (2002) 1633, the play operator",
    acts="sensor",
    params=(Param("width", "m", 0.0, 1.0, 2e-4, "total width of the play"),),
    value=value,
    depends_on=("y", "reversal"),
    evolve=evolve,
    initial=initial,
)
