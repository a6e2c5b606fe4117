"""Draw the README's picture: python tools/picture.py docs/first_fit.png"""

import sys
from pathlib import Path

import numpy as np

from design.simulated.record import record
from identification.estimation.fit import fit_plant
from identification.log import Rig
from identification.model.karnopp import NAMES, friction
from identification.model.plant import Plant
from identification.signals.differentiate import differentiate
from identification.signals.envelope import evenly_spread
from identification.simulation.free_run import free_run
from workbench.cards.card import load_card
from workbench.logs.sources import card_path
from workbench.report.chart_figure import BAND, MEASURED, MODEL, figure, label, style

# Errors printed in the paper's table 1 [%], in the order of NAMES.
PAPER = (14.8, 12.0, 13.6, 11.7, 5.2, 35.5, 1.7, 10.8, 9.7)
SEED = 1


def main(path: Path) -> None:
    """Simulate table 1, fit it, draw the fit, the friction curve and the errors."""
    recipe = load_card(card_path("paper_table1")).recipe
    assert recipe is not None
    log = record("paper_table1", recipe, SEED)
    fit = fit_plant([log], np.random.default_rng(SEED), rig=Rig("force"))
    run = free_run(Plant(fit.friction, fit.actuator), log, fit.logs[0].start, "command")
    motion = differentiate(log["y"], log.h)
    with style():
        drawn = figure(11.0, 3.4)
        left, middle, right = drawn.subplots(1, 3)
        part = slice(4500, 8500)
        left.plot(log["t"][part], 1e3 * log["y"][part], color=MEASURED, label="measured")
        left.plot(log["t"][part], 1e3 * run.y[part], "--", color=MODEL, label="model, from u alone")
        left.legend(loc="upper right")
        label(left, "time [s]", "position [mm]", "a step of the log")
        shown = evenly_spread(len(log), 3000)
        force = log["F"] - fit.friction.m * motion.a
        middle.plot(motion.v[shown], force[shown], ".", color=MEASURED, ms=2, label="F_e - m a")
        v = np.linspace(float(motion.v.min()), float(motion.v.max()), 800)
        curve = np.where(
            (v > fit.friction.dv_n) & (v < fit.friction.dv_p),
            np.nan,
            friction(v, np.zeros_like(v), fit.friction),
        )
        middle.plot(v, curve, color=MODEL, label="identified")
        middle.axvspan(fit.friction.dv_n, fit.friction.dv_p, color=BAND, alpha=0.3, label="band")
        middle.legend(loc="upper left")
        label(middle, "velocity [m/s]", "friction [N]", "the friction it finds")
        truth = recipe.plant.friction
        found = [fit.estimates[name].value or np.nan for name in NAMES]
        ours = 100 * np.abs(np.array(found) / truth.array - 1)
        at = np.arange(len(NAMES))
        right.bar(at - 0.2, PAPER, 0.4, color="#999999", label="paper")
        right.bar(at + 0.2, ours, 0.4, color=MODEL, label="this workbench")
        right.set_yscale("log")
        right.set_xticks(at, NAMES, rotation=45)
        right.set_ylim(1e-5, 300)
        right.legend(loc="upper right", ncols=2)
        label(right, "", "error [%]", "error of each parameter")
        drawn.savefig(path, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
