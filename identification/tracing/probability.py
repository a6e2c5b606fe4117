"""How probable it is that an effect that is named is the machine's.

A logistic curve (Cox, J. R. Stat. Soc. B 20 (1958) 215) over what a model with the effects leaves:

    log(p / (1 - p)) = b_0 + b_1 log10 r + b_2 (n - 1)                                           (1)

r: the latent force that is still missing on the held-out logs, over that which the plain model
lacks; n: effects named. A machine's own law leaves next to nothing of it. Laws that together take
the place of one that the library lacks leave hardly an error of the equation, but more of the
force, and they are several. The coefficients are those of largest likelihood on the machines of
`benchmarks/probability.py`; a third of them have an effect that the library lacks. Ours:
`README.md`, (12).
"""

import numpy as np

from identification.thresholds import HALF

COEFFICIENTS = (-1.5, -2.5, -1.5)  # b_0 to b_2
Evidence = tuple[float, ...]  # the terms of (1)
LEAST_MISSING = 1e-4  # of the missing force: below, noise decides


def evidence(force_left: float, named: int) -> Evidence:
    """The terms of (1) for so many effects that leave this share of the missing force."""
    left = float(np.log10(np.clip(force_left, LEAST_MISSING, 1.0)))
    return 1.0, left, named - 1.0


def probability(terms: Evidence, alike: int = 0) -> float:
    """Probability of an effect by its evidence, shared with so many others that explain as much."""
    odds = float(np.dot(COEFFICIENTS, terms))
    return float(1.0 / (1.0 + np.exp(-odds)) / (1 + alike))


def is_probable(chance: float) -> bool:
    """Whether an effect of this probability is rather the machine's than not."""
    return chance >= HALF
