"""The obvious ways, on the same logs: stepwise BIC, LASSO, SINDy, and a Gaussian process.

All on the mechanical equation F = m a + (+-)F_c + F_v v + effects, at sliding samples, with
Savitzky-Golay derivatives. What acts on sensor, command, actuator, stiction or presliding has no
column there, so these methods cannot name it. Friction by |F| is left out: F being the left side,
such a column explains all of any log (measured: 1e-14 N on a clean one). LASSO and SINDy name an
effect whose columns make up at least TENTH of what they explain, the largest first; the Gaussian
process names nothing and says the signal of its shortest length scale. Where a package is missing,
the method says so.
"""

import importlib
import importlib.util
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from identification.arrays import Array, BoolArray
from identification.effects._base import Effect, Param
from identification.effects._library import Library
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.simulation.effect_along_motion import contribution

WINDOW, ORDER = 31, 3  # samples, degree of the Savitzky-Golay filter
SLOW = 0.01  # m/s, below which a sample is not sliding
EVERY = 5  # samples: neighbours say the same
ABSORBED = frozenset({"constant_force"})
ACTS = frozenset({"slip", "friction", "force"})
MOST = 6  # effects of the stepwise choice
FOLDS = 5
TENTH = 0.1
ALIKE = 0.999
POINTS = 400  # of the Gaussian process
FEATURES = ("y", "v", "t")
THRESHOLDS = (0.3, 0.1, 0.03, 0.01)  # of the residual, per normalised column
NOT_SIGNALS = frozenset({"y", "F", "r"})
Found = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Samples:
    """Sliding samples of a log: signals (n,), which of them count, plain columns and force."""

    signals: Mapping[str, Array]
    h: float
    keep: BoolArray
    X: Array
    F: Array


@dataclass(frozen=True, eq=False)
class Term:
    """An effect at one place of the grid of its other parameters."""

    effect: Effect
    shape: Mapping[str, float]

    @property
    def count(self) -> int:
        """Parameters that it adds."""
        return max(1, len(self.effect.linear)) + len(self.shape)


def samples(log: Log) -> Samples:
    """Velocity and acceleration by Savitzky-Golay, and the plain model's columns."""
    h, y = log.h, np.asarray(log["y"])
    v, a = (savgol_filter(y, WINDOW, ORDER, deriv=k, delta=h) for k in (1, 2))
    d = np.where(v > SLOW, 1.0, np.where(v < -SLOW, -1.0, 0.0))
    near = np.lib.stride_tricks.sliding_window_view(np.pad(d, WINDOW // 2, mode="edge"), WINDOW)
    keep = np.abs(np.mean(near, axis=1)) == 1.0
    keep[:WINDOW] = keep[-WINDOW:] = False
    keep &= np.arange(len(d)) % EVERY == 0
    more = {k: np.asarray(x) for k, x in log.signals.items() if k not in NOT_SIGNALS}
    F = np.asarray(log["F"])
    signals = {"u": np.zeros(len(y)), **more, "y": savgol_filter(y, WINDOW, ORDER), "v": v, "F": F}
    signals["d"] = d
    up, down = d > 0, d < 0
    X = np.column_stack([a, 1.0 * up, -1.0 * down, v * up, v * down])[keep]
    return Samples(signals, h, keep, X, F[keep])


def solved(X: Array, b: Array) -> Array:
    """Least squares with columns of unit size."""
    size = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(X / size, b, rcond=1e-10)[0] / size)


def rms(x: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(x**2)))


def levels(theta: Array) -> Karnopp:
    """The plain fit as a model, for the levels that effects ask for."""
    m, F_cp, F_cn, F_vp, F_vn = np.maximum(theta, 1e-3).tolist()
    return Karnopp(m, F_cp, F_cn, F_vp, F_vn, 0.0, 0.0, F_cp, -F_cn)


def grid(p: Param, effect: Effect, s: Samples) -> list[float]:
    """Values that a parameter is tried at, from its unit and the motion."""
    y, speed = s.signals["y"][s.keep], float(np.quantile(np.abs(s.signals["v"][s.keep]), 0.95))
    travel, middle = float(np.ptp(y)), 0.5 * float(np.max(y) + np.min(y))
    if p.name == "period":
        return [travel / k for k in np.arange(0.5, 16.0, 0.5)]
    if p.unit == "m/s":
        return [speed * k for k in (0.05, 0.1, 0.2, 0.4, 0.8)]
    if p.unit == "m":
        return [middle + np.sign(p.typical) * 0.5 * travel * k for k in (0.4, 0.6, 0.75, 0.9)]
    if p.unit == "s":
        if p.typical >= 1.0:
            return [5.0, 15.0, 45.0]
        return [0.002, 0.005, 0.01, 0.02, 0.05, 0.1]
    if p.name == "n":
        return [1.5, 2.0, 2.5, 3.0]
    return [p.typical * k for k in (0.1, 0.3, 1.0, 3.0, 10.0)]


def terms(library: Library, s: Samples) -> Iterator[Term]:
    """Every effect that the mechanical equation can show, at every place of its grid."""
    for key, effect in library.items():
        missing = bool(effect.signals) and not set(effect.signals) & set(s.signals)
        tautology = effect.acts != "force" and "F" in effect.depends_on
        if key in ABSORBED or effect.acts not in ACTS or missing or tautology:
            continue
        free = [p for p in effect.params if not p.linear and p.name != "asymmetry"]
        for values in product(*(grid(p, effect, s) for p in free)):
            yield Term(effect, dict(zip((p.name for p in free), values, strict=True)))


def columns(term: Term, s: Samples, nine: Karnopp) -> Array:
    """What the term adds to the force per unit of each of its linear parameters, (n, k)."""
    effect = term.effect
    units = [{k: float(k == name) for k in effect.linear} for name in effect.linear] or [{}]
    out = []
    for unit in units:
        x = contribution(effect, {**term.shape, **unit}, s.signals, s.h, nine)
        out.append(-x if effect.acts == "force" else s.signals["d"] * x)
    return np.column_stack(out)[s.keep]


def bic(X: Array, b: Array, count: int) -> float:
    """Bayes' criterion of a least-squares fit."""
    n = len(b)
    return n * float(np.log(np.mean((b - X @ solved(X, b)) ** 2))) + count * float(np.log(n))


@dataclass(frozen=True, eq=False)
class Task:
    """Both logs' samples, every term, and its columns in the training log."""

    train: Samples
    test: Samples
    nine: Karnopp
    terms: Sequence[Term]
    columns: Sequence[Array]

    def error(self, chosen: Sequence[Term]) -> float:
        """Held-out force error [N] of the plain model with these terms, all fitted in training."""
        parts = [
            (one, [columns(t, one, self.nine) for t in chosen]) for one in (self.train, self.test)
        ]
        (A, own), (B, other) = ((one, np.column_stack([one.X, *more])) for one, more in parts)
        return rms(B.F - other @ solved(own, A.F))


def stepwise(task: Task) -> Found:
    """Terms added one after the other as long as Bayes' criterion falls."""
    X, b = task.train.X, task.train.F
    count, chosen = X.shape[1], list[Term]()
    best = bic(X, b, count)
    while len(chosen) < MOST:
        taken = {term.effect.key for term in chosen}
        options = [
            (bic(np.column_stack([X, C]), b, count + term.count), i)
            for i, (term, C) in enumerate(zip(task.terms, task.columns, strict=True))
            if term.effect.key not in taken
        ]
        now, i = min(options)
        if now >= best:
            break
        best, count = now, count + task.terms[i].count
        chosen.append(task.terms[i])
        X = np.column_stack([X, task.columns[i]])
    return {"named": [term.effect.key for term in chosen], "after": task.error(chosen)}


@dataclass(frozen=True, eq=False)
class Dictionary:
    """All columns beside the plain model, of unit size, and the plain residual (train, test)."""

    keys: Sequence[str]
    A: Array
    r: Array
    B: Array
    q: Array


def dictionary(task: Task) -> Dictionary:
    """The columns freed of what the plain model explains by itself, in both logs alike; of columns
    that are nearly the same the first stays."""
    own, other = task.train, task.test
    A = np.column_stack(list(task.columns))
    B = np.column_stack([columns(term, other, task.nine) for term in task.terms])
    size = np.maximum(np.linalg.norm(own.X, axis=0), 1e-300)
    absorbed = np.linalg.lstsq(own.X / size, A, rcond=1e-10)[0] / size[:, np.newaxis]
    A, B = A - own.X @ absorbed, B - other.X @ absorbed
    theta = solved(own.X, own.F)
    spread = np.maximum(np.sqrt(np.mean(A**2, axis=0)), 1e-300)
    keys = [t.effect.key for t, C in zip(task.terms, task.columns, strict=True) for _ in C.T]
    return Dictionary(
        keys, A / spread, own.F - own.X @ theta, B / spread, other.F - other.X @ theta
    )


def sparse(found: Array, d: Dictionary) -> Found:
    """Names by the size of what their columns explain, and the held-out error."""
    whole = rms(d.A @ found)
    sizes = {}
    for key in dict.fromkeys(d.keys):
        at = np.flatnonzero([k == key for k in d.keys])
        sizes[key] = rms(d.A[:, at] @ found[at])
    order = sorted(sizes, key=lambda key: -sizes[key])
    named = [key for key in order if sizes[key] > TENTH * whole > 0.0]
    return {"named": named, "terms": int(np.count_nonzero(found)), "after": rms(d.q - d.B @ found)}


def lasso(task: Task) -> Found:
    """LASSO on the plain model's residual, its penalty by cross-validation over stretches."""
    model = importlib.import_module("sklearn.linear_model")
    folds = importlib.import_module("sklearn.model_selection").KFold(FOLDS)
    d = dictionary(task)
    fitted = model.LassoCV(cv=folds, fit_intercept=False, alphas=30, max_iter=2000).fit(d.A, d.r)
    return sparse(np.asarray(fitted.coef_, dtype=np.float64), d)


def sindy(task: Task) -> Found:
    """SINDy's thresholded least squares, its threshold by cross-validation over stretches."""
    optimizer = importlib.import_module("pysindy").STLSQ
    d = dictionary(task)
    size = rms(d.r)

    fold = np.arange(len(d.r)) * FOLDS // len(d.r)
    # A fold's triangle says as much as its rows, and there are fewer of it.
    parts = [triangle(d.A[fold == k], d.r[fold == k] / size) for k in range(FOLDS)]

    def fitted(threshold: float, folds: Sequence[int]) -> Array:
        A, b = (np.concatenate([parts[k][i] for k in folds]) for i in (0, 1))
        found = optimizer(threshold=threshold, alpha=0.05).fit(A, b)
        return np.asarray(found.coef_, dtype=np.float64).ravel()

    def left(threshold: float) -> float:
        trained = [fitted(threshold, [j for j in range(FOLDS) if j != k]) for k in range(FOLDS)]
        return sum(
            float(np.sum((b - A @ x) ** 2)) for (A, b), x in zip(parts, trained, strict=True)
        )

    best = min(THRESHOLDS, key=left)
    return sparse(size * fitted(best, range(FOLDS)), d)


def triangle(A: Array, b: Array) -> tuple[Array, Array]:
    """R (k, k) and Q' b (k,) of A = Q R: the same least squares as A and b."""
    Q, R = np.linalg.qr(A)
    return R, Q.T @ b


def gaussian_process(task: Task) -> Found:
    """A Gaussian process over place, speed and time on the plain model's residual."""
    process = importlib.import_module("sklearn.gaussian_process")
    kernels = importlib.import_module("sklearn.gaussian_process.kernels")
    own, other = task.train, task.test
    theta = solved(own.X, own.F)
    r, q = own.F - own.X @ theta, other.F - other.X @ theta
    Z, W = (np.column_stack([s.signals[k][s.keep] for k in FEATURES]) for s in (own, other))
    middle, spread = Z.mean(axis=0), Z.std(axis=0)
    few = np.linspace(0, len(r) - 1, min(POINTS, len(r))).astype(np.int64)
    kernel = 1.0 * kernels.RBF(np.ones(len(FEATURES)), (0.02, 1e3)) + kernels.WhiteKernel(0.1)
    size = max(rms(r), 1e-12)
    fitted = process.GaussianProcessRegressor(kernel).fit((Z[few] - middle) / spread, r[few] / size)
    predicted = size * np.asarray(fitted.predict((W - middle) / spread))
    scales = np.asarray(fitted.kernel_.k1.k2.length_scale)
    return {"signal": FEATURES[int(np.argmin(scales))], "after": rms(q - predicted)}


METHODS: Mapping[str, tuple[Callable[[Task], Found], str]] = {
    "stepwise BIC": (stepwise, "scipy"),
    "LASSO": (lasso, "sklearn"),
    "SINDy (STLSQ)": (sindy, "pysindy"),
    "Gaussian process": (gaussian_process, "sklearn"),
}


def baselines(train: Log, test: Log, library: Library) -> dict[str, Found]:
    """What each method names, and the held-out force error [N] before and after."""
    own, other = samples(train), samples(test)
    theta = solved(own.X, own.F)
    nine = levels(theta)
    every = list(terms(library, own))
    task = Task(own, other, nine, every, [columns(term, own, nine) for term in every])
    before = rms(other.F - other.X @ theta)
    out: dict[str, Found] = {}
    for name, (method, package) in METHODS.items():
        if importlib.util.find_spec(package) is None:
            out[name] = {"skipped": f"{package} is not installed"}
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of optimisers that have not converged
            out[name] = {"before": before, **method(task)}
    return out
