"""How probable it is that an effect that is named is the machine's.

A logistic curve (Cox, J. R. Stat. Soc. B 20 (1958) 215) over what a model with the effects leaves:

    log(p / (1 - p)) = b_0 + b_1 log10 r_d + b_2 log10 r_e + b_3 [several effects named]        (1)

r_d: the latent force that is still missing over that which the plain model lacks; r_e: the share of
the held-out logs' square error beyond noise that is left. A machine's own law leaves next to
nothing of either. Laws that together take the place of one that the library lacks leave hardly an
error either, but more of the force, and they are several. The coefficients are those of largest
likelihood on the machines of `benchmarks/probability.py`; a third of them have an effect that the
library lacks. Ours: `README.md`, (12).
"""

import numpy as np

from identification.thresholds import HALF

COEFFICIENTS = (1.0, -1.0, -0.2, -3.5)  # b_0 to b_3
Evidence = tuple[float, ...]  # the terms of (1)
LEAST_FORCE_LEFT, LEAST_ERROR_LEFT = 1e-4, 1e-3  # of either share: below, noise decides


def evidence(force_left: float | None, error_left: float, named: int) -> Evidence:
    """The terms of (1) for effects that leave these shares; force_left: None where no body slides,
    named: how many effects."""
    force = error_left if force_left is None else force_left
    return (
        1.0,
        float(np.log10(np.clip(force, LEAST_FORCE_LEFT, 1.0))),
        float(np.log10(np.clip(error_left, LEAST_ERROR_LEFT, 1.0))),
        float(named > 1),
    )


def probability(terms: Evidence, alike: int = 0) -> float:
    """Probability of an effect by its evidence, shared with so many others that explain as much."""
    odds = float(np.dot(COEFFICIENTS, terms))
    return float(1.0 / (1.0 + np.exp(-odds)) / (1 + alike))


def is_probable(chance: float) -> bool:
    """Whether an effect of this probability is rather the machine's than not."""
    return chance >= HALF
