"""The design of one machine: controllers, margins, compensator; and design.json, which holds it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from design.compensator import Compensator
from design.margins import Margins
from design.pid import PIDGains
from design.rst import RST
from identification.errors import BadModel
from identification.karnopp import Karnopp
from workbench.reading import read_result

SCHEMA = "design/1"
From = Literal["physical", "arx"]


@dataclass(frozen=True)
class Linear:
    """The sampled plant a design rests on, force reference [N] to position [m], and why this one.

    m [kg], F_v [N s/m] are None for an ARX plant.
    """

    source: From
    why: str
    A: tuple[float, ...]
    B: tuple[float, ...]
    h: float
    m: float | None
    F_v: float | None


@dataclass(frozen=True)
class ForceLoop:
    """C_F = k_i (1 + h z^-1/(T_i (1 - z^-1))), k_i [V/N], T_i [s], run every h [s]."""

    k_i: float
    T_i: float
    h: float


@dataclass(frozen=True)
class MarginValues:
    """Margins of a loop as results carry them; worst_modulus over the parameters' intervals.

    None: no limit of that kind; worst_modulus None: unstable for some parameters inside them.
    """

    modulus: float
    gain_up: float | None
    gain_down: float | None
    phase_deg: float | None
    delay_s: float | None
    delay_samples: float | None
    S_yp_max_db: float
    S_up_max_db: float | None
    worst_modulus: float | None


@dataclass(frozen=True)
class Controller:
    """S F_ref = T r - R y, polynomials in z^-1, run every h [s].

    dominant: (w_n [rad/s], zeta); auxiliary: poles z as (re, im). missed: goals not kept. gains:
    of a PID in parallel form, k_R (1 + 1/(T_i s) + T_d s/(eps s + 1)).
    """

    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    h: float
    dominant: tuple[float, float]
    auxiliary: tuple[tuple[float, float], ...]
    margins: MarginValues
    missed: tuple[str, ...]
    gains: PIDGains | None = None
    note: str | None = None

    @property
    def rst(self) -> RST:
        """The controller for the loop."""
        return RST(np.array(self.R), np.array(self.S), np.array(self.T), self.h)


@dataclass(frozen=True)
class CompensatorValues:
    """Parameters of the compensator (4); assumed: names of the nine that no log told."""

    N_c: float
    e_T: float
    friction: Mapping[str, float]
    assumed: tuple[str, ...]

    def __post_init__(self) -> None:
        _ = self.value

    @property
    def value(self) -> Compensator:
        """The compensator for the loop."""
        try:
            friction = Karnopp(**self.friction)
        except TypeError as error:
            raise BadModel(f"[compensator.friction] {error}; all nine are needed") from None
        return Compensator(friction, self.N_c, self.e_T)


@dataclass(frozen=True)
class Design:
    """Controllers of one machine; one may be None with its reason in `refused`."""

    card: str
    plant: Linear
    force: ForceLoop | None
    rst: Controller | None
    pid: Controller | None
    refused: Mapping[str, str]
    recommended: Literal["rst", "pid"]
    compensator: CompensatorValues
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    schema: Literal["design/1"] = "design/1"

    @property
    def controllers(self) -> dict[str, Controller]:
        """The controllers that exist, by name."""
        return {k: c for k, c in (("rst", self.rst), ("pid", self.pid)) if c is not None}


def margin_values(found: Margins, worst: float | None) -> MarginValues:
    """The margins as results carry them."""
    return MarginValues(
        modulus=found.modulus,
        gain_up=found.gain_up,
        gain_down=found.gain_down,
        phase_deg=found.phase_deg,
        delay_s=found.delay_s,
        delay_samples=None if found.delay_s is None else found.delay_s / found.h,
        S_yp_max_db=found.S_yp_max_db,
        S_up_max_db=found.S_up_max_db,
        worst_modulus=worst,
    )


def design_document(found: Design) -> dict[str, Any]:
    """The design as design.json writes it, the schema first."""
    document = asdict(found)
    return {"schema": document.pop("schema"), **document}


def read_design(path: Path) -> Design:
    """The design in the file `path`; raises BadModel in one line where it is none."""
    found = read_result(path, Design, SCHEMA)
    if not found.controllers:
        raise BadModel(f"{path}: holds no controller; run 'workbench design' again")
    return found
