"""The friction compensator of a design: its parameters, and the filters around it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from design.compensator import Compensator
from design.filters import CompensatorFilters, sampled
from design.machine.codec import PLACEHOLDER, Around, InUnit, Parameter, Through, in_units
from design.machine.model import used
from identification.errors import BadModel, BadSpecification
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES, Karnopp
from identification.signals.filters import Filter, slope_filter


@dataclass(frozen=True)
class FiltersAt(CompensatorFilters):
    """The compensator's filters, run every h [s]."""

    h: float = math.nan

    @classmethod
    def of(cls, filters: CompensatorFilters, h: float) -> "FiltersAt":
        """These filters at that period."""
        return cls(**vars(filters), h=h)


@dataclass(frozen=True)
class FiltersFile:
    """`FiltersAt` as a result has it: filters of figure 4 and the velocity (5).

    A: of the position whose slope the velocity is, B: of the position in r - y, C: of F_comp;
    slope: from the positions behind A to the velocity.
    """

    A: Filter
    B: Filter
    C: Filter
    slope: tuple[float, ...]
    h: Annotated[float, InUnit("s", above_0=True)]


def _filters(written: FiltersFile, _info: Any) -> FiltersAt:
    found = FiltersAt(written.A, written.B, written.C, len(written.slope), written.h)
    try:
        slope = slope_filter(written.h, found.N_d).b
        for one in (written.A, written.B, written.C):
            sampled(one)
    except BadSpecification as error:
        raise BadModel(f"[compensator.filters] {error}") from None
    if not np.allclose(slope, written.slope, rtol=1e-9):
        raise BadModel(
            f"[compensator.filters] slope = {written.slope}: the velocity (5) at h ="
            f" {written.h:g} s needs {slope}"
        )
    return found


def _filters_file(one: FiltersAt, _around: Around) -> FiltersFile:
    slope = slope_filter(one.h, one.N_d).b
    return FiltersFile(one.velocity, one.error, one.force, slope, one.h)


FILTERS = Through(FiltersFile, _filters, _filters_file)


def _all_nine(found: Mapping[str, Estimate], info: Any) -> dict[str, Estimate]:
    units = info.context.units.friction
    for name, one in found.items():
        where = f"[{PLACEHOLDER}.{name}]"
        if name not in units:
            raise BadModel(f"{where} is none of the nine: {', '.join(units)}")
        if one.value is None and (not one.reason or one.assumed is None):
            raise BadModel(f"{where} is null; it needs a 'reason' and the value 'assumed' instead")
    return in_units(found, units, info.context.conversion)


@dataclass(frozen=True)
class CompensatorValues:
    """Parameters of the compensator (4): N_c [-], e_T [m], the nine as the model has them.

    filters: around it, None in older files. excess: see `Compensator`.
    """

    N_c: Annotated[float, InUnit("1")]
    e_T: Annotated[float, InUnit("position")]
    friction: Annotated[Mapping[str, Estimate], Through(Mapping[str, Parameter], _all_nine)]
    filters: Annotated[FiltersAt | None, FILTERS] = None
    excess: bool = False

    def __post_init__(self) -> None:
        for name in NAMES:
            if name not in self.friction:
                raise BadModel(f"[compensator.friction] has no {name!r}; all nine are needed")
        _ = self.value

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the nine that no log identifies."""
        return tuple(name for name in NAMES if self.friction[name].value is None)

    @property
    def value(self) -> Compensator:
        """The compensator for the loop."""
        friction = Karnopp(**{name: used(self.friction[name]) for name in NAMES})
        return Compensator(friction, self.N_c, self.e_T, excess=self.excess)
