"""Whether a measured force is constant between its samples: by the likelihood of the position.

A line through the samples of a zero-order hold is half a sample ahead of it (Åström, Wittenmark,
Computer-Controlled Systems (1997), 8.2), which passes for viscous friction.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.estimation.sliding_likelihood import sliding_likelihoods
from identification.log import Log
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.thresholds import BEYOND_CHANCE

UNTIL_ITS_ROW = -1.0  # samples, by which the motion follows a force that is constant until its row


def whole_samples_late(logs: Sequence[Log], lag: float, *, rotary: bool) -> float | None:
    """By how many whole samples the motion follows a column of force [N] that is constant from each
    row to the next: 0 or -1 (until its row); None where the position measured while the body slides
    is not significantly likelier so than by a line through the samples.

    lag: in samples, at which such a line is tried too. Source: `sliding_likelihood`.
    """
    lines = tuple(dict.fromkeys([(0.0, False), (lag, False)]))
    tried = (*lines, (0.0, True), (UNTIL_ITS_ROW, True))
    variants = []
    for behind, held in tried:
        late = Surroundings(Size(behind * logs[0].h), held=held)
        variants.append([replace(late.of_one_instant(log), held=held) for log in logs])
    likely = sliding_likelihoods(variants, motor=False, rotary=rotary)
    if likely is None:
        return None
    gain = 2.0 * float(np.max(likely) - np.max(likely[: len(lines)]))
    if gain <= BEYOND_CHANCE**2:
        return None
    return tried[int(np.argmax(likely))][0]
