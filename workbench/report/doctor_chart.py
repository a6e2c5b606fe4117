"""The doctor's picture as charts: position, drive, clock, and the force over speed."""

import numpy as np

from identification.signals.differentiate import differentiate
from workbench.cards.units import si_unit
from workbench.report.chart import Band, Chart, Line, Panel
from workbench.report.chart_figure import evenly_spread
from workbench.steps.doctor import CheckedLog, Examined

Seen = CheckedLog | Examined
SCREEN_UNITS = {"m": (1e3, "mm"), "Pa": (1e-5, "bar"), "m/s": (1e3, "mm/s")}
MOST_BANDS = 60
NOISE_WIDTHS = 4.0  # of the velocity, within which a direction is not sure
DRIVE_WORDS = {"F": "applied force", "u": "command"}


def doctor_charts(found: Seen) -> list[Chart]:
    """The pictures of a log that was looked at; fewer where nothing of it can be drawn."""
    clock = _clock(found)
    if found.log is None:
        return [Chart("doctor", f"the clock of {found.file}", [clock])]
    time = Chart(
        "doctor", f"position, drive and clock of {found.file} over time",
        [_position(found), *_drive(found), clock],
    )  # fmt: skip
    over = _over_speed(found)
    return [time] if over is None else [time, over]


def unit_of(found: Seen, name: str) -> tuple[float, str]:
    """Factor and unit in which a signal is shown."""
    unit = found.command_unit if name == "u" else si_unit(name, found.rig.motion) or ""
    return SCREEN_UNITS.get(unit, (1.0, unit))


def speed_unit(found: Seen) -> tuple[float, str]:
    """Factor and unit in which a speed is shown."""
    return (1.0, "rad/s") if found.rig.motion == "rotary" else SCREEN_UNITS["m/s"]


def _position(found: Seen) -> Panel:
    log = found.log
    assert log is not None
    factor, unit = unit_of(found, "y")
    t = log["t"]
    lines = [Line("position", t, factor * log["y"], "measured")]
    if "r" in log:
        lines.insert(0, Line("reference", t, factor * log["r"], "reference", "dashed"))
    wide = [one for one in found.bad
            if one.samples == 1 or one.done not in ("interpolated", "kept")]  # fmt: skip
    bands = [
        Band("bad samples" if k == 0 else "", one.first, max(one.last, one.first + 2 * log.h),
             "x", "band")
        for k, one in enumerate(wide[:MOST_BANDS])
    ]  # fmt: skip
    return Panel("", f"position [{unit}]", lines, bands=bands)


def _drive(found: Seen) -> list[Panel]:
    log = found.log
    assert log is not None
    out = []
    for name in ("F", "u"):
        if name in log and not (name == "F" and found.rig.kind == "motor"):
            factor, unit = unit_of(found, name)
            line = Line(DRIVE_WORDS[name], log["t"], factor * log[name], "model")
            out.append(Panel("", f"{DRIVE_WORDS[name]} [{unit}]", [line], height=170))
    return out


def _clock(found: Seen) -> Panel:
    t, h = found.times if isinstance(found, Examined) else found.raw["t"], found.clock.h
    step = np.diff(t) / h if h > 0.0 else np.diff(t)
    top = max(2.0, 1.1 * float(np.nanmax(step))) if len(step) else 2.0
    line = Line("step", t[1:], step, "quiet")
    label = f"clock's step [{1e3 * h:.4g} ms]"
    return Panel("time [s]", label, [line], y_range=(0.0, top), height=130)


def _over_speed(found: Seen) -> Chart | None:
    log = found.log
    assert log is not None
    name = "F" if "F" in log else "u"
    if name not in log:
        return None
    motion = differentiate(log["y"], log.h)
    factor, unit = unit_of(found, name)
    speed, per = speed_unit(found)
    at = evenly_spread(len(log))
    sure = NOISE_WIDTHS * speed * motion.v_noise
    dots = Line(DRIVE_WORDS[name], speed * motion.v[at], factor * log[name][at], "measured", "dots")
    band = Band("velocity within its noise", -sure, sure, "x", "band")
    panel = Panel(f"velocity [{per}]", f"{DRIVE_WORDS[name]} [{unit}]", [dots], bands=[band])
    return Chart("speed", f"{DRIVE_WORDS[name]} of {found.file} over velocity", [panel])
