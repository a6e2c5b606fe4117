"""A log before any fit on one screen, and as charts: position, drive, clock, force over speed; and
the installation on a terminal."""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from design.identified.examined import CheckedLog, Examined
from design.identified.identifiable_by_log import Way
from design.machine.readable import Display, number
from identification.estimation.regression.motion_log import SURE_OF_DIRECTION
from identification.log import Log
from identification.remarks import MinorRemark
from identification.signals.delays import Delay
from identification.signals.differentiate import differentiate
from identification.signals.envelope import evenly_spread
from identification.signals.sensor_state import Clock, SensorState
from workbench.cards.units import si_unit
from workbench.remarks import printed_once
from workbench.report.chart import Band, Chart, Line, Panel
from workbench.report.chart_figure import chart_figure
from workbench.screen import SCREEN_WIDTH, VERBOSE, Screen, instead, screen
from workbench.steps.installation import OPTIONAL, Installation

LABEL_WIDTH = 15
SHOWS_FROM = 10.0  # deviations of the noise, from which an effect would show
MOST_OF_A_KIND = 4  # lines on bad samples, notes and runs to add
END_IN_ADVICE = ("next", "note", "refused")  # kinds whose texts end in what to do


def doctor_screen(found: Examined, out: Path | None) -> Screen:
    """What the log shows; of each kind a few lines, all of them with --verbose."""
    few, every = (_lines(found, out, most) for most in (MOST_OF_A_KIND, None))
    return screen(instead(few, every))


def _lines(found: Examined, out: Path | None, most: int | None) -> list[str]:
    """The lines, of which each kind has at most so many."""
    bad, remarks = [one.line for one in found.bad], [*found.remarks]
    if most is not None:
        bad = printed_once(bad, [found.file])
        main = [one for one in remarks if not isinstance(one, MinorRemark)]
        remarks = printed_once(main, [found.file])
    ways, can = list[tuple[str, str]](), list[str]()
    if found.ways is not None:
        own = found.ways
        rests = f"reversals: {own.reversals}, rests: {own.rests}, at rest{_slower(found)}"
        rests += f" {own.rested:.3g} s"
        ways = [("direction +", _way(found, own.positive)),
                ("direction -", _way(found, own.negative)),
                ("motion", rests)]  # fmt: skip
    if found.identifiability:
        within = {one.name: one.within for one in found.identifiability if one.can}
        named = (n if x is None else f"{n} {100.0 * x:.2g} %" for n, x in within.items())
        can = [", ".join(named) or "nothing"]
    shows = list[str]()
    if found.effects is not None:
        shown = [key for key, by in found.effects.items() if by >= SHOWS_FROM]
        hidden = [key for key in found.effects if key not in shown]
        shows = [f"would show: {', '.join(shown) or 'none'}",
                 f"would not: {', '.join(hidden) or 'none'}"]  # fmt: skip
    # Each kind: its label, its texts, and of how many a screen has room at least.
    kinds: list[tuple[str, Sequence[str], int]] = [
        ("next", [first] if (first := advice(found)) else [], 1),
        ("clock", [_clock(found.clock)], 1),
        ("signal", [_sensor(found, one) for one in found.sensors], 8),
        ("samples", [_plain(found, one) for one in bad], 1),
        ("delay", [_delay(one) for one in found.delays], 1),
        *((name, [text], 1) for name, text in ways),
        ("identifiable", can, 1),
        ("only if", _together((one.only_if, one.name) for one in found.identifiability
                              if one.only_if), 1),
        ("unidentifiable", _together((one.why, one.name) for one in found.identifiability
                                     if not (one.can or one.only_if)), 6),
        ("effects", shows, 1),
        ("add", [one.removeprefix("add ") for one in found.add], 1),
        ("note", [_plain(found, one) for one in remarks], 1),
        ("refused", [_plain(found, found.refused)] if found.refused else [], 1),
    ]  # fmt: skip
    lines = [f"{found.file}: {_verdict(found)}"]
    for name, texts, few in kinds:
        at_most = None if most is None else max(most, few)
        lines += labelled(name, texts, at_most, whole=name in END_IN_ADVICE)
    if out is not None:
        lines.append(f"written: {out / 'doctor.json'}, {out / 'doctor.png'}")
    return lines


def _verdict(found: Examined) -> str:
    if found.refused:
        return "cannot be identified as it is (see refused)"
    what = "six numbers of the valve" if found.rig.kind == "velocity" else "nine parameters"
    if found.verdict == "nothing":
        return f"none of the {what} is identifiable from it"
    can = sum(one.can for one in found.main)
    many = "all of" if can == len(found.main) else f"{can} of"
    return f"{many} the {what} are identifiable from it"


def advice(found: Examined) -> str:
    """What to do before the log is identified; "" where nothing."""
    if found.refused:
        return "mend the log or its card (see refused), then ask again"
    if found.exchanged:
        return "exchange the columns of r and y in the card (see note), then ask again"
    if found.other_units:
        return "check the units in the card (see note), then ask again"
    if found.verdict == "nothing":
        return "log again, with the motion that 'add' names (--out FOLDER draws this log)"
    if found.rig.kind == "motor" and found.rig.force_per_command is None:
        return "write force_per_command under the card's [rig], then ask again"
    return ""


def labelled(
    name: str, texts: Sequence[str], most: int | None, *, whole: bool = False
) -> list[str]:
    """The first texts behind a label, each on one or two lines or whole, and how many more there
    are; most: None for all of them, whole."""
    out = []
    room = 2 * (SCREEN_WIDTH - LABEL_WIDTH) - 12
    for text in texts[:most]:
        short = text if most is None or whole else textwrap.shorten(text, room, placeholder=" ...")
        first, *rest = textwrap.wrap(short, SCREEN_WIDTH - LABEL_WIDTH) or [""]
        out += [f"{name:{LABEL_WIDTH}}{first}", *(f"{'':{LABEL_WIDTH}}{one}" for one in rest)]
    if most is not None and len(texts) > most:
        out.append(f"{'':{LABEL_WIDTH}}... and {len(texts) - most} more: {VERBOSE}")
    return out


def _plain(found: Examined, text: str) -> str:
    return text.replace(f"{found.file}: ", "").replace(f"{found.file}, ", "")


def _clock(clock: Clock) -> str:
    even = "even" if clock.jitter < 1e-3 else f"jitters by {clock.jitter:.1%} of a period"
    if clock.lost:
        even = f"even but for {clock.lost} rows that are lost"
    rate = f"{1.0 / clock.h:.4g} Hz" if clock.h > 0.0 else "no rate"
    gaps = "no gaps"
    if clock.gaps:
        many = f"{clock.gaps} gap" + ("s" if clock.gaps > 1 else "")
        gaps = f"{many}, the longest of {clock.longest_gap:.4g} s"
    return (
        f"{clock.rows} rows in {clock.duration:.4g} s, every {1e3 * clock.h:.4g} ms ({rate}),"
        f" {even}, {gaps}"
    )


def _sensor(found: Examined, one: SensorState) -> str:
    factor, unit = unit_of(found, one.name)
    low, high = factor * one.low, factor * one.high
    if low == high:
        return f"{one.name}: always {low:.4g} {unit}".rstrip()
    step = f"step {number(factor * one.step)}" if one.step > 0.0 else "no steps"
    noise = f"noise {number(factor * one.noise, 2)}"
    share = max(one.noise, one.step / np.sqrt(12.0)) / (one.high - one.low)
    span = f"{low:.4g} to {high:.4g} {unit}".rstrip()
    return f"{one.name}: {span}, {noise}, {step} ({number(100 * share, 2)} % of its range)"


def _delay(one: Delay) -> str:
    if one.of == "r" and one.seconds is not None and one.seconds < 0.0:
        return f"the position is ahead of its reference by {-1e3 * one.seconds:.3g} ms"
    what = {"u": "the command acts on the ", "r": "the position is behind its reference"}[one.of]
    what += one.on if one.of == "u" else ""
    if one.seconds is None:
        return f"{what}: none found"
    late = f"{1e3 * one.seconds:.3g} ms"
    return (
        f"{what} after {late}" if one.alike is None else f"{what} by {late} ({one.alike:.0%} alike)"
    )


def _way(found: Examined, one: Way) -> str:
    factor, unit = speed_unit(found)
    return (
        f"{one.seconds:.3g} s in motion at {factor * one.slow:.3g} to {factor * one.fast:.3g}"
        f" {unit}; starts from rest: {one.starts}, with a breakaway force: {one.breakaways}"
    )


def _slower(found: Examined) -> str:
    """Below which speed rest and motion are not distinguished: that which the noise and the step of
    the position may show."""
    if found.motion is None:
        return ""
    factor, unit = speed_unit(found)
    return f" (slower than {factor * SURE_OF_DIRECTION * found.motion.v_noise:.3g} {unit})"


def _together(said: Iterable[tuple[str, str]]) -> list[str]:
    """A line for each text of (text, name), with all its names."""
    names: dict[str, list[str]] = {}
    for text, name in said:
        names.setdefault(text, []).append(name)
    return [f"{', '.join(own)}: {text}" for text, own in names.items()]


def doctor_picture(found: Examined, path: Path) -> None:
    """The log as a PNG: position, drive, clock, and the force over the velocity."""
    panels = [panel for chart in doctor_charts(found) for panel in chart.panels]
    drawn = chart_figure(Chart("doctor", f"the log {found.file}", panels, columns=2))
    drawn.suptitle(f"{found.file}: {_verdict(found)}", x=0.01, ha="left", fontsize=11)
    drawn.savefig(path, format="png", dpi=110)


SCREEN_UNITS = {"m": (1e3, "mm"), "Pa": (1e-5, "bar"), "m/s": (1e3, "mm/s")}
MOST_BANDS = 60
NOISE_WIDTHS = 4.0  # of the velocity, within which a direction is not sure
DRIVE_WORDS = {"F": "applied force", "u": "command"}


def doctor_charts(found: CheckedLog) -> list[Chart]:
    """The pictures of a log that was looked at; fewer where nothing of it can be drawn."""
    clock = _clock_chart(found)
    if found.log is None:
        return [Chart("doctor", f"the clock of {found.file}", [clock])]
    what, log = f"position, drive and clock of {found.file} over time", found.log
    time = Chart("doctor", what, [_position(found, log), *_drive(found, log), clock])
    return [time, *_over_speed(found, log)]


def unit_of(found: CheckedLog, name: str) -> tuple[float, str]:
    """Factor and unit in which a signal is shown."""
    unit = found.command_unit if name == "u" else si_unit(name, found.rig.motion) or ""
    return SCREEN_UNITS.get(unit, (1.0, unit))


def speed_unit(found: CheckedLog) -> tuple[float, str]:
    """Factor and unit in which a speed is shown."""
    unit = Display.of(found.rig).velocity
    return SCREEN_UNITS.get(unit, (1.0, unit))


def _position(found: CheckedLog, log: Log) -> Panel:
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


def _drive(found: CheckedLog, log: Log) -> list[Panel]:
    out = []
    for name in ("F", "u"):
        if name in log and not (name == "F" and found.rig.kind == "motor"):
            factor, unit = unit_of(found, name)
            line = Line(DRIVE_WORDS[name], log["t"], factor * log[name], "model")
            out.append(Panel("", f"{DRIVE_WORDS[name]} [{unit}]", [line], height=170))
    return out


def _clock_chart(found: CheckedLog) -> Panel:
    t, h = found.raw["t"], found.clock.h
    step = np.diff(t) / h if h > 0.0 else np.diff(t)
    top = max(2.0, 1.1 * float(np.nanmax(step))) if len(step) else 2.0
    line = Line("step", t[1:], step, "quiet")
    label = f"clock's step [{1e3 * h:.4g} ms]"
    return Panel("time [s]", label, [line], y_range=(0.0, top), height=130)


def _over_speed(found: CheckedLog, log: Log) -> list[Chart]:
    name = "F" if "F" in log else "u"
    if name not in log:
        return []
    motion = differentiate(log["y"], log.h)
    factor, unit = unit_of(found, name)
    speed, per = speed_unit(found)
    at = evenly_spread(len(log))
    sure = NOISE_WIDTHS * speed * motion.v_noise
    dots = Line(DRIVE_WORDS[name], speed * motion.v[at], factor * log[name][at], "measured", "dots")
    band = Band("velocity within its noise", -sure, sure, "x", "band")
    panel = Panel(f"velocity [{per}]", f"{DRIVE_WORDS[name]} [{unit}]", [dots], bands=[band])
    return [Chart("speed", f"{DRIVE_WORDS[name]} of {found.file} over velocity", [panel])]


def installation_screen(
    found: Installation, registry: Mapping[str, Any] | None, wrong: Sequence[str]
) -> Screen:
    """Versions, kernels, data and registry, a line each, and what is wrong."""
    packages = ", ".join(f"{name} {number}" for name, number in found.packages.items())
    cache, cards, places = found.cache, found.data["cards"], found.cache["places"]
    size = float(str(cache["bytes"])) / 1e6
    writable = "writable" if cache["writable"] else "NOT writable"
    folder = "WORKBENCH_DATA is not set: measured sets are fetched when needed"
    says = "none named (--registry, or WORKBENCH_REGISTRY)"
    if registry is not None:
        many = f"answers, {registry['machines']} machines" if registry["answers"] else "no answer"
        says = f"{registry['where']}: {many}"
    rows = [
        ("python", found.python),
        ("system", f"{found.platform}, {found.processors} processors"),
        ("packages", packages),
        *(("optional", f"{name} {number or 'not installed'}: {OPTIONAL[name]}")
          for name, number in found.optional.items()),
        ("kernels", f"{cache['kernels']} compiled, {size:.3g} MB, {writable}"),
        *(("", f"in {place}") for place in (places if isinstance(places, list) else ())),
        ("data", found.data["folder"] or folder),
        *(("", f"{name}: {of['there']} of {of['of']} files")
          for name, of in (cards.items() if isinstance(cards, Mapping) else ())),
        ("registry", says),
        *(("wrong", one) for one in wrong),
    ]  # fmt: skip
    return screen(*(f"{label:10}{text}" for label, text in rows))
