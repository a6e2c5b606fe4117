"""Nine parameters from simulated logs: errors, intervals, Cramer-Rao bound and time.

    python benchmarks/nine_parameters.py [--seeds 20] [--first 1000] [--signals t,y,F,u]
        [--noise-u 1e-4] [CARD ...]

Each recipe card is simulated with `--seeds` seeds from `--first` on; the method was chosen on
seeds below 600, so those from 1000 on judge it. The bound is that of the log itself: Fisher
information of position and force by central differences of exact simulations at the truth.
--noise-u [V] is added to the command as it is logged, of which the valve knows nothing.
"""

import argparse
import time
from dataclasses import dataclass, replace

import numpy as np

from design.simulated.recipe import Recipe
from design.simulated.record import record
from identification.arrays import Array
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import NAMES, Karnopp
from identification.model.plant import Actuator, Plant
from identification.simulation.free_run import free_run
from workbench.cards.card import load_card
from workbench.logs.sources import card_path

CARDS = ("paper_table1", "paper_table1_rich", "paper_table2", "paper_table3")
STEP = 1e-7  # relative, of a central difference; exact steps carry it


@dataclass(frozen=True)
class Trial:
    """One log: relative errors, truth inside the interval, bound, seconds."""

    errors: Array
    inside: Array
    bound: Array
    seconds: float
    chi_square: float


def response(nine: Array, k: Array, log: Log, start: Array) -> Array:
    """Position and force of the plant along the log's command, scaled by their noise."""
    plant = Plant(Karnopp.from_array(nine), Actuator(float(k[0]), float(k[1])))
    y, force = float(start[0]), float(start[1])
    run = free_run(plant, log, (y, 0.0, force - float(k[1]) * y), "command")
    return np.concatenate([run.y, run.F])


def bound(recipe: Recipe, log: Log) -> Array:
    """Least standard deviation (9,) of the nine, k1, k2 and the start being unknown too."""
    assert isinstance(recipe.plant.actuator, Actuator)
    actuator = recipe.plant.actuator
    theta = np.concatenate([recipe.plant.friction.array, [actuator.k1, actuator.k2, 0.0, 0.0]])
    scale = np.concatenate([np.abs(theta[:11]), [1e-3, 1.0]])
    weights = np.repeat([1 / recipe.noise_y, 1 / recipe.noise_F], len(log))
    columns = []
    for j, size in enumerate(scale):
        up, down = theta.copy(), theta.copy()
        up[j] += STEP * size
        down[j] -= STEP * size
        rise = response(up[:9], up[9:11], log, up[11:]) - response(
            down[:9], down[9:11], log, down[11:]
        )
        columns.append(weights * rise / (2 * STEP))
    jacobian = np.array(columns).T
    inverse = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    return np.asarray(np.sqrt(np.diag(inverse))[:9] * scale[:9])


def trial(name: str, recipe: Recipe, seed: int, signals: tuple[str, ...], noise_u: float) -> Trial:
    """Simulate, fit, compare."""
    log = record(name, recipe, seed)
    least = bound(recipe, log)
    seen = Log(name, {key: log[key] for key in signals})
    if noise_u > 0.0:
        noise = noise_u * np.random.default_rng([seed, 1]).standard_normal(len(log))
        seen = seen.with_signals(u=log["u"] + noise)
    begin = time.perf_counter()
    fit: KarnoppFit = fit_plant([seen], np.random.default_rng(seed), rig=Rig("force"))
    seconds = time.perf_counter() - begin
    truth = recipe.plant.friction.array
    errors = np.full(9, np.nan)
    inside = np.full(9, np.nan)
    for i, key in enumerate(NAMES):
        one = fit.estimates[key]
        if one.value is not None and one.low is not None and one.high is not None:
            errors[i] = one.value / truth[i] - 1.0
            inside[i] = one.low <= truth[i] <= one.high
    return Trial(errors, inside, least / np.abs(truth), seconds, fit.chi_square)


def report(name: str, trials: list[Trial], with_command: bool) -> None:
    """One table a card; the bound is that of a log with its command."""
    errors = np.array([t.errors for t in trials])
    least = np.median([t.bound for t in trials], axis=0)
    inside = np.array([t.inside for t in trials])
    rms = np.sqrt(np.nanmean(errors**2, axis=0))
    print(
        f"\n{name}: {len(trials)} seeds, fit {np.median([t.seconds for t in trials]):.2f} s median"
    )
    print(f"{'':6s}{'median %':>10s}{'worst %':>10s}{'rms %':>10s}{'bound %':>10s}", end="")
    print(f"{'rms/bound':>11s}{'in 95 %':>9s}{'reported':>6s}")
    for i, key in enumerate(NAMES):
        column = np.abs(errors[:, i])
        reported = int(np.count_nonzero(np.isfinite(column)))
        if not reported:
            print(f"{key:6s}{'not identified in any log':>40s}")
            continue
        share = f"{rms[i] / least[i]:.2f}" if with_command else "-"
        print(
            f"{key:6s}{100 * np.nanmedian(column):10.4f}{100 * np.nanmax(column):10.4f}"
            f"{100 * rms[i]:10.4f}{100 * least[i]:10.4f}{share:>11s}"
            f"{np.nanmean(inside[:, i]):9.2f}{reported:6d}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cards", nargs="*", default=list(CARDS))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--signals", default="t,y,F,u")
    parser.add_argument("--noise-u", type=float, default=0.0)
    asked = parser.parse_args()
    signals = tuple(asked.signals.split(","))
    for name in asked.cards:
        recipe = load_card(card_path(name)).recipe
        assert recipe is not None
        plain = replace(recipe, plant=replace(recipe.plant, effects=()))
        trials = [
            trial(name, plain, seed, signals, asked.noise_u)
            for seed in range(asked.first, asked.first + asked.seeds)
        ]
        report(name, trials, "u" in signals)


if __name__ == "__main__":
    main()
