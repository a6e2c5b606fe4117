"""Is what a model leaves white, and free of the input? Correlations with their bands.

Bands are for independent samples. Correlated signals hold fewer of them than they have samples, so
the variance of each correlation is Bartlett's: of `r_eu`, `sum_k rho_e(k) rho_u(k) / n`; of `r_e`
beyond the lags where e may be coloured, `(1 + 2 sum rho_e^2) / n`. An oversampled log colours e
over the few samples that A(z^-1) spreads the sensor's noise over, and a test at these lags rejects
every model; `lag_step` looks past them, at lags of one plant sample instead of one logger sample.
On the fitted runs the fit has taken its share of `r_e`: its covariance there is that of Durbin.
Sources: Ljung, System Identification (1999), 16.6; Bartlett (1946); Ljung and Box (1978);
Durbin, Econometrica 38 (1970).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import chi2, norm

from identification.arrays import Array, IntArray, frozen
from identification.arx.model import ArxModel, Runs, as_runs, one_step_errors
from identification.errors import BadLog, BadModel

WHITE = float(norm.ppf(0.995))
SMALLEST_VARIANCE = 0.05


@dataclass(frozen=True)
class LagCorrelation:
    """Correlations at some lags, each with the half-width of its band.

    lags, rho, band: shape (m,). p_value: of the chi-square over the tested lags. independent:
    samples that the band counts.
    """

    lags: IntArray
    rho: Array
    band: Array
    p_value: float
    independent: float

    @property
    def outside(self) -> IntArray:
        """The lags whose correlation leaves its band."""
        return self.lags[np.abs(self.rho) > self.band]


@dataclass(frozen=True)
class ResidualTests:
    """Whiteness of a model's one-step errors and their correlation with the input.

    whiteness: at `lag_step`, 2 `lag_step`...; its chi-square over all. cross: e(t) with u(t-lag),
    lags -M to M (negative: feedback), its chi-square over 0 to M; None without input. level: of
    bands and verdicts.
    """

    whiteness: LagCorrelation
    cross: LagCorrelation | None
    level: float
    lag_step: int
    samples: int

    @property
    def white(self) -> bool:
        """Whether nothing speaks against white errors at this level."""
        return self.whiteness.p_value >= 1.0 - self.level

    @property
    def uncorrelated(self) -> bool:
        """Whether nothing speaks for a dependence on the input at this level."""
        return self.cross is None or self.cross.p_value >= 1.0 - self.level


def residual_tests(
    model: ArxModel,
    logs: Runs,
    *,
    max_lag: int = 25,
    lag_step: int | None = 1,
    level: float = 0.99,
    fitted: bool = True,
) -> ResidualTests:
    """Both tests on one run `(u, y)` or several.

    max_lag: number M of lags. lag_step: samples between tested lags of e; None takes a tenth of
    the time in which y decorrelates, or what the runs allow. fitted: the model was fitted on these
    runs, so part of the correlations was fitted away. Raises BadLog where the runs are too short.
    """
    runs = as_runs(logs)
    errors = [one_step_errors(model, u, y) for u, y in runs]
    inputs = [np.asarray(u, dtype=np.float64)[model.lag :] for u, _ in runs]
    if lag_step is None:
        longest = min(map(len, errors)) // (4 * max_lag)
        lag_step = max(1, min(plant_step([y for _, y in runs]), longest))
    return error_tests(
        errors,
        inputs,
        max_lag=max_lag,
        lag_step=lag_step,
        level=level,
        fitted=model if fitted else None,
    )


def error_tests(
    errors: Sequence[Array],
    inputs: Sequence[Array],
    *,
    max_lag: int = 25,
    lag_step: int = 1,
    level: float = 0.99,
    fitted: ArxModel | None = None,
) -> ResidualTests:
    """Both tests on errors of any model and the inputs at the same samples, run by run.

    fitted: the ARX model, if it was fitted on these very samples.
    """
    if max_lag < 1 or lag_step < 1 or not 0.0 < level < 1.0:
        raise BadModel(
            f"max_lag = {max_lag}, lag_step = {lag_step}, level = {level}; "
            "lags from 1, and a level between 0 and 1 needed"
        )
    if not errors:
        raise BadLog("no errors to test (0 runs found, at least 1 needed)")
    shortest = min(map(len, errors))
    needed = 4 * max_lag * lag_step
    if shortest < needed:
        raise BadLog(
            f"{shortest} errors in the shortest run; {max_lag} lags of {lag_step} samples need "
            f"{needed}: test fewer lags or use a longer log"
        )
    e, u = _centred(errors), _centred(inputs)
    samples = sum(map(len, e))
    far = max(2 * max_lag, max_lag * lag_step, min(shortest // 10, int(10 * samples**0.5)))
    rho_e = _autocorrelation(e, far)
    z = float(norm.ppf(0.5 + level / 2))
    taken = np.zeros((max_lag, max_lag))
    if fitted is not None and lag_step == 1:
        taken = _fitted_away(fitted, max_lag)
    white = _whiteness(rho_e, samples, lag_step, z, taken)
    moving = any(np.any(part) for part in u)
    known = fitted.nb if fitted is not None else 0
    cross = _cross(e, u, rho_e, samples, max_lag, z, known) if moving else None
    return ResidualTests(white, cross, level, lag_step, samples)


def effective_samples(signals: Sequence[Array]) -> float:
    """Independent samples in correlated ones: n over `1 + 2 sum rho(k)`, at most n.

    The sum ends at the first lag whose rho is within the 99 % band of white noise.
    """
    parts = _centred(signals)
    samples = sum(map(len, parts))
    rho = _autocorrelation(parts, max(min(map(len, parts)) // 4, 1))
    small = np.flatnonzero(np.abs(rho[1:]) < WHITE / np.sqrt(samples))
    end = int(small[0]) + 1 if len(small) else len(rho)
    return float(samples / max(1.0 + 2.0 * np.sum(rho[1:end]), 1.0))


def plant_step(outputs: Sequence[Array]) -> int:
    """Samples in a tenth of the time in which the output's correlation falls to 1/e, at least 1."""
    parts = _centred(outputs)
    rho = _autocorrelation(parts, max(min(map(len, parts)) // 4, 1))
    below = np.flatnonzero(rho < np.exp(-1.0))
    return max(1, (int(below[0]) if len(below) else len(rho)) // 10)


def _centred(signals: Sequence[Array]) -> list[Array]:
    mean = float(np.mean(np.concatenate(list(signals))))
    return [np.asarray(part, dtype=np.float64) - mean for part in signals]


def _products(a: Sequence[Array], b: Sequence[Array], far: int) -> Array:
    """Sums of a(t) b(t-k) within each run for k = -far..far, shape (2 far + 1,)."""
    total = np.zeros(2 * far + 1)
    for x, z in zip(a, b, strict=True):
        size = next_fast_len(len(x) + far, real=True)
        wrapped = irfft(rfft(x, size) * np.conj(rfft(z, size)), size)
        reach = min(far, len(x) - 1)
        total[far - reach : far + reach + 1] += np.roll(wrapped, reach)[: 2 * reach + 1]
    return total


def _autocorrelation(parts: Sequence[Array], far: int) -> Array:
    """rho(0..far), rho(0) = 1; zero beyond lag 0 for a signal that is zero."""
    sums = _products(parts, parts, far)[far:]
    if sums[0] <= 0.0:
        return np.eye(1, far + 1).ravel()
    return np.asarray(sums / sums[0], dtype=np.float64)


def _fitted_away(model: ArxModel, max_lag: int) -> Array:
    """What the fit takes from the covariance of `sqrt(n) rho_e` at lags 1..max_lag (Durbin)."""
    if model.na == 0:
        return np.zeros((max_lag, max_lag))
    impulse = lfilter([1.0], model.A, np.eye(1, max_lag)[0])
    H = toeplitz(impulse, np.zeros(model.na))
    covariance = model.covariance[: model.na, : model.na]
    return np.asarray(model.rows * (H @ covariance @ H.T), dtype=np.float64)


def _whiteness(rho: Array, samples: int, step: int, z: float, taken: Array) -> LagCorrelation:
    lags = step * np.arange(1, len(taken) + 1)
    independent = samples / (1.0 + 2.0 * float(np.sum(rho[1:step] ** 2)))
    shrink = np.sqrt((samples - lags) / (samples + 2.0))
    covariance = np.eye(len(taken)) - taken
    variance = np.maximum(np.diagonal(covariance), 0.0)
    return LagCorrelation(
        lags=lags.astype(np.int64),
        rho=frozen(rho[lags]),
        band=frozen(z * shrink * np.sqrt(variance / independent)),
        p_value=_chi_square(np.sqrt(independent) * rho[lags] / shrink, covariance, 0.05, 0),
        independent=independent,
    )


def _chi_square(values: Array, covariance: Array, smallest: float, known: int) -> float:
    """P-value of correlated normal values, without the directions of too small a variance."""
    sizes, directions = np.linalg.eigh(covariance)
    used = sizes > smallest * sizes[-1]
    statistic = float(np.sum((directions.T @ values)[used] ** 2 / sizes[used]))
    return float(chi2.sf(statistic, max(int(np.sum(used)) - known, 1)))


def _cross(
    e: Sequence[Array],
    u: Sequence[Array],
    rho_e: Array,
    samples: int,
    max_lag: int,
    z: float,
    known: int,
) -> LagCorrelation:
    far = len(rho_e) - 1
    energy = sum(float(x @ x) for x in e) * sum(float(x @ x) for x in u)
    centre = slice(far - max_lag, far + max_lag + 1)
    rho = (
        _products(e, u, far)[centre] / np.sqrt(energy) if energy > 0 else np.zeros(2 * max_lag + 1)
    )
    # Correlations of e inside the band of white noise are noise: adding them would only spread P.
    kept = np.where(np.abs(rho_e) > WHITE / np.sqrt(samples), rho_e, 0.0)
    rho_u = _autocorrelation(u, far)
    both_e = np.concatenate([kept[:0:-1], kept])
    both_u = np.concatenate([rho_u[:0:-1], rho_u])
    spread = np.array([np.sum(both_e[m:] * both_u[: len(both_u) - m]) for m in range(max_lag + 1)])
    spread[0] = max(spread[0], SMALLEST_VARIANCE)
    lags = np.arange(-max_lag, max_lag + 1)
    shrink = (samples - np.abs(lags)) / samples
    causal = np.sqrt(samples) * rho[max_lag:]
    return LagCorrelation(
        lags=lags.astype(np.int64),
        rho=frozen(rho),
        band=frozen(z * np.sqrt(spread[0] * shrink / samples)),
        p_value=_chi_square(causal, toeplitz(spread), 1e-3, known),
        independent=samples / float(spread[0]),
    )
