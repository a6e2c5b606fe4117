"""The model of one machine: what identification found."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, SkipValidation

from design.machine.arx_plant import ArxPlant
from design.machine.codec import (
    NOT_WRITTEN,
    PLACEHOLDER,
    UNWRITTEN,
    Parameter,
    Through,
    in_units,
    no_key,
)
from design.machine.drive import PRESENT_LOOP, Present
from design.machine.effect_values import estimates_in_si, known_effect
from design.machine.nearest import nearest
from design.machine.plain import as_number
from design.machine.readable import Display, in_unit
from identification.drift.reference_model import OwnLogs
from identification.effects._base import Acting
from identification.effects._library import Library, built_in
from identification.errors import BadModel
from identification.log import Rig
from identification.model.estimates import Drive, Estimate
from identification.model.karnopp import COULOMB_NAMES, NAMES, VISCOUS_NAMES, Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.signals.bad_samples import BadSamples
from identification.thresholds import ADEQUATE, MATERIAL

FALLING_NAMES = (*COULOMB_NAMES, *VISCOUS_NAMES)
FAST = 0.99  # quantile of the measured speeds, that counts as a log's
SLACK = 1e-9  # of a correlation that rounding takes beyond 1


@dataclass(frozen=True)
class LogEntry:
    """One fitted run: its file, the state in which it starts (m, m/s, N) and what the fit leaves.

    position_rms is None where no free run follows the log: the motion is prescribed.
    travel: lowest and highest measured position [m]; force_peak: largest applied force [N];
    duration, h [s]; speed: what 1 % of the measured speeds exceed [m/s]; period: of the samples in
    the file [s], where h is that of the samples fitted; both None in older files.
    """

    file: str
    sha256: str
    rows: int
    start: tuple[float, float, float]
    travel: tuple[float, float]
    force_peak: float
    duration: float
    h: float
    position_rms: float | None
    force_rms: float | None
    chi_square: float
    speed: float | None = None
    period: float | None = None

    def __post_init__(self) -> None:
        for name in ("h", "duration"):
            if not getattr(self, name) > 0:
                raise BadModel(f"[log] {name} = {getattr(self, name):g} s, must be > 0")


@dataclass(frozen=True)
class FitSummary:
    """Noise found (m, N), chi-square per value, and whether only noise is left.

    drive: what the fitted run was driven by; stiffness [N/m] couples a force-driven one to the
    measured position. force_relative, force_rms [N]: the mechanical equation on sliding samples.
    command_period [s]: after which the drive gives its next command, None where that is the log's;
    of a run driven by a measured force: for which that is constant (zero-order hold), None without
    one.
    """

    drive: Drive
    stiffness: float
    noise_y: float
    noise_F: float
    chi_square: float
    adequate: bool
    evaluations: int
    force_relative: float | None
    force_rms: float | None
    remarks: tuple[str, ...]
    command_period: float | None = None

    def __post_init__(self) -> None:
        for name in ("noise_y", "noise_F", "stiffness", "command_period"):
            value = getattr(self, name)
            if value is not None and not value >= 0:
                raise BadModel(f"[fit] {name} = {value:g}, must be 0 or more")


@dataclass(frozen=True)
class ParameterCorrelation:
    """How the errors of the parameters `names` (d,) go together: `matrix` (d, d).

    With the standard deviations that stand with the parameters it is their covariance. Raises
    BadModel where it is no such matrix.
    """

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        d = len(self.names)
        if len(set(self.names)) != d or [len(row) for row in self.matrix] != [d] * d:
            raise BadModel(
                f"[correlation] {d} names and rows of other lengths; a square one needed"
            )
        if not all(abs(entry) <= 1.0 + SLACK for row in self.matrix for entry in row):
            raise BadModel("[correlation] has entries beyond -1 to 1; run the command again")


@dataclass(frozen=True)
class Identifiable:
    """Whether the logs can identify a parameter, why (not), and what run to add where they cannot.

    within: half its 95 % interval over its value, which a fit should not exceed; None: not known.
    only_if: what has to hold for it to be identified where that is not known before the fit; "":
    it is.
    """

    name: str
    can: bool
    why: str
    add: str = ""
    within: float | None = None
    only_if: str = ""


def _effects(found: Mapping[str, Mapping[str, Estimate]], info: Any) -> Any:
    """Effects in SI; raises BadModel where one is not in the library, or a unit of another kind."""
    around = info.context
    try:
        return {
            key: estimates_in_si(
                key, own, around.library, around.conversion, around.motion, around.units.command
            )
            for key, own in found.items()
        }
    except BadModel as error:
        said = str(error)
        raise BadModel(said if said.startswith("[") else f"[{PLACEHOLDER}] {said}") from None


def _posterior(found: Mapping[str, Any], info: Any) -> Mapping[str, Any]:
    """The posterior with its parameters in SI; raises BadModel where one is no value with its unit,
    or of another kind."""
    around, where = info.context, f"{PLACEHOLDER}.parameters"
    units = {**around.units.friction, **around.actuator}
    for key, own in (info.data.get("effects") or {}).items():
        units |= {f"{key}.{name}": one.unit for name, one in own.items()}
    try:
        own = {name: Estimate(**one) for name, one in found.get("parameters", {}).items()}
    except (TypeError, AttributeError):
        raise BadModel(
            f"[{where}] a table of value, unit, sd, low, high each needed; run"
            " 'workbench identify --posterior' again"
        ) from None
    for name in own:
        if name not in units:
            raise BadModel(f"[{where}] unknown parameter {name!r}")
    in_si = {
        name: in_unit(one, units[name], f"[{where}.{name}]", around.conversion)
        for name, one in own.items()
    }
    return {**found, "parameters": {name: as_number(one) for name, one in in_si.items()}}


def _library(found: Any, info: Any) -> Any:
    """The effects that the file may name, which it does not hold itself."""
    return info.context.library if found is built_in() else no_key(found)


Parameters = Mapping[str, Parameter]
Nine = Annotated[
    Mapping[str, Estimate],
    Through(
        Parameters,
        lambda found, info: in_units(found, info.context.units.friction, info.context.conversion),
    ),
]
OF_ACTUATOR = Through(
    Parameters, lambda found, info: in_units(found, info.context.actuator, info.context.conversion)
)


@dataclass(frozen=True)
class Model:
    """Everything that is needed to simulate a machine and to say how well it is known; in SI.

    friction: the nine by the paper's names; actuator: k1, k2, or k_a, None without a command;
    effects: parameters by key and name. plant is None with the reason in `plant_reason`.
    posterior: what `--posterior` found; correlation: of the parameters' errors; own_logs: how far
    the logs lie from the model, each alone; bad_samples: samples excluded from them; controller:
    the one that the machine has now; identifiability: what the logs could identify before a fit,
    empty where not asked; lag: of the motion behind the force's column [s], None where none shows;
    resonance: of a second mass (`frequency`, `anti_resonance` [Hz], `damping`, `m_1`, `m_2`);
    falling: slopes below 0 (F_vp, F_vn [N s/m]) with which friction falls with speed, and its level
    at rest beside each (F_cp, F_cn [N]): of a motion that is predicted, never of one simulated.
    library: where the effects' equations are. read: what to say of its file, a
    line for each value in another unit than ours.
    """

    card: str
    rig: Rig
    friction: Nine
    actuator: Annotated[Mapping[str, Estimate] | None, OF_ACTUATOR]
    plant: ArxPlant | None
    plant_reason: str | None
    fit: FitSummary
    log: tuple[LogEntry, ...]
    versions: Mapping[str, str]
    effects: Annotated[
        Mapping[str, Mapping[str, Estimate]], Through(Mapping[str, Parameters], _effects)
    ] = field(default_factory=dict)
    posterior: Annotated[Mapping[str, Any] | None, Through(Mapping[str, Any], _posterior)] = None
    correlation: ParameterCorrelation | None = None
    own_logs: OwnLogs | None = None
    bad_samples: tuple[BadSamples, ...] = ()
    controller: Annotated[Present | None, PRESENT_LOOP] = None
    identifiability: tuple[Identifiable, ...] = ()
    lag: Parameter | None = None
    resonance: Mapping[str, Parameter] | None = None
    falling: Nine = field(default_factory=dict)
    schema: Literal["model/1"] = "model/1"
    library: Annotated[
        Library, SkipValidation, BeforeValidator(_library), Field(validate_default=True), *UNWRITTEN
    ] = field(default_factory=built_in, compare=False, repr=False)
    read: Annotated[tuple[str, ...], *NOT_WRITTEN] = field(default=(), compare=False, repr=False)

    def __post_init__(self) -> None:
        if not self.log:
            raise BadModel("[log] is empty; at least one run needed")
        for name in self.friction:
            if name not in NAMES:
                raise BadModel(f"[friction] unknown key {name!r}{nearest(name, NAMES)}")
        for name in NAMES:
            if name not in self.friction:
                raise BadModel(f"[friction] has no {name!r}; add it with a value, or null")
        for name in self.falling:
            if name not in FALLING_NAMES:
                raise BadModel(f"[falling] unknown key {name!r}{nearest(name, FALLING_NAMES)}")
        effects = {f"effects.{key}": found for key, found in self.effects.items()}
        drive, falling = self.actuator or {}, self.falling
        tables = {"friction": self.friction, "actuator": drive, "falling": falling, **effects}
        for table, found in tables.items():
            for name, estimate in found.items():
                _check_estimate(f"[{table}.{name}]", estimate)
        _ = self.simulated

    @property
    def karnopp(self) -> Karnopp:
        """The nine that simulations use; assumed ones where the log does not identify them."""
        return Karnopp(**{name: used(self.friction[name]) for name in NAMES})

    @property
    def simulated(self) -> Plant:
        """The plant as simulations use it."""
        return Plant(self.karnopp, _drive_of(self.actuator), self.acting)

    @property
    def acting(self) -> tuple[Acting, ...]:
        """The effects with the parameters that simulations use."""
        return tuple(
            known_effect(key, self.library).acting({name: used(e) for name, e in found.items()})
            for key, found in self.effects.items()
        )

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the nine that no log identifies."""
        return tuple(name for name in NAMES if not self.friction[name].known)

    @property
    def coulomb_unknown(self) -> bool:
        """Whether no level is known of which a force could be a share."""
        return {"F_cp", "F_cn"} <= set(self.assumed)

    @property
    def travel(self) -> tuple[float, float]:
        """Lowest and highest position in the logs [m]."""
        return (min(e.travel[0] for e in self.log), max(e.travel[1] for e in self.log))

    @property
    def force_peak(self) -> float:
        """Largest applied force in the logs [N]."""
        return max(entry.force_peak for entry in self.log)

    @property
    def speed(self) -> float | None:
        """What 1 % of the measured speeds exceed [m/s], of the fastest log; None where unknown."""
        return max((entry.speed for entry in self.log if entry.speed), default=None)

    @property
    def period(self) -> float:
        """The shortest sampling period of its logs [s], as they were written, in four digits."""
        return float(f"{min(entry.period or entry.h for entry in self.log):.4g}")

    @property
    def holds_force(self) -> bool:
        """Whether the applied force is constant from each sample to the next: a motor's, or a
        measured one that the logs showed to be so."""
        measured = self.fit.drive == "force" and self.fit.command_period is not None
        return self.rig.kind == "motor" or measured

    @property
    def identifies_friction(self) -> bool:
        """Whether any of the nine is identified."""
        return any(value.known for value in self.friction.values())

    @property
    def identifies_one_way(self) -> bool:
        """Whether it identifies sliding in one direction alone, as of logs that move one way."""
        ways = (("F_cp", "F_vp"), ("F_cn", "F_vn"))
        up, down = (any(self.friction[name].known for name in way) for way in ways)
        return up != down

    @property
    def by_equation(self) -> bool:
        """Whether the parameters are those of the equation of motion, not of a free run."""
        return all(entry.position_rms is None for entry in self.log)

    @property
    def lacks(self) -> str:
        """What it leaves of its logs beside noise, in words; "" where nothing.

        Of that its margins say nothing. The share of the force is that of the equation of motion.
        """
        if self.fit.adequate or self.resonance is not None:
            return ""
        left, near = self.fit.force_relative, self.fit.chi_square <= ADEQUATE
        if near and self.by_equation:
            return "no free run of the model follows its logs, its equation of motion alone does"
        if near and (left is None or left <= MATERIAL):
            return ""
        share = "" if left is None else f" ({100 * left:.2g} % of the force)"
        return f"the model lacks a force, it leaves more of its logs than noise{share}"

    @property
    def prescribed_motion(self) -> bool:
        """Whether the motion was prescribed by a rig: no drive of its own shows in the logs, and no
        run by the measured force follows them, as that of an adequate model does."""
        driven = self.rig.kind == "motor" or self.actuator is not None or self.fit.adequate
        return self.by_equation and not driven

    @property
    def rotary(self) -> bool:
        """Whether positions are angles [rad]."""
        return self.rig.motion == "rotary"

    @property
    def display(self) -> Display:
        """In which units its numbers are held and shown."""
        return Display.of(self.rig)


def used(estimate: Estimate) -> float:
    """The value that simulations use of an estimate."""
    value = estimate.value if estimate.value is not None else estimate.assumed
    if value is None:
        raise BadModel("neither a value nor an assumed one; a simulation needs one of them")
    return value


def _check_estimate(where: str, found: Estimate) -> None:
    if found.value is None and (not found.reason or found.assumed is None):
        raise BadModel(f"{where} is null; it needs a 'reason' and the value 'assumed' instead")
    if found.sd is not None and found.sd < 0:
        raise BadModel(f"{where} sd = {found.sd:g}, must be 0 or more")
    if found.low is not None and found.high is not None and found.low > found.high:
        raise BadModel(f"{where} low = {found.low:g} lies above high = {found.high:g}")


def _drive_of(actuator: Mapping[str, Estimate] | None) -> Actuator | Motor | None:
    if actuator is None:
        return None
    if set(actuator) == {"k_a"}:
        return Motor(used(actuator["k_a"]))
    if set(actuator) == {"k1", "k2"}:
        return Actuator(used(actuator["k1"]), used(actuator["k2"]))
    raise BadModel(f"[actuator] holds {sorted(actuator)}; 'k1' and 'k2', or 'k_a' needed")
