"""Model -> Design: PID and RST by pole placement, compensator, margins; and design.json."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from design.compensator import Compensator
from design.linear import ForceGains, force_gains, linear_plant
from design.margins import Margins
from design.pid import PIDGains
from design.rst import RST
from design.tune import Asked, Goals, Tuned, tune_pid, tune_rst
from identification.arrays import Array
from identification.errors import BadModel, BadSpecification, NotIdentifiable
from identification.karnopp import Karnopp
from identification.plant import Actuator
from workbench.model import Model, used
from workbench.reading import read_result

SCHEMA = "design/1"
From = Literal["physical", "arx"]
DEFAULT_PERIOD = 10e-3  # s, the paper's rig
N_C = 2.0  # the paper's, in simulation and on the rig
E_T_PER_TRAVEL = 0.03  # the paper's 3 mm on steps of 0.1 m
NOISE_SHARE = 0.2  # of the Coulomb force that the position's noise may ask for
FOLLOWS = 0.5  # free-run error of an ARX plant, relative to y, up to which it may carry a design


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


def design(
    model: Model,
    asked: Asked | None = None,
    *,
    goals: Goals | None = None,
    source: From | None = None,
    period: float | None = None,
) -> Design:
    """PID and RST for a model, by pole placement, with margins; poles searched where not asked.

    source: the linear plant to design on, by default the sounder. period: of the position
    controller [s]. Raises BadSpecification where no controller meets what was asked,
    NotIdentifiable where the model carries no design.
    """
    from workbench.model import versions

    asked = asked or Asked()
    plant, force = linear_of(model, source, period)
    goals = goals or Goals(effort=effort_limit(model))
    found: dict[str, Controller] = {}
    refused: dict[str, str] = {}
    a, b = np.array(plant.A), np.array(plant.B)
    others = corners(model, plant, force)
    for name, tune in (("rst", tune_rst), ("pid", tune_pid)):
        if name == "pid" and not asked.integrator:
            refused[name] = "a PID has an integrator; asked for none"
            continue
        wanted = asked
        if name == "pid" and asked.auxiliary is not None:
            wanted = Asked(asked.dominant, None, asked.integrator)
        try:
            tuned = tune(a, b, plant.h, wanted, goals, others)
        except BadSpecification as error:
            refused[name] = str(error)
            continue
        found[name] = _controller(tuned)
    by_hand = asked.dominant is not None or asked.auxiliary is not None
    if not found or ("rst" in refused and by_hand):
        raise BadSpecification(refused["rst"])
    recommended: Literal["rst", "pid"] = "rst" if "rst" in found else "pid"
    if "pid" in found and found[recommended].missed and not found["pid"].missed:
        recommended = "pid"
    return Design(
        card=model.card,
        plant=plant,
        force=force,
        rst=found.get("rst"),
        pid=found.get("pid"),
        refused=refused,
        recommended=recommended,
        compensator=_compensator(model),
        remarks=tuple(_remarks(model, plant)),
        versions=versions(),
    )


def linear_of(
    model: Model, source: From | None = None, period: float | None = None
) -> tuple[Linear, ForceLoop | None]:
    """The linear plant for a design and the force loop inside it, where there is an actuator.

    The physical one where the mass is identified: it holds the force loop and no noise. Raises
    NotIdentifiable where neither it nor an ARX plant that follows the logs is there.
    """
    known = model.friction["m"].value is not None
    if source == "arx" or (source is None and not known):
        plant = _arx(model, period, known)
        return plant, _force_loop(model, plant.h)
    if not known and source is None:
        raise NotIdentifiable(f"no plant to design on: m: {model.friction['m'].reason}")
    h_log = max(entry.h for entry in model.log)
    h = period or (model.plant.h if model.plant else max(DEFAULT_PERIOD, h_log))
    m, f = _nominal(model)
    force = _force_loop(model, h)
    a, b = _physical(m, f, h, model, force)
    inside = "with the actuator and its force loop" if force else "with the force as its input"
    why = f"mass and viscous friction are identified: sliding body, {inside}, sampled exactly"
    return Linear("physical", why, tuple(a.tolist()), tuple(b.tolist()), h, m, f), force


def sampled_plant(machine: Model, found: Design) -> Linear:
    """The linear plant of another machine under a design's force loop and period."""
    m, f = _nominal(machine)
    a, b = _physical(m, f, found.plant.h, machine, found.force)
    return Linear("physical", "", tuple(a.tolist()), tuple(b.tolist()), found.plant.h, m, f)


def _physical(
    m: float, f: float, h: float, model: Model, force: ForceLoop | None
) -> tuple[Array, Array]:
    actuator = model.simulated.actuator
    if force is None or not isinstance(actuator, Actuator):
        return linear_plant(m, f, h)
    gains = ForceGains(force.k_i, force.T_i)
    return linear_plant(m, f, h, actuator, gains, max(1, round(h / force.h)))


def _force_loop(model: Model, h: float) -> ForceLoop | None:
    """The force loop inside a position loop of period h, at the logs' period; None for a motor."""
    actuator = model.simulated.actuator
    if not isinstance(actuator, Actuator):
        return None
    ratio = max(1, round(h / max(entry.h for entry in model.log)))
    gains = force_gains(actuator, h / ratio)
    return ForceLoop(gains.k_i, gains.T_i, h / ratio)


def _nominal(model: Model) -> tuple[float, float]:
    """Mass and the mean of both viscous coefficients."""
    p = model.karnopp
    return p.m, 0.5 * (p.F_vp + p.F_vn)


def _arx(model: Model, period: float | None, known: bool) -> Linear:
    found = model.plant
    why_not = model.friction["m"].reason or "mass identified"
    if model.imposed:
        raise NotIdentifiable(
            "no plant to design on: the logged motion was imposed on the body; log a run in which"
            " the drive moves it freely"
        )
    if found is None:
        raise NotIdentifiable(f"no ARX plant to design on ({model.plant_reason}); m: {why_not}")
    if found.simulation_relative is None or found.simulation_relative > FOLLOWS:
        error = found.simulation_relative
        said = "runs away" if error is None else f"leaves {100 * error:.0f} % of the motion"
        raise NotIdentifiable(
            f"the ARX plant, run freely on held-out samples, {said} (at most {100 * FOLLOWS:.0f} %"
            f" needed), so it carries no design; m: {why_not}; log a run in which the drive moves"
            " the body freely"
        )
    if period is not None and abs(period - found.h) > 1e-6 * period:
        raise BadSpecification(
            f"the ARX plant is sampled every {found.h:g} s, {period:g} s asked; identify again with"
            f" --design-period {period:g}"
        )
    if found.input == "u":
        raise NotIdentifiable("the ARX plant's input is the command, a force is needed to design")
    why = "asked for" if known else "the mass is not identified; the ARX plant follows the logs"
    return Linear("arx", why, found.A, found.B, found.h, None, None)


def effort_limit(model: Model) -> float | None:
    """Largest |S_up| [dB]: the position's noise may ask for a fifth of the Coulomb force."""
    p = model.karnopp
    coulomb = 0.5 * (p.F_cp + p.F_cn)
    if not (coulomb > 0 and model.fit.noise_y > 0):
        return None
    return float(20 * np.log10(NOISE_SHARE * coulomb / model.fit.noise_y))


def _controller(tuned: Tuned) -> Controller:
    rst, gains, note = tuned.rst, None, None
    if tuned.pid is not None:
        gains, note = tuned.pid.gains, tuned.pid.note or tuned.pid.reason
    return Controller(
        R=tuple(rst.R.tolist()),
        S=tuple(rst.S.tolist()),
        T=tuple(rst.T.tolist()),
        h=rst.h,
        dominant=tuned.dominant,
        auxiliary=tuple((z.real, z.imag) for z in tuned.auxiliary),
        margins=margin_values(tuned.margins, tuned.worst),
        missed=tuned.missed,
        gains=gains,
        note=note,
    )


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


def corners(
    model: Model, plant: Linear, force: ForceLoop | None
) -> tuple[tuple[Array, Array], ...]:
    """Linear plants at the corners of the intervals of mass and viscous friction; () for ARX.

    Raises BadSpecification where the force loop is unstable on one.
    """
    if plant.source == "arx":
        return ()
    m, viscous = model.friction["m"], (model.friction["F_vp"], model.friction["F_vn"])
    masses = (m.low or used(m), m.high or used(m))
    least = min(used(v) if v.low is None else v.low for v in viscous)
    most = max(used(v) if v.high is None else v.high for v in viscous)
    return tuple(
        _physical(mass, f, plant.h, model, force) for mass in masses for f in (max(least, 0), most)
    )


def _compensator(model: Model) -> CompensatorValues:
    low, high = model.travel
    friction = asdict(model.karnopp)
    return CompensatorValues(N_C, E_T_PER_TRAVEL * (high - low), friction, model.assumed)


def _remarks(model: Model, plant: Linear) -> list[str]:
    out = []
    names = [name for name in ("F_vp", "F_vn") if model.friction[name].value is None]
    if plant.source == "physical" and names:
        out.append(f"{' and '.join(names)} not identified: an assumed value stands in the design")
    if model.assumed:
        out.append(f"compensator: assumed, not identified: {', '.join(model.assumed)}")
    if not model.fit.adequate:
        out.append("the model leaves more than noise; check the loop on the machine with care")
    return out


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
