"""Simulation-based calibration: where the truth lies in posteriors and in Gauss-Newton intervals.

    python benchmarks/calibration.py [--draws 500] [--first 900] [--seconds 8] [--workers 2]
        [--effects none spring ...] [--no-posterior] [--picture FILE]

Each draw is a machine of its own: the nine of table 2, each times 0.8 to 1.25, in a loop at 500 Hz
with noise on position and force; for an effect also its size. Where intervals are right the rank of
the truth among a posterior's draws (of Gauss-Newton: its quantile) is uniform: chi-square over ten
bins (Talts et al., arXiv 1804.06788), and so large a share lies in central intervals of 50, 90 and
95 %. A fit begins at parameters 5 % off: what is judged is width, not the search.
"""

import argparse
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import chisquare, norm

from benchmarks.blind_effects import acting, place_of
from benchmarks.blind_machines import Machine, machine, simulated
from identification.arrays import Array
from identification.effects._base import Acting
from identification.effects._library import built_in
from identification.errors import UserError
from identification.estimation.fit import fit_plant
from identification.estimation.posterior import sample_posterior
from identification.log import Rig
from identification.model.karnopp import NAMES, Karnopp
from identification.model.plant import Plant

SIZES = {"spring": "k", "stribeck": "F_s", "nonlinear_viscous": "k", "cogging": "a",
         "load_dependent_friction": "mu"}  # fmt: skip
BINS, LEVELS = 10, (0.5, 0.9, 0.95)
STRENGTH = (0.1, 0.4)  # of an effect, in Coulomb friction
OFF = 0.05  # relative, of what a fit begins from
Ranks = Mapping[str, float]


@dataclass(frozen=True)
class Draw:
    """Where the truth of each parameter lies, 0 to 1, and why there is nothing where not."""

    posterior: Ranks
    gauss_newton: Ranks
    reason: str = ""


def varied(nine: Karnopp, rng: np.random.Generator) -> Karnopp:
    """The nine times 0.8 to 1.25; a breakaway stays at least as large as sliding."""
    drawn = nine.array * np.exp(rng.uniform(np.log(0.8), np.log(1.25), len(NAMES)))
    one = Karnopp.from_array(drawn)
    return replace(one, F_sp=max(one.F_sp, one.F_cp), F_sn=min(one.F_sn, -one.F_cn))


def acts_on(one: Machine, key: str, rng: np.random.Generator, seconds: float) -> Acting:
    """The effect, of a size that it has on this machine."""
    at = place_of(one, simulated(one, (), 0, "train", seconds))
    return acting(key, float(rng.uniform(*STRENGTH)), at, built_in(), rng)


def drawn(key: str, seed: int, seconds: float, with_posterior: bool) -> Draw:
    """One machine, its log, its fit and posterior, and where the truth lies in each."""
    rng = np.random.default_rng([seed, 36])
    one = machine("table2", seed)
    one = replace(one, friction=varied(one.friction, rng))
    try:
        effects = () if key == "none" else (acts_on(one, key, rng, seconds),)
        log = simulated(one, effects, seed, "train", seconds).log
        truth = truths(one.friction, effects)
        begun = Plant(
            Karnopp.from_array(one.friction.array * (1.0 + OFF * rng.uniform(-1.0, 1.0, 9))),
            one.drive,
            tuple(e.effect.acting({**e.values, SIZES[key]: e.values[SIZES[key]] * (1.0 + OFF)})
                  for e in effects),
        )  # fmt: skip
        fit = fit_plant([log], rng, rig=Rig("force"), prior=begun)
    except UserError as error:
        return Draw({}, {}, str(error))
    normal = {
        name: float(norm.cdf((truth[name] - found.value) / found.sd))
        for name, found in fit.estimates.items()
        if name in truth and found.value is not None and found.sd
    }
    if not with_posterior:
        return Draw({}, normal)
    sampled = sample_posterior(fit, [log], rng, rig=Rig("force"))
    if not sampled.converged:
        return Draw({}, normal, sampled.verdict)
    below = np.mean(sampled.samples < [truth.get(name, np.nan) for name in sampled.names], axis=0)
    ranks = dict(zip(sampled.names, below.tolist(), strict=True))
    return Draw({name: ranks[name] for name in ranks if name in truth}, normal)


def truths(nine: Karnopp, effects: tuple[Acting, ...]) -> dict[str, float]:
    """What is judged: each of the nine, or the size of an effect."""
    if not effects:
        return dict(zip(NAMES, nine.array.tolist(), strict=True))
    return {f"{e.effect.key}.{SIZES[e.effect.key]}": e.values[SIZES[e.effect.key]]
            for e in effects}  # fmt: skip


def p_uniform(ranks: Array) -> float:
    """Chi-square probability that ranks (n,) from 0 to 1 are uniform."""
    counts, _ = np.histogram(ranks, bins=BINS, range=(0.0, 1.0))
    return float(chisquare(counts).pvalue)


def table(title: str, ranks: Mapping[str, Array]) -> None:
    """A row a parameter: draws, probability, shares in central intervals."""
    print(f"{title:34s}{'draws':>6s}{'p':>8s}" + "".join(f"{100 * x:7.0f} %" for x in LEVELS))
    for name, own in ranks.items():
        shares = [float(np.mean(np.abs(own - 0.5) <= 0.5 * level)) for level in LEVELS]
        row = "".join(f"{100 * x:7.1f} %" for x in shares)
        print(f"  {name:32s}{len(own):6d}{p_uniform(own):8.3f}{row}")


def draw_picture(path: Path, ranks: Mapping[str, Mapping[str, Array]]) -> None:
    """Histograms of the ranks, a row of panels for each kind, with the 99 % band of a bin."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(name for own in ranks.values() for name in own))
    figure, axes = plt.subplots(
        len(ranks), len(names), figsize=(1.5 * len(names), 1.9 * len(ranks)),
        sharex=True, squeeze=False, layout="constrained",
    )  # fmt: skip
    for row, (kind, own) in zip(axes, ranks.items(), strict=True):
        for axis, name in zip(row, names, strict=True):
            one = own.get(name, np.empty(0))
            mean = max(len(one), 1) / BINS
            spread = 2.576 * np.sqrt(mean * (1 - 1 / BINS))
            axis.axhspan(mean - spread, mean + spread, color="0.88")
            axis.hist(one, bins=BINS, range=(0, 1), color="#2f6f9f", rwidth=0.9)
            axis.set_title(name.replace(".", "\n"), fontsize=8)
            axis.set_yticks([])
            axis.set_xticks([0, 1])
        row[0].set_ylabel(kind, fontsize=8)
    figure.suptitle("Rank of the truth; grey: 99 % of bins that are right", fontsize=9)
    figure.savefig(path, dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=500)
    parser.add_argument("--first", type=int, default=900)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--effects", nargs="*", default=["none", *SIZES])
    parser.add_argument("--no-posterior", action="store_true")
    parser.add_argument("--picture", type=Path)
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.draws)
    kinds: dict[str, dict[str, Array]] = {"posterior": {}, "Gauss-Newton": {}}
    with ProcessPoolExecutor(asked.workers) as pool:
        for key in asked.effects:
            made = list(pool.map(
                partial(drawn, key, seconds=asked.seconds, with_posterior=not asked.no_posterior),
                seeds,
            ))  # fmt: skip
            names = dict.fromkeys(name for one in made for name in one.gauss_newton)
            for kind, given in (
                ("posterior", [one.posterior for one in made]),
                ("Gauss-Newton", [one.gauss_newton for one in made]),
            ):
                ranks_of = {n: np.array([r[n] for r in given if n in r]) for n in names}
                ranks_of = {n: x for n, x in ranks_of.items() if len(x)}
                kinds[kind].update(ranks_of)
                table(f"{key}, {kind}", ranks_of)
            reasons = [one.reason for one in made if one.reason]
            print(f"  without a posterior {len(reasons)}", *dict.fromkeys(
                reason[:90] for reason in reasons[:3]), sep="\n    ", flush=True)  # fmt: skip
    if asked.picture:
        draw_picture(asked.picture, {k: v for k, v in kinds.items() if v})


if __name__ == "__main__":
    main()
