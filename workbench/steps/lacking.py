"""What a model lacks, and so what its margins say nothing of."""

from identification.thresholds import ADEQUATE, MATERIAL
from workbench.documents.model import Model


def lacking(model: Model) -> str:
    """What a model leaves of its logs beside noise, in words; "" where nothing.

    The share of the force is that of the equation of motion.
    """
    if model.fit.adequate or model.resonance is not None:
        return ""
    left, near = model.fit.force_relative, model.fit.chi_square <= ADEQUATE
    if near and model.by_equation:
        return "no free run of the model follows its logs, its equation of motion alone does"
    if near and (left is None or left <= MATERIAL):
        return ""
    share = "" if left is None else f" ({100 * left:.2g} % of the force)"
    return f"the model lacks a force, it leaves more of its logs than noise{share}"
