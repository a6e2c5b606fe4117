"""A study as paper.json has it, and as a terminal shows it."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from design.machine.versions import versions
from studies.paper.claims import claims
from studies.paper.measures import Case, Figures
from studies.paper.settings import PRINTED_SUMS
from studies.paper.study import Study
from workbench.output import written
from workbench.screen import Row, Screen, more, screen, tabled

CLAIMS = ("where", "paper", "here", "")
FIGURES = ("servo", "squared error [m²]", "standstill [mm]", "limit cycle", "energy [V² s]")


def paper_document(found: Study) -> dict[str, Any]:
    """The study as strict JSON's types; squared errors in m^2, energies in V^2 s."""
    ours = found.ours
    return {
        "schema": "paper/1",
        "seeds": list(found.seeds),
        "tuning_seed": found.tuning_seed,
        "claims": [asdict(one) for one in claims(found)],
        "table_1": {
            name: {"paper": paper, "ours": error} for name, (paper, error) in found.table_1.items()
        },
        "simulation": {
            "pd": _cases(found.simulation.pd),
            "pid": _cases(found.simulation.pid),
            "pid_table_3": _cases(found.simulation.pid_table_3),
        },
        "rig": {
            "identified": {"table_2": found.rig.old.errors, "table_3": found.rig.new.errors},
            "before": _cases(found.rig.before),
            "drifted": {name: _cases(cases) for name, cases in found.rig.drifted.items()},
        },
        "sums": {
            which: {
                "paper": printed / PRINTED_SUMS["none"],
                "ours": found.rig.ratio("RST", which),
            }
            for which, printed in PRINTED_SUMS.items()
        },
        "rivals": {
            f"table_{number}": {
                name: {"setting": one.setting, **_figures(one.case.figures)}
                for name, one in rivals.items()
            }
            for number, rivals in found.competitors.items()
        },
        "sensitivity": {
            "N_c": found.sensitivity.N_c,
            "e_T": found.sensitivity.e_T,
            "noises": found.sensitivity.noises,
            "standstill": found.sensitivity.standstill,
            "chatter": found.sensitivity.chatter,
            "factors": found.sensitivity.factors,
            "wrong": found.sensitivity.wrong,
        },
        "beyond": {
            "ratio": ours.ratio,
            "modulus": ours.tuned.margins.modulus,
            "delay_s": ours.tuned.margins.delay_s,
            "dominant": ours.tuned.dominant,
            "compensator": ours.chosen,
            "R": ours.tuned.rst.R,
            "S": ours.tuned.rst.S,
            "T": ours.tuned.rst.T,
            "paper": _figures(ours.paper.figures),
            "ours": _figures(ours.ours.figures),
            "without_compensator": _figures(ours.bare.figures),
        },
        "versions": versions(),
    }


def _cases(cases: dict[str, Case]) -> dict[str, Any]:
    return {name: _figures(one.figures) for name, one in cases.items()}


def _figures(found: Figures) -> dict[str, Any]:
    return asdict(found)


def claim_rows(found: Study) -> list[Row]:
    """Every claim: where, the paper, here, verdict."""
    return [(one.where, one.paper, one.ours, one.verdict) for one in claims(found)]


def case_rows(cases: dict[str, Case]) -> list[Row]:
    """The figures of servos by name, under `FIGURES`."""
    return [(name, *figure_cells(one.figures)) for name, one in cases.items()]


def figure_cells(found: Figures) -> tuple[str, ...]:
    """Squared error, error at standstill, limit cycle and energy."""
    cycle, stand = found.limit_cycle, found.standstill
    return (
        f"{found.squared_error:.4g}",
        "-" if stand is None else f"{1e3 * stand:.3g}",
        "-" if cycle is None else f"{1e3 * cycle.amplitude:.3g} mm, {cycle.period:.2f} s",
        f"{found.energy:.3g}",
    )


def rival_servo_rows(found: Study, number: int) -> list[Row]:
    """The rivals on the plant of a table, the setting after the name."""
    return [
        (f"{name} ({one.setting})", *figure_cells(one.case.figures))
        for name, one in found.competitors[number].items()
    ]


def paper_screen(found: Study, folder: Path) -> Screen:
    """The study for a terminal: the paper's claims; the rivals' figures with --verbose."""
    return screen(
        f"seeds {', '.join(map(str, found.seeds))} judge; chosen on seed {found.tuning_seed}",
        tabled(CLAIMS, claim_rows(found), ()),
        more("rivals on the plant of table 1, steps of 0.1 m:"),
        more(tabled(FIGURES, rival_servo_rows(found, 1), (1, 2, 4))),
        more("rivals on the plant of table 3:"),
        more(tabled(FIGURES, rival_servo_rows(found, 3), (1, 2, 4))),
        written(folder, "report.html", "paper.json"),
    )
