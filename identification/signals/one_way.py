"""Motion that goes one way alone."""

from identification.thresholds import MATERIAL

ONE_WAY_WHY = (
    "motion in one direction, in which friction is not distinguishable from a constant force"
)


def is_one_way(share_up: float) -> bool:
    """Whether motion of which so much goes up goes one way alone, up or down."""
    return not MATERIAL < share_up < 1.0 - MATERIAL
