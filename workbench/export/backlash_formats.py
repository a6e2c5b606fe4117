"""The play of an axis in the formats of controls, each by a template of its own."""

from collections.abc import Callable
from typing import Any

import numpy as np

from identification.errors import BadModel
from identification.model.estimates import Estimate
from workbench.cards.readable import number
from workbench.export.compensation import Compensation, TableFile
from workbench.export.filled import filled

CNC_UNITS = {False: (1e7, "0.0001 mm"), True: (1.8e6 / np.pi, "0.0001 deg")}  # P-AXIS-00103
CNC_LARGEST = 32767  # SGN16
WHICH_SIDE = (
    "the sign of the value depends on where the control's encoder is; say by --encoder motor"
    " (before the play, the usual case) or --encoder load (the transducer of the logs, behind it)"
)
MOTOR_SIDE = "the control positions by an encoder before the play"
LOAD_SIDE = (
    "the control positions by the transducer behind the play: the drive's side is ahead of it, so"
    " the value is negative; a tool on the transducer's side needs no compensation at all"
)
ONLY_BEFORE = (
    "has a value for play behind the encoder alone; with --encoder load there is none to write"
)


def backlash_csv(what: Compensation) -> TableFile:
    """The width of the play with its interval."""
    play, (unit, factor) = known_play(what), _length(what)
    width, low, high = (
        "" if one is None else f"{factor * one:.9g}" for one in (play.value, play.low, play.high)
    )
    text = filled(
        "backlash.csv", card=what.model.card, unit=unit, width=width, low=low, high=high
    )  # fmt: skip
    return TableFile(
        f"{what.name}_backlash.csv", text, "backlash", "", f"{unit} of the axis",
        "any program that reads CSV", 1, 0.0,
    )  # fmt: skip


def sinumerik(what: Compensation) -> TableFile:
    """MD32450 of the axis."""
    width, unit, factor = _signed(what)
    text = filled("sinumerik_backlash.mpf", **_lead(what), width=f"{factor * width:.9g}", unit=unit)
    left = (
        "sinumerik: quadrant error compensation (MD32520) is left out: it is a speed impulse, and"
        " how large depends on the speed controller, which no model has; the circularity test"
        " finds it"
    )
    return TableFile(
        f"{what.name}_sinumerik_backlash.mpf", text, "backlash", "sinumerik", unit,
        "SINUMERIK: machine data of the axis, MD32450 (AX1 is to be your axis)", 1, 0.0, (),
        (left,),
    )  # fmt: skip


def codesys(what: Compensation) -> TableFile:
    """The input fBacklash of SMC_BacklashCompensation: half of the play, as it covers it twice."""
    width, unit, factor = _before(what, "SMC_BacklashCompensation of CODESYS")
    text = filled(
        "codesys_backlash.st", **_lead(what), name=what.name, half=f"{factor * width / 2:.9g}",
        width=f"{number(factor * width, 6)} {unit}", unit=unit,
    )  # fmt: skip
    return TableFile(
        f"{what.name}_codesys_backlash.st", text, "backlash", "codesys",
        f"{unit} (the axis's units are to be these)", "CODESYS SoftMotion: a program of the axis's"
        " task", 1, 0.0, (),
        ("codesys: fBacklash is half of the play: after a reversal the block moves twice as far",),
    )  # fmt: skip


def linuxcnc_ini(what: Compensation) -> TableFile:
    """BACKLASH of a joint in LinuxCNC's INI file."""
    width, unit, factor = _before(what, "BACKLASH of LinuxCNC")
    text = filled("linuxcnc_backlash.ini", **_lead(what), width=f"{factor * width:.9g}", unit=unit)
    return TableFile(
        f"{what.name}_linuxcnc_backlash.ini", text, "backlash", "linuxcnc",
        f"{unit} (LINEAR_UNITS or ANGULAR_UNITS are to be these)",
        "LinuxCNC: the INI file, section of the joint", 1, 0.0,
    )  # fmt: skip


def twincat_nc(what: Compensation) -> TableFile:
    """The input Backlash of MC_BacklashCompensation."""
    width, unit, factor = _signed(what)
    text = filled(
        "twincat_nc_backlash.st", **_lead(what), name=what.name, width=f"{factor * width:.9g}",
        unit=unit,
    )  # fmt: skip
    return TableFile(
        f"{what.name}_twincat_nc_backlash.st", text, "backlash", "twincat",
        f"{unit} (the axis's units are to be these)",
        "TwinCAT NC: a program of the axis, Tc2_MC2", 1, 0.0,
    )  # fmt: skip


def twincat_cnc_play(what: Compensation) -> TableFile:
    """getriebe[0].lose of an axis of TwinCAT CNC."""
    width, _unit, _factor = _signed(what)
    factor, unit = CNC_UNITS[what.rotary]
    value = round(factor * width)
    if abs(value) > CNC_LARGEST:
        raise BadModel(
            f"{what.model.card}: a play of {value} times {unit}, where P-AXIS-00103 of TwinCAT CNC"
            f" holds {CNC_LARGEST} at most; take MC_BacklashCompensation"
        )
    text = filled("twincat_cnc_backlash.lis", **_lead(what), value=value, unit=unit)
    return TableFile(
        f"{what.name}_twincat_cnc_backlash.lis", text, "backlash", "twincat", unit,
        "TwinCAT CNC: the axis's parameter list, P-AXIS-00103", 1,
        abs(value / (factor * width) - 1.0),
    )  # fmt: skip


BACKLASH: dict[str, tuple[Callable[[Compensation], TableFile], ...]] = {
    "twincat": (twincat_nc, twincat_cnc_play),
    "codesys": (codesys,),
    "linuxcnc": (linuxcnc_ini,),
    "sinumerik": (sinumerik,),
}


def known_play(what: Compensation) -> Estimate:
    """The width of the play [m]; raises BadModel where the model has none."""
    if what.play is None or not what.play.value:
        raise BadModel(
            f"{what.model.card}: the model has no backlash, so there is no value for it; 'workbench"
            " trace' searches for one"
        )
    return what.play


def _length(what: Compensation) -> tuple[str, float]:
    """The unit in which controls take lengths or angles of an axis, and how many make one in SI."""
    return ("deg", 180.0 / np.pi) if what.rotary else ("mm", 1e3)


def _signed(what: Compensation) -> tuple[float, str, float]:
    """Width [m], negative where the encoder trails the drive; unit and factor of the control's."""
    width = known_play(what).value or 0.0
    if what.asked.encoder is None:
        raise BadModel(f"backlash in a control's format: {WHICH_SIDE}")
    unit, factor = _length(what)
    return (width if what.asked.encoder == "motor" else -width), unit, factor


def _before(what: Compensation, who: str) -> tuple[float, str, float]:
    """As `_signed`, of a control that knows play behind its encoder alone."""
    width, unit, factor = _signed(what)
    if width < 0:
        raise BadModel(f"{who} {ONLY_BEFORE}")
    return width, unit, factor


def _lead(what: Compensation) -> dict[str, Any]:
    """What stands at the head of every file of a control."""
    side = MOTOR_SIDE if what.asked.encoder == "motor" else LOAD_SIDE
    return {"card": what.model.card, "side": side}
