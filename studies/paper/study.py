"""Everything the paper does and what goes beyond it, as one value."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from design.polynomial import multiply, second_order
from design.rst import RST, design_rst
from design.simulated.record import record
from design.specification import RSTSpecification
from identification.estimation.fit import fit_plant
from identification.model.karnopp import NAMES
from studies.paper.beyond import Ours, beyond
from studies.paper.figures_rig import RigFigures, rig_figures
from studies.paper.figures_simulation import SimulationFigures, simulation_figures
from studies.paper.rivals import RivalServo, rivals
from studies.paper.sensitivity import Sensitivity, sensitivity
from studies.paper.settings import DOMINANT, PRINTED_A, PRINTED_B, TABLE_1_ESTIMATED, friction_of
from workbench.cards.card import load_card
from workbench.logs.sources import card_path

ZEROS = ((100.0, 0.1), (200.0, 0.05), (314.0, 0.05))  # (w [rad/s], zeta) of H_R, worked out
TUNING = 100  # added to the first seed for what is chosen
Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Study:
    """The paper in simulation.

    seeds judge; what is chosen is chosen on `tuning_seed`. table_1: relative errors of the nine,
    the paper's method and ours, by name. placed: the RST of the specification that gives the
    printed one. competitors: the rivals on the plants of tables 1 and 3.
    """

    seeds: tuple[int, ...]
    tuning_seed: int
    table_1: dict[str, tuple[float, float]]
    placed: RST
    simulation: SimulationFigures
    rig: RigFigures
    competitors: dict[int, dict[str, RivalServo]]
    sensitivity: Sensitivity
    ours: Ours


def study(seeds: Sequence[int], on_progress: Progress) -> Study:
    """All of it; on_progress takes a stage's name and the share of the whole that is done."""
    tuning = seeds[0] + TUNING
    on_progress("identifying table 1", 0.0)
    errors = table_1_errors(tuning)
    on_progress("figures 6 to 8", 0.05)
    simulated = simulation_figures(seeds)
    on_progress("figures 11 to 22", 0.15)
    found = rig_figures(seeds, tuning)
    on_progress("our design", 0.4)
    ours = beyond(found.new, seeds, tuning)
    on_progress("rivals", 0.65)
    others = {k: rivals(k, seeds, tuning) for k in (1, 3)}
    on_progress("sensitivity", 0.8)
    maps = sensitivity(seeds[:1])
    on_progress("done", 1.0)
    return Study(tuple(seeds), tuning, errors, placed_rst(), simulated, found, others, maps, ours)


def table_1_errors(seed: int) -> dict[str, tuple[float, float]]:
    """Relative errors of table 1's nine: printed, and of our fit of one log of the shipped card."""
    card, truth = load_card(card_path("paper_table1_rich")), friction_of(1)
    if card.recipe is None:
        raise LookupError("the card paper_table1_rich has no recipe")
    log = record(card.name, card.recipe, seed, card.rig())
    fit = fit_plant([log], np.random.default_rng(seed), rig=card.rig())
    out = {}
    for name in NAMES:
        true, value = getattr(truth, name), fit.estimates[name].value
        if value is None:
            raise LookupError(f"the log of table 1 does not tell {name}")
        out[name] = (getattr(TABLE_1_ESTIMATED, name) / true - 1.0, value / true - 1.0)
    return out


def placed_rst() -> RST:
    """The RST of the specification from which the printed coefficients follow."""
    wanted = RSTSpecification(
        DOMINANT,
        H_S=[1.0, -1.0],
        H_R=multiply(*(second_order(w, zeta, 0.01) for w, zeta in ZEROS)),
        T="all-poles",
    )
    return design_rst(PRINTED_A, PRINTED_B, 0.01, wanted)
