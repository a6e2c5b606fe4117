"""Model and design of a rig whose velocity follows the command."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from design.machine.nearest import nearest
from design.machine.plain import plain
from design.machine.readable import Display
from identification.errors import BadModel
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.velocity.model import NAMES_OF_VALVE, NUMBERS, Valve


@dataclass(frozen=True)
class VelocityLog:
    """A fitted run: its file, duration and period h [s], lowest and highest position [m], largest
    size of the command."""

    file: str
    sha256: str
    rows: int
    duration: float
    h: float
    travel: tuple[float, float]
    command_peak: float


@dataclass(frozen=True)
class PredictionErrors:
    """Root mean square errors [m (rad)] of the position on stretches that no fit has seen.

    It is predicted over 2 s and over 0.2 s from where it is measured to be, in so many windows of
    2 s; noise_y: the sensor's.
    """

    position_rms_2s: float
    position_rms_02s: float
    windows: int
    noise_y: float


@dataclass(frozen=True)
class VelocityModel:
    """lag v' + v = g_p max(u - d_p, 0) - g_n max(-u - d_n, 0), a delay before; SI, u as logged.

    valve: the six by name; effects: what a trace added, by structure and number.
    """

    card: str
    rig: Rig
    valve: Mapping[str, Estimate]
    fit: PredictionErrors
    log: tuple[VelocityLog, ...]
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    effects: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    kind: Literal["velocity"] = "velocity"
    schema: Literal["velocity-model/1"] = "velocity-model/1"

    def __post_init__(self) -> None:
        if not self.log:
            raise BadModel("[log] is empty; at least one run needed")
        for name in NUMBERS:
            if name not in self.valve:
                raise BadModel(f"[valve] has no {name!r}; add it with a value, or null")
        for name, one in self.numbers.items():
            if name not in NAMES_OF_VALVE:
                raise BadModel(f"[valve] unknown key {name!r}{nearest(name, NAMES_OF_VALVE)}")
            if one.value is None and (one.reason is None or one.assumed is None):
                raise BadModel(f"[valve.{name}] is null; it needs a 'reason' and 'assumed'")

    @property
    def numbers(self) -> dict[str, Estimate]:
        """Those of the valve, and of its effects."""
        return {**self.valve, **{k: v for own in self.effects.values() for k, v in own.items()}}

    @property
    def simulated(self) -> Valve:
        """The valve as simulations use it; assumed numbers where the logs do not identify them."""
        return self._with(lambda one: one.assumed if one.value is None else one.value)

    def end(self, low: bool) -> Valve:
        """The valve with the six at the low or high ends of their intervals."""

        def ends(one: Estimate) -> float | None:
            end = one.low if low else one.high
            if one.value is None:
                return one.assumed if low or one.at_most is None else one.at_most
            return one.value if end is None else end

        return replace(self._with(ends))

    def _with(self, value_of: Any) -> Valve:
        return Valve(**{name: float(value_of(one) or 0.0) for name, one in self.numbers.items()})

    @property
    def travel(self) -> tuple[float, float]:
        """Lowest and highest position in the logs [m]."""
        return min(e.travel[0] for e in self.log), max(e.travel[1] for e in self.log)

    @property
    def command_peak(self) -> float:
        """Largest size of the command in the logs."""
        return max(entry.command_peak for entry in self.log)

    @property
    def display(self) -> Display:
        """In which units its numbers are held and shown."""
        return Display.of(self.rig)


@dataclass(frozen=True)
class VelocityDesign:
    """u = inverse of the valve at v = k_p e + k_i int(e) + dr/dt; `ValveController` has the law.

    controller: its numbers with their units; margins: modulus [-], gain (factor), phase [deg],
    delay [s]; None where nothing destabilises.
    """

    card: str
    rig: Rig
    law: Literal["P", "PI"]
    controller: Mapping[str, Estimate]
    margins: Mapping[str, float | None]
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    kind: Literal["velocity"] = "velocity"
    schema: Literal["velocity-design/1"] = "velocity-design/1"


def velocity_document(found: VelocityModel | VelocityDesign) -> dict[str, Any]:
    """The model or design as it is written: the schema first, one entry an estimate."""
    out = plain(found)
    return {"schema": out.pop("schema"), "kind": out.pop("kind"), **out}
