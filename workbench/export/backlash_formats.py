"""The play of an axis in the formats of controls, each by a template of its own."""

from functools import partial

import numpy as np

from identification.errors import BadModel
from identification.model.estimates import Estimate
from workbench.cards.readable import number
from workbench.export.compensation import Compensation, Content, Format

CNC_UNITS = {False: (1e7, "0.0001 mm"), True: (1.8e6 / np.pi, "0.0001 deg")}  # P-AXIS-00103
CNC_LARGEST = 32767  # SGN16
AXIS_UNITS = "{unit} (the axis's units are to be these)"
JOINT_UNITS = "{unit} (LINEAR_UNITS or ANGULAR_UNITS are to be these)"
QUADRANTS_LEFT_OUT = (
    "sinumerik: quadrant error compensation (MD32520) is left out: it is a speed impulse, and how"
    " large depends on the speed controller, which no model has; the circularity test finds it"
)
HALF_OF_THE_PLAY = (
    "codesys: fBacklash is half of the play: after a reversal the block moves twice as far"
)
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


def backlash_csv(what: Compensation) -> Content:
    """The width of the play with its interval."""
    play, (unit, factor) = known_play(what), _length(what)
    ends = {"width": play.value, "low": play.low, "high": play.high}
    shown = {key: "" if one is None else f"{factor * one:.9g}" for key, one in ends.items()}
    return Content(f"{unit} of the axis", values={"unit": unit, **shown})


def of_axis(
    what: Compensation, units: str, said: tuple[str, ...] = (), only_before: str = ""
) -> Content:
    """The play in a control that takes it in the axis's units, which are called so.

    only_before: the control's name where it knows play before its encoder alone.
    """
    width, unit, factor = _signed(what)
    if only_before and width < 0:
        raise BadModel(f"{only_before} {ONLY_BEFORE}")
    values = {
        **_values(what, unit, factor * width),
        "half": f"{factor * width / 2:.9g}",
        "shown": f"{number(factor * width, 6)} {unit}",
    }
    return Content(units.format(unit=unit), values=values, said=said)


def twincat_cnc_play(what: Compensation) -> Content:
    """getriebe[0].lose of an axis of TwinCAT CNC."""
    width, _unit, _factor = _signed(what)
    factor, unit = CNC_UNITS[what.rotary]
    value = round(factor * width)
    if abs(value) > CNC_LARGEST:
        raise BadModel(
            f"{what.model.card}: a play of {value} times {unit}, where P-AXIS-00103 of TwinCAT CNC"
            f" holds {CNC_LARGEST} at most; take MC_BacklashCompensation"
        )
    off = abs(value / (factor * width) - 1.0)
    return Content(unit, error=off, values={**_values(what, unit, factor * width), "value": value})


BACKLASH = (
    Format("backlash.csv", "backlash", "", "any program that reads CSV", backlash_csv),
    Format("twincat_nc_backlash.st", "backlash", "twincat",
           "TwinCAT NC: a program of the axis, Tc2_MC2", partial(of_axis, units=AXIS_UNITS)),
    Format("twincat_cnc_backlash.lis", "backlash", "twincat",
           "TwinCAT CNC: the axis's parameter list, P-AXIS-00103", twincat_cnc_play),
    Format("codesys_backlash.st", "backlash", "codesys",
           "CODESYS SoftMotion: a program of the axis's task",
           partial(of_axis, units=AXIS_UNITS, said=(HALF_OF_THE_PLAY,),
                   only_before="SMC_BacklashCompensation of CODESYS")),
    Format("linuxcnc_backlash.ini", "backlash", "linuxcnc",
           "LinuxCNC: the INI file, section of the joint",
           partial(of_axis, units=JOINT_UNITS, only_before="BACKLASH of LinuxCNC")),
    Format("sinumerik_backlash.mpf", "backlash", "sinumerik",
           "SINUMERIK: machine data of the axis, MD32450 (AX1 is to be your axis)",
           partial(of_axis, units="{unit}", said=(QUADRANTS_LEFT_OUT,))),
)  # fmt: skip


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


def _values(what: Compensation, unit: str, width: float) -> dict[str, str]:
    """What the template of a control is filled with: the width in its unit, and whose side."""
    side = MOTOR_SIDE if what.asked.encoder == "motor" else LOAD_SIDE
    return {"side": side, "name": what.name, "unit": unit, "width": f"{width:.9g}"}
