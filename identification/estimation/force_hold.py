"""Whether a measured force is constant between its samples: by the likelihood of the position.

A line through the samples of a zero-order hold is half a sample ahead of it (Åström, Wittenmark,
Computer-Controlled Systems (1997), 8.2), which passes for viscous friction.
"""

from collections.abc import Sequence
from dataclasses import replace

from identification.estimation.sliding_likelihood import sliding_likelihoods
from identification.log import Log
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.thresholds import BEYOND_CHANCE

# Samples, by which the motion follows the force, and whether that is a zero-order hold: constant
# from its row on, or until its row; a line through its samples that looks like either.
HOLDS = ((0.0, True), (-1.0, True))
HALF_A_SAMPLE_LATE = ((0.5, False), (-0.5, False))


def whole_samples_late(logs: Sequence[Log], lag: float, *, rotary: bool) -> float | None:
    """By how many whole samples the motion follows a column of force [N] that is constant from each
    row to the next: 0 or -1 (until its row); None where the position measured while the body slides
    is not significantly likelier so than by a line through the samples, or significantly less than
    by one that is half a sample late, as which a smooth zero-order-hold force looks.

    lag: in samples, at which a line is tried too. Source: `sliding_likelihood`.
    """
    lines = ((0.0, False), (lag, False))
    tried = dict.fromkeys((*lines, *HOLDS, *HALF_A_SAMPLE_LATE))
    variants = []
    for behind, zoh in tried:
        late = Surroundings(Size(behind * logs[0].h), zoh=zoh)
        variants.append([replace(late.of_one_instant(log), zoh=zoh) for log in logs])
    found = sliding_likelihoods(variants, rotary=rotary)
    if found is None:
        return None
    likely = dict(zip(tried, found.tolist(), strict=True))
    best = max(HOLDS, key=lambda one: likely[one])
    surely = 0.5 * BEYOND_CHANCE**2  # nats
    line = max(likely[one] for one in lines)
    half = max(likely[one] for one in HALF_A_SAMPLE_LATE)
    if likely[best] - line <= surely or half - likely[best] > surely:
        return None
    return best[0]
