"""Are effects named as often right as `trace` says they are?

    python benchmarks/blind.py --machines random force motor --strengths 0.03 0.3 --removed
        --clean 30 --two 30 --out blind.jsonl
    python benchmarks/probability.py blind.jsonl [...]

Every effect that a trace of the blind benchmark names is one case: right where the log has it. The
coefficients of `identification/tracing/probability` are fitted on nine tenths of the runs (by
their names) and judged on the tenth, each in turn: Brier's score, and the reliability error, which
is the mean difference of what is said and what is so over groups of equal size, weighted by these
(Stone, J. R. Stat. Soc. B 36 (1974) 111). Then the same of those that the code has now, on all
runs. Exit status 0 in any case.
"""

import argparse
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from identification.arrays import Array
from identification.tracing.probability import COEFFICIENTS, is_probable, probability

FOLDS = 10  # of the runs, left out in turn
GROUPS = 5  # of the probabilities said, of as many effects each
SLIGHT = 0.1  # weight of the coefficients' squares: of few runs none grows without bound


@dataclass(frozen=True)
class Named:
    """An effect that a trace named: run, key, terms of its evidence, and whether the log has it."""

    run: str
    key: str
    terms: tuple[float, ...]
    right: bool


def named_in(files: Sequence[Path]) -> list[Named]:
    """Every effect that the runs of these files name."""
    out = []
    for file in files:
        for text in file.read_text(encoding="utf-8").splitlines():
            line = json.loads(text)
            found = line.get("trace", {})
            if not found.get("evidence"):
                continue
            true = set() if line["mode"] == "removed" else set(line["truth"]["effects"])
            out += [
                Named(line["case"], one["key"], tuple(found["evidence"]), one["key"] in true)
                for one in found["effects"]
            ]
    return out


def fitted(named: Sequence[Named]) -> Array:
    """Coefficients (3,) of largest likelihood; Cox, J. R. Stat. Soc. B 20 (1958) 215."""
    A, right = np.array([one.terms for one in named]), np.array([one.right for one in named])

    def cost(b: Array) -> float:
        odds = A @ b
        likely = np.sum(np.logaddexp(0.0, odds) - right * odds)
        return float(likely + SLIGHT * np.sum(b[1:] ** 2))

    return np.asarray(minimize(cost, np.zeros(A.shape[1])).x)


def judged(named: Sequence[Named], said: Array) -> None:
    """Brier's score and the reliability of probabilities (n,) said of effects."""
    right = np.array([one.right for one in named], dtype=np.float64)
    order, off = np.argsort(said, kind="stable"), 0.0
    for group in np.array_split(order, GROUPS):
        if len(group):
            mean, share = float(np.mean(said[group])), float(np.mean(right[group]))
            off += abs(mean - share) * len(group) / len(said)
            print(f"    said {mean:5.2f}, right {share:5.2f} of {len(group)}")
    brier = float(np.mean((said - right) ** 2))
    print(
        f"  {len(named)} effects, {int(right.sum())} right; Brier {brier:.3f}, reliability error"
        f" {off:.3f}"
    )


def fold_of(run: str) -> int:
    """The part of all runs that a run is of."""
    return int.from_bytes(hashlib.sha256(run.encode()).digest()[:4]) % FOLDS


def left_out(named: Sequence[Named]) -> Array:
    """Probabilities (n,) of effects by coefficients fitted on the other folds."""
    said, of = np.zeros(len(named)), np.array([fold_of(one.run) for one in named])
    for fold in range(FOLDS):
        b = fitted([one for one, own in zip(named, of, strict=True) if own != fold])
        A = np.array([one.terms for one in named])[of == fold].reshape(-1, len(b))
        said[of == fold] = 1.0 / (1.0 + np.exp(-A @ b))
    return said


def main() -> None:
    """Fits, judges, prints."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", type=Path)
    named = named_in(parser.parse_args().files)
    print("each fold by a curve fitted on the others:")
    judged(named, left_out(named))
    print(f"fitted on all: {', '.join(f'{x:.2f}' for x in fitted(named))}")
    print(f"as the code has it ({', '.join(f'{x:g}' for x in COEFFICIENTS)}), of all:")
    judged(named, np.array([probability(one.terms) for one in named]))
    for one in named:
        if one.right != is_probable(probability(one.terms)):
            print(f"    {one.run} {one.key}: {probability(one.terms):.2f}, {one.right}")


if __name__ == "__main__":
    main()
