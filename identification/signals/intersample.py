"""A measured force between its samples: a breakaway's kink lies beyond the line through them."""

import numpy as np

from identification.arrays import Array

# A kink at tau in [0, 1] of a sample lies tau (1 - tau) of the change of slope beyond the line; a
# part of the second differences raises the line there by tau^2 + (1 - tau)^2 of it. Means over tau:
KINK_PER_DIFFERENCE = (1.0 / 6.0) / (2.0 / 3.0)
SHARP = 2.0  # deviations by noise, from which a second difference is a change of slope


def kinks(F: Array, noise: float) -> Array:
    """By how much a force F (n,) lies beyond the lines through its samples [N], (n,).

    noise [N]: of one sample, white; 0 where no change of slope stands out of it. The place of a
    kink between two samples is not known, so what is given is as unsure as it is large.
    """
    second = np.zeros(len(F))
    second[1:-1] = np.diff(F, 2)
    chance = 6.0 * (SHARP * noise) ** 2  # six variances in a second difference
    stands_out = second**2 > chance
    part = np.divide(chance, second**2, out=np.ones(len(F)), where=stands_out)
    return np.asarray(-KINK_PER_DIFFERENCE * second * (1.0 - part))
