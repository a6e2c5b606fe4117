"""What the paper shows or prints, and what its simulation here gives, line by line."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from studies.paper.measures import Case
from studies.paper.settings import PRINTED_R, PRINTED_S, PRINTED_SUMS, PRINTED_T
from studies.paper.study import Study

ClaimVerdict = Literal["reproduced", "partly", "not reproduced", "beaten", "kept", "short"]
REPRODUCED_WITHIN = 0.1  # of a printed ratio


@dataclass(frozen=True)
class PaperClaim:
    """Where, what the paper has, what we have, and how the two compare."""

    where: str
    paper: str
    ours: str
    verdict: ClaimVerdict


def claims(found: Study) -> tuple[PaperClaim, ...]:
    """Every figure and printed number that can be compared, in the paper's order."""
    return (
        _table_1(found),
        *_simulated(found),
        _rst(found),
        *_rig(found),
        *_remark(found),
        *_beyond(found),
    )


def _table_1(found: Study) -> PaperClaim:
    printed = max(abs(paper) for paper, _ in found.table_1.values())
    ours = max(abs(error) for _, error in found.table_1.values())
    return PaperClaim(
        "table 1",
        f"worst error of the nine {100 * printed:.1f} %",
        f"{100 * ours:.2g} %",
        "beaten" if ours < printed else "short",
    )


def _simulated(found: Study) -> Iterator[PaperClaim]:
    pd, pid, later = found.simulation.pd, found.simulation.pid, found.simulation.pid_table_3
    none, without, whole = (_stand(pd[n]) for n in ("none", "no zero-velocity", "eq. (4)"))
    e_T = found.simulation.set_up.e_T
    yield PaperClaim(
        "figure 6",
        "PD: the error at standstill goes only with the zero-velocity term",
        f"{_mm(none)} without compensator, {_mm(without)} without that term, {_mm(whole)} with it"
        f" (e_T = {_mm(e_T)})",
        _all(whole < e_T, whole < 0.1 * without, without < none),
    )
    stick = _stand(pd["F_stick in the band"])
    yield PaperClaim(
        "figure 6, eq. (2)",
        "F_stick in the whole band leaves an error",
        f"{_mm(stick)}: F_e fed back drives the force loop until the body moves",
        "reproduced" if stick > whole else "not reproduced",
    )
    force = pd["eq. (4)"].run.compensation_filtered
    yield PaperClaim(
        "figure 7",
        "compensation force between the stick limits",
        f"{float(np.min(force)):.1f} to {float(np.max(force)):.1f} N",
        "reproduced",
    )
    yield PaperClaim(
        "figure 8",
        "PID: no error at standstill, but a limit cycle",
        f"F_stick in the band: {_cycle(pid['F_stick in the band'])}; eq. (4):"
        f" {_cycle(pid['eq. (4)'])}; without compensator: {_cycle(pid['none'])}",
        _all(
            pid["F_stick in the band"].figures.limit_cycle is not None,
            pid["eq. (4)"].figures.limit_cycle is None,
        ),
    )
    yield PaperClaim(
        "figure 8, table 3",
        "what lowers the limit cycle (not shown)",
        f"without compensator {_cycle(later['none'])}; eq. (4) {_cycle(later['eq. (4)'])}; without"
        f" F_stick {_cycle(later['eq. (4), no F_stick'])}",
        _all(later["eq. (4), no F_stick"].figures.limit_cycle is None),
    )


def _rst(found: Study) -> PaperClaim:
    off = [
        float(np.max(np.abs(ours - np.array(printed))))
        for ours, printed in (
            (found.placed.R, PRINTED_R),
            (found.placed.S, PRINTED_S),
            (found.placed.T / np.array(PRINTED_T), np.ones(3)),
        )
    ]
    return PaperClaim(
        "section 3.3.4, R, S, T",
        "printed coefficients",
        f"R to {off[0]:.2g} of {max(PRINTED_R):.0f}, S to {off[1]:.1g}, T to {100 * off[2]:.1g} %",
        _all(off[0] < 0.25, off[1] < 6e-4, off[2] < 1e-4),
    )


def _rig(found: Study) -> Iterator[PaperClaim]:
    rig = found.rig
    none, without, whole = (_stand(rig.before[n]) for n in ("none", "no zero-velocity", "eq. (4)"))
    yield PaperClaim(
        "figure 11",
        "PD on the rig: no error at standstill with the compensator",
        f"{_mm(none)} without, {_mm(without)} without the zero-velocity term, {_mm(whole)} with it"
        f" (e_T = {_mm(rig.set_up.e_T)})",
        "partly" if whole < min(without, rig.set_up.e_T) else "not reproduced",
    )
    errors = [max(abs(e) for e in one.errors.values()) for one in (rig.old, rig.new)]
    yield PaperClaim(
        "tables 2 and 3",
        "identified on the rig",
        f"from one simulated log of 60 s each, every 10 ms: worst error {100 * errors[0]:.2g} % and"
        f" {100 * errors[1]:.2g} %",
        "reproduced",
    )
    for name, figures in (("PD", "figure 14"), ("PID", "figures 15 and 16")):
        old, new = (_sum(rig.drifted[name][k]) for k in ("old", "new"))
        yield PaperClaim(
            figures,
            f"{name} after the drift: old parameters are worse than new ones",
            f"squared error old / new {old / new:.3f}",
            "reproduced" if old > new else "not reproduced",
        )
    for which, printed in PRINTED_SUMS.items():
        if which != "none":
            paper, ours = printed / PRINTED_SUMS["none"], rig.ratio("RST", which)
            close = abs(ours / paper - 1.0) < REPRODUCED_WITHIN and (ours < 1.0) == (paper < 1.0)
            yield PaperClaim(
                f"printed sums, RST, {which} parameters",
                f"{paper:.3f} of that without compensation",
                f"{ours:.3f}",
                "reproduced" if close else "not reproduced",
            )
    bare = rig.ratio("RST", "new, no F_stick")
    yield PaperClaim(
        "figure 22",
        "without F_stick not much different",
        f"{bare:.3f} against {rig.ratio('RST', 'new'):.3f}",
        "reproduced"
        if abs(bare / rig.ratio("RST", "new") - 1.0) < REPRODUCED_WITHIN
        else "not reproduced",
    )
    rst, pid = (_sum(rig.drifted[name]["new"]) for name in ("RST", "PID"))
    yield PaperClaim(
        "section 4",
        "the RST is superior to the PID",
        f"squared error RST / PID {rst / pid:.2f}: the printed T makes y lag r by every pole",
        "reproduced" if rst < pid else "not reproduced",
    )


def _remark(found: Study) -> Iterator[PaperClaim]:
    maps = found.sensitivity
    middle = maps.N_c.index(2.0)
    stand = maps.standstill[0, middle]
    yield PaperClaim(
        "section 2, remark on e_T",
        "smaller e_T: smaller error at standstill",
        f"{_mm(stand[0])} at {_mm(maps.e_T[0])}, {_mm(stand[-1])} at {_mm(maps.e_T[-1])}",
        _all(bool(np.all(np.diff(stand) > 0))),
    )
    chatter = maps.chatter[-1, middle]
    yield PaperClaim(
        "section 2, remark on e_T",
        "smaller e_T: more switching under noise",
        f"at {maps.noises[-1]:g} times the noise F_comp changes by {chatter[0]:.2g} N a sample at"
        f" {_mm(maps.e_T[0])}, by {chatter[-1]:.2g} N at {_mm(maps.e_T[-1])}",
        _all(chatter[0] > 1.2 * chatter[-1]),
    )
    least, most = maps.standstill[0, 0, 4], maps.standstill[0, -1, 4]
    noisy = maps.standstill[-1, :, 0]
    yield PaperClaim(
        "section 2, remark on N_c",
        "larger N_c: larger error at standstill",
        f"at the paper's noise {_mm(least)} to {_mm(most)}; at {maps.noises[-1]:g} times, e_T ="
        f" {_mm(maps.e_T[0])}, {_mm(noisy[0])} to {_mm(noisy[-1])}",
        "reproduced"
        if most > 1.1 * least
        else "partly"
        if noisy[-1] > noisy[0]
        else "not reproduced",
    )


def _beyond(found: Study) -> Iterator[PaperClaim]:
    ours, margin = found.ours, found.ours.tuned.margins
    samples = float("inf") if margin.delay_s is None else margin.delay_s / margin.h
    yield PaperClaim(
        "beyond: squared error",
        "its RST with new parameters: 1",
        f"{ours.ratio:.3f} (without compensator {ours.bare_ratio:.3f})",
        "beaten" if ours.ratio <= 0.5 else "short",
    )
    yield PaperClaim(
        "beyond: margins",
        f"modulus margin {ours.paper_margins.modulus:.2f}; asked of ours: 0.5, two samples",
        f"modulus margin {margin.modulus:.2f}, delay margin {samples:.1f} samples",
        "kept" if margin.modulus >= 0.5 and samples >= 2.0 else "short",
    )
    yield PaperClaim(
        "beyond: control energy",
        f"{ours.paper.figures.energy:.3g} V² s",
        f"{ours.ours.figures.energy:.3g} V² s",
        "beaten" if ours.ours.figures.energy <= ours.paper.figures.energy else "short",
    )


def _stand(case: Case) -> float:
    value = case.figures.standstill
    return float("nan") if value is None else value


def _sum(case: Case) -> float:
    return case.figures.squared_error


def _mm(value: float) -> str:
    return f"{1e3 * value:.3g} mm"


def _cycle(case: Case) -> str:
    found = case.figures.limit_cycle
    return "none" if found is None else f"{_mm(found.amplitude)}, {found.period:.2f} s"


def _all(*holds: bool) -> ClaimVerdict:
    return "reproduced" if all(holds) else "partly" if any(holds) else "not reproduced"
