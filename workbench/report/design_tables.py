"""A design as tables and lines, for a terminal and a report."""

from design.closed_loop.loop_figures import COMPENSATED, FIGURES_SAID, takes_compensator
from design.controllers.cascade import filter_words
from design.controllers.recommend import called, other_figures, own_figures
from design.drive_law import DriveLaw
from design.machine.codec import Output
from design.machine.design import Controller, Design
from design.machine.drive import equation_lines, force_lines
from design.machine.readable import number
from workbench.report.view import notes
from workbench.screen import Part, Row, instead, listed, more, tabled

DESIGN_HEAD = (
    "loop", "w_n rad/s", "zeta", "modulus", "worst", "gain", "phase", "delay", "periods", "|S_up|",
)  # fmt: skip
IN_DRIVES_HEAD = (
    "in a drive's words", "crossover", "rejects to", "follows to", "gain margin", "phase margin",
    "delay margin",
)  # fmt: skip
METRES_PER_MINUTE = 0.06  # of a Kv of 1/s, in m/min/mm
MARGINS_SAID = (
    "modulus, gain, phase, delay: the margins, how much more of each the loop bears; worst: the"
    " least modulus margin inside the parameters' intervals; periods: the delay margin in sampling"
    " periods; |S_up|: at most, from measurement noise to force"
)
FREQUENCIES_SAID = (
    "rejects to: bandwidth of the feedback, |S_yp| below -3 dB; follows to: reference to position"
    " above -3 dB, with the filter and the speed feed-forward of the reference"
)


def margins_table(found: Design) -> Part:
    """A row a controller."""
    rows = [(name.upper(), *_margins(one)) for name, one in found.controllers.items()]
    return tabled(DESIGN_HEAD, rows)


def drive_table(found: Design) -> Part:
    """The same in a drive engineer's words; without rows of an older file."""
    rows = list[Row]()
    for name, m in ((name, one.margins) for name, one in found.controllers.items()):
        ends = (m.crossover_hz, m.rejection_hz, m.bandwidth_hz)
        delay = None if m.delay_s is None else 1e3 * m.delay_s
        margins = ((m.gain_db, "dB"), (m.phase_deg, "deg"), (delay, "ms"))
        if any(f is not None for f in ends):
            said = ["-" if f is None else f"{number(f)} Hz" for f in ends]
            said += ["any" if one is None else f"{number(one)} {unit}" for one, unit in margins]
            rows.append((name.upper(), *said))
    return tabled(IN_DRIVES_HEAD, rows)


def _margins(one: Controller) -> Row:
    m = one.margins
    delay = ("any", "any")
    if m.delay_s is not None and m.delay_samples is not None:
        delay = f"{1e3 * m.delay_s:.3g} ms", f"{m.delay_samples:.2g}"
    w_n, zeta = (f"{one.dominant[0]:.3g}", f"{one.dominant[1]:.2g}")
    if one.cascade is not None:  # a cascade is not placed by its poles
        w_n, zeta = f"Kv {one.cascade.k_v:.3g}", "-"
    return (
        w_n,
        zeta,
        f"{m.modulus:.3f}",
        "unstable" if m.worst_modulus is None else f"{m.worst_modulus:.3f}",
        "any" if m.gain_up is None else f"x {m.gain_up:.3g}",
        "any" if m.phase_deg is None else f"{m.phase_deg:.3g} deg",
        *delay,
        "-" if m.S_up_max_db is None else f"{m.S_up_max_db:.3g} dB",
    )


def design_lines(found: Design) -> list[str]:
    """What the design rests on and what to know of it, in words."""
    every = [one if isinstance(one, Part) else listed([one]) for one in design_parts(found)]
    return [str(line) for one in every if not one.full_head for line in one.whole]


def loop_lines(found: Design) -> list[str]:
    """Periods, gains and the compensator of the loops."""
    c, units, output, command = found.compensator, found.display, "", found.command
    if command is not None:
        most = (
            "no limit" if command.limit is None else f"at most {command.limit:.4g} {command.unit}"
        )
        output = f", its output the command in {command.unit}, {most}"
        if found.force is not None:
            output = (
                f", its output the force reference in {units.force} for the force loop, whose"
                f" command is in {command.unit}, {most}"
            )
    lines = [f"position loop every {1e3 * found.plant.h:.4g} ms{output}"]
    if f := found.force:
        lines.append(
            f"force loop: k_i = {f.k_i:.4g} {units.force_gain}, T_i = {f.T_i:.4g} s,"
            f" every {1e3 * f.h:.4g} ms"
        )
    if found.pid and (g := found.pid.gains):
        lines.append(
            f"PID: k_R = {g.k_R:.5g} {units.stiffness}, T_i = {g.T_i:.4g} s, T_d = {g.T_d:.4g} s,"
            f" eps = {g.eps:.4g} s"
        )
    lines += cascade_lines(found)
    if not any(takes_compensator(found, name) for name in found.controllers):
        return lines
    pushed = "what breakaway needs beyond sliding" if c.excess else "the whole breakaway force"
    return [
        *lines,
        f"compensator: pushes with {pushed} at a position error of"
        f" {found.display.length_text(c.e_T)} (e_T), in the stick band over {c.N_c:g} (N_c)",
    ]


def cascade_lines(found: Design) -> list[str]:
    """The P-PI cascade in the units of a drive's parameter list, its filter and feed-forward."""
    one = found.p_pi
    if one is None or one.cascade is None:
        return []
    g, units, command = one.cascade, found.display, found.command
    k_v = f"{number(g.k_v)} 1/s"
    if not found.display.rotary:
        k_v += f" ({number(METRES_PER_MINUTE * g.k_v)} m/min/mm)"
    k_p = f"{number(g.k_p)} {units.force} s/{units.position}"
    per = command.force_per_command if command else None
    if command and per and command.unit != units.force:
        k_p += f" ({number(g.k_p / per)} {command.unit} s/{units.position})"
    lines = [
        f"P-PI: Kv = {k_v}, Kp = {k_p}, Tn = {number(1e3 * g.T_n)} ms, speed behind a filter of"
        f" {number(1e3 * g.eps)} ms, {100 * g.v_ff:.0f} % of the reference's speed fed forward"
    ]
    if one.series is not None:
        lines.append(f"P-PI: {filter_words(one.series)}, in R, S and T")
    if f := one.feed_forward:
        lines.append(
            f"P-PI: fed forward {number(f.m)} {units.named('mass')} of acceleration, friction of"
            f" {number(f.F_cp)} and {number(f.F_cn)} {units.force}, {number(f.F_vp)} and"
            f" {number(f.F_vn)} {units.force} s/{units.position}; the reference moved with at most"
            f" {number(one.acceleration or 0.0)} {units.position}/s^2"
        )
    return lines


def schedule_lines(found: Design) -> list[str]:
    """Of each controller with a gain schedule whether to take it, and why."""
    table = found.schedule
    if table is None:
        return []
    first, last = number(table.at[0]), number(table.at[-1])
    span = f"{len(table.at)} points from {first} to {last}{_unit_over(found, table.over)}"
    return [
        f"{name.upper()} over {table.over}, {span}: {one.why}"
        for name, one in table.controllers.items()
    ]


def schedule_rows(found: Design) -> list[str]:
    """The gains and the friction at each point of a schedule."""
    table, out = found.schedule, list[str]()
    if table is None:
        return out
    units, over = found.display, _unit_over(found, table.over)
    for name, one in table.controllers.items():
        for at, point, rubs in zip(table.at, one.points, table.friction, strict=True):
            said = "R, S, T in design.json"
            if (c := point.cascade) is not None:
                said = (
                    f"Kv = {number(c.k_v)} 1/s, Kp = {number(c.k_p)} {units.force} s/"
                    f"{units.position}, Tn = {number(1e3 * c.T_n)} ms, friction {number(rubs[0])}"
                    f" and {number(rubs[1])} {units.force}"
                )
            elif (g := point.gains) is not None:
                gain = f"k_R = {g.k_R:.5g} {units.stiffness}"
                said = f"{gain}, T_i = {g.T_i:.4g} s, T_d = {g.T_d:.4g} s"
            out.append(f"{name.upper()} at {number(at)}{over}: {said}")
    return out


def _unit_over(found: Design, over: str) -> str:
    """The unit of what a schedule goes over, with a space before it."""
    units = found.display
    return {"place": f" {units.position}", "load": f" {units.force}"}.get(over, "")


def design_sentence(found: Design) -> str:
    """Which controller, and what speaks for it, in one or two sentences."""
    lacks = of_the_model(found.lacks)
    if found.recommended == "none":
        return f"{lacks}No controller meets every goal; below is what each misses."
    why = ""
    if found.recommendation:
        why = f". With friction in simulation: {own_figures(found.recommendation.why)}"
    every = f"position loop every {1e3 * found.plant.h:.4g} ms"
    beside = found.recommendation is not None and found.recommendation.compensator
    name = called(found.recommended + (COMPENSATED if beside else ""))
    return f"{lacks}{name} recommended, {every}{why}."


def of_the_model(lacks: str) -> str:
    """The sentence that comes first where a design's model lacks something; "" else."""
    if not lacks:
        return ""
    return (
        f"{lacks[0].upper()}{lacks[1:]}: margins and figures are the model's, not the machine's. "
    )


def drive_lines(found: Design, only: str | None = None) -> list[str]:
    """The difference equation of each controller, or of one, as its drive runs it."""
    if found.command is None:
        return []
    units, limit, out = found.display, found.command.limit, list[str]()
    laws: dict[str, tuple[DriveLaw, Output]] = {
        name: (one.law(found.command), found.output) for name, one in found.controllers.items()
    }
    if found.present:
        laws[f"present {found.present.kind}"] = found.present.law, found.present.output
    laws = {name: law for name, law in laws.items() if only in (None, name)}
    for name, (law, output) in laws.items():
        first, *rest = equation_lines(law, output, limit, units)
        out += [f"{name.upper() if name in found.controllers else name}, {first}", *rest]
    if found.force:
        first, *rest = force_lines(found.force, limit, units)
        out += [f"force loop, {first}", *rest]
    return out


def design_parts(found: Design) -> list[Part | str]:
    """The margins, what the design rests on, and remarks; behind --verbose also the plant and the
    other controllers' ramps."""
    chosen = None if found.recommended == "none" else found.recommended
    others = other_figures(found.recommendation.why) if chosen and found.recommendation else ""
    missed = [(name, one) for name, each in found.controllers.items() for one in each.missed]
    ramps = [f"{name.upper()}: {one.note}" for name, one in found.controllers.items() if one.note]
    return [
        margins_table(found),
        MARGINS_SAID,
        drive_table(found),
        FREQUENCIES_SAID,
        listed([others] if others else []),
        more(FIGURES_SAID),
        more(f"plant: {found.plant.source}, {found.plant.why}"),
        listed(loop_lines(found)),
        listed(schedule_lines(found)),
        *map(more, schedule_rows(found)),
        listed(f"no {name.upper()}: {why}" for name, why in found.refused.items()),
        listed(f"{name.upper()} misses: {one}" for name, one in missed),
        instead([one for one in ramps if chosen and one.startswith(chosen.upper())], ramps),
        notes(found.remarks),
    ]
