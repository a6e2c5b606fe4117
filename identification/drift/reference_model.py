"""The active model, as the drift test takes it: values, joint covariance, and what it left."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from identification.arrays import Array
from identification.errors import BadModel
from identification.log import Rig
from identification.model.estimates import Drive
from identification.model.karnopp import VISCOUS_NAMES
from identification.model.plant import Plant, units_of

FORCES = ("F_cp", "F_cn", "F_sp", "F_sn")
SMALL_BESIDE = 0.1  # of the largest friction force, or of an effect's typical parameter


@dataclass(frozen=True)
class OwnLogs:
    """How far the logs of a model lie from it, each estimated alone as a new one is.

    names (d,): parameters; scatter (d,): root mean square over the logs of the change from the
    model, relative to `ReferenceModel.scales`, None where no log identifies the parameter. apart
    (n,): square distance of each log from the model in the covariance of both fits, over the number
    of parameters; left (n,): misfit of its own fit. parts: they are stretches of one log. Raises
    BadModel where sizes differ.
    """

    names: tuple[str, ...]
    scatter: tuple[float | None, ...]
    apart: tuple[float, ...]
    left: tuple[float, ...]
    parts: bool = False

    def __post_init__(self) -> None:
        if len(self.scatter) != len(self.names):
            raise BadModel(
                f"[own_logs] {len(self.names)} names, {len(self.scatter)} values of scatter; one a"
                " name needed"
            )
        if len(self.apart) != len(self.left) or len(self.left) < 2:
            raise BadModel(
                f"[own_logs] {len(self.apart)} values of apart, {len(self.left)} of left; as many"
                " of each needed, of two logs at least"
            )
        if not all(x is None or x >= 0 for x in (*self.scatter, *self.apart, *self.left)):
            raise BadModel("[own_logs] holds a value below 0; run 'workbench identify' again")


@dataclass(frozen=True, eq=False)
class ReferenceModel:
    """A machine's model against which its new logs are tested, in SI.

    names (d,): parameters that it identifies, in the order of `values` (d,) and `covariance`
    (d, d), effects' as key.name; not_identifiable: its others, with the reason. drive: what
    drove its fit; chi_square: what the fit left, 1 for the sensors' noise; prescribed: only
    the force equation was fitted; fastest [m/s]: speed at which a viscous force is evaluated, 0
    where it is not known. own_logs: how far its own logs lie from it, None where a single one
    leaves noise alone, or that is not known. key: names the model in a `DriftState`.
    force_relative: share of the force that the equation of motion leaves, None where not known.
    """

    plant: Plant
    names: tuple[str, ...]
    values: Array
    covariance: Array
    rig: Rig
    drive: Drive
    chi_square: float = 1.0
    prescribed: bool = False
    not_identifiable: Mapping[str, str] = field(default_factory=dict)
    key: str = ""
    fastest: float = 0.0
    own_logs: OwnLogs | None = None
    force_relative: float | None = None

    @property
    def scales(self) -> Array:
        """Size (d,) that a relative change refers to: the value, or what is small beside friction.

        A force below a tenth of the largest friction force is compared with that tenth; so is
        a viscous one, at the fastest speed of the model's logs. An effect's asymmetry is a share by
        itself.
        """
        force = SMALL_BESIDE * max(abs(getattr(self.plant.friction, one)) for one in FORCES)
        viscous = force / self.fastest if self.fastest > 0 else 0.0
        least = dict.fromkeys(FORCES, force) | dict.fromkeys(VISCOUS_NAMES, viscous)
        for acting in self.plant.effects:
            for p in acting.effect.params:
                small = 1.0 if p.name == "asymmetry" else SMALL_BESIDE * abs(p.typical)
                least[f"{acting.key}.{p.name}"] = small
        size = np.maximum(np.abs(self.values), [least.get(name, 0.0) for name in self.names])
        return np.where(size > 0, size, 1.0)

    @property
    def relative_covariance(self) -> Array:
        """Covariance (d, d) of the parameters' errors in their scales."""
        return self.covariance / np.outer(self.scales, self.scales)

    @property
    def units(self) -> Mapping[str, str]:
        """Units by name."""
        found = dict(units_of(self.rig.motion, self.rig.command_unit))
        for acting in self.plant.effects:
            found |= {f"{acting.key}.{p.name}": p.unit for p in acting.effect.params}
        return found
