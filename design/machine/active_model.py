"""A model as the machines that it may be are drawn from it, and its new logs tested against it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from design.machine.model import Model, used
from identification.drift.reference_model import ReferenceModel
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import Motor


def active_model(model: Model, key: str) -> ReferenceModel:
    """The model as the drift test takes it; key: names it in the stored state.

    Without a correlation in the model file the parameters' errors count as independent.
    """
    every: dict[str, Estimate] = {name: model.friction[name] for name in NAMES}
    if not isinstance(model.simulated.actuator, Motor):
        every |= model.actuator or {}
    for effect, found in model.effects.items():
        every |= {f"{effect}.{name}": estimate for name, estimate in found.items()}
    identified = {n: e for n, e in every.items() if e.known and e.sd is not None}
    why = "it gives no standard deviation"
    unidentified = {n: e.reason or why for n, e in every.items() if n not in identified}
    return ReferenceModel(
        plant=model.simulated,
        names=tuple(identified),
        values=np.array([used(e) for e in identified.values()]),
        covariance=_covariance(model, identified),
        rig=model.rig,
        drive=model.fit.drive,
        chi_square=model.fit.chi_square,
        prescribed=model.by_equation,
        not_identifiable=unidentified,
        key=key,
        fastest=max((entry.speed or 0.0 for entry in model.log), default=0.0),
        own_logs=model.own_logs,
        force_relative=model.fit.force_relative,
    )


def _covariance(model: Model, identified: Mapping[str, Estimate]) -> Any:
    """Covariance (d, d) of the identified parameters by their deviations and the model's
    correlation."""
    sd = np.array([e.sd or 0.0 for e in identified.values()])
    together = np.eye(len(identified))
    if model.correlation is not None:
        place = {name: i for i, name in enumerate(model.correlation.names)}
        matrix = np.array(model.correlation.matrix)
        at = [(i, place[name]) for i, name in enumerate(identified) if name in place]
        rows, columns = [i for i, _ in at], [k for _, k in at]
        together[np.ix_(rows, rows)] = matrix[np.ix_(columns, columns)]
    return together * np.outer(sd, sd)
