"""Counts of samples that mean the same time on any clock."""

USUAL_PERIOD = 2e-3  # s, the clock of which samples are counted here


def samples(count: int, h: float) -> int:
    """The samples of h [s] in so many of 2 ms; as many of a slower clock."""
    return max(count, round(count * USUAL_PERIOD / h))
