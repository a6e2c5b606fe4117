"""ARX: exact recovery, accuracy against rational arithmetic, streams, refusals, order choice."""

import tracemalloc
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from identification.arrays import Array
from identification.arx.model import (
    ArxModel,
    arx_of_factor,
    factor_of,
    fit_arx,
    one_step_errors,
    predict_one_step,
    simulate_arx,
    simulation_errors,
)
from identification.arx.order_selection import OrderRange, select_arx
from identification.arx.qr_factor import ArxAccumulator, Order
from identification.errors import BadLog, BadModel, NotIdentifiable, UserError

# The paper's RST model.
RST_A = [1.0, -2.142, 1.688, -0.5459]
RST_B = [0.0, 0.0, 0.0, 0.0001782, 0.0001322]
H = 0.01


def respond(
    A: list[float] | Array, B: list[float] | Array, n: int, noise: float, seed: int
) -> tuple[Array, Array]:
    """Input of random signs and the response of A y = B u + e."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], n)
    e = noise * rng.standard_normal(n)
    return u, np.asarray(lfilter(B, A, u) + lfilter([1.0], A, e))


def theta(model: ArxModel) -> Array:
    constant = [] if model.offset is None else [model.offset]
    return np.concatenate([constant, model.A[1:], model.B[model.nk :][: model.nb]])


def regressors(u: Array, y: Array, order: Order, offset: bool) -> tuple[Array, Array]:
    lag, n = order.lag, len(y)
    columns = [np.ones(n - lag)] if offset else []
    columns += [-y[lag - i : n - i] for i in range(1, order.na + 1)]
    columns += [u[lag - k : n - k] for k in range(order.nk, order.nk + order.nb)]
    return np.column_stack(columns), y[lag:]


def rational_solution(X: Array, target: Array) -> Array:
    """Least squares in exact rational arithmetic."""
    columns = [[int(Fraction(v) * 2**400) for v in c] for c in [*X.T, target]]
    size = X.shape[1]
    M = [
        [Fraction(sum(a * b for a, b in zip(left, right, strict=True))) for right in columns]
        for left in columns[:-1]
    ]
    for i in range(size):
        for k in range(i + 1, size):
            factor = M[k][i] / M[i][i]
            M[k] = [a - factor * b for a, b in zip(M[k], M[i], strict=True)]
    out = [Fraction(0)] * size
    for i in reversed(range(size)):
        out[i] = (M[i][size] - sum(M[i][j] * out[j] for j in range(i + 1, size))) / M[i][i]
    return np.array([float(v) for v in out])


def test_the_papers_model_comes_back_from_its_own_response() -> None:
    u, y = respond(RST_A, RST_B, 2000, 0.0, 1)
    model = fit_arx((u, y), 3, 2, 3, H)
    np.testing.assert_allclose(model.A, RST_A, rtol=1e-9)
    np.testing.assert_allclose(model.B, RST_B, rtol=1e-8)
    assert model.rows == 2000 - 4
    assert model.residual_rms < 1e-12 * np.std(y)


def test_intervals_cover_the_truth() -> None:
    true = np.array([*RST_A[1:], *RST_B[3:]])
    z = []
    for seed in range(200):
        model = fit_arx(respond(RST_A, RST_B, 1500, 1e-5, seed), 3, 2, 3, H)
        z.append((theta(model) - true) / np.sqrt(np.diagonal(model.covariance)))
        np.testing.assert_allclose(
            np.concatenate([model.sd_a, model.sd_b]) ** 2, np.diagonal(model.covariance)
        )
    covered = np.mean(np.abs(z) < 1.96, axis=0)
    assert np.all((covered >= 0.90) & (covered <= 0.99))


def test_covariance_is_that_of_many_estimates() -> None:
    models = [
        fit_arx(respond([1.0, -0.9], [0.0, 0.5], 300, 0.3, s), 1, 1, 1, H) for s in range(400)
    ]
    spread = np.cov(np.array([theta(model) for model in models]).T)
    np.testing.assert_allclose(spread, models[0].covariance, rtol=0.35, atol=2e-4)
    assert np.sign(spread[0, 1]) == np.sign(np.mean([m.covariance[0, 1] for m in models]))


Case = tuple[Array, Array, Order, bool]


def oversampled() -> Case:
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 30), 50)
    y = lfilter([1e-9, 1e-9], np.poly([0.999, 0.998, 0.9995]), u)
    return u, np.asarray(y + 1e-13 * rng.standard_normal(1500)), Order(3, 2, 1), False


def huge_offset() -> Case:
    u, y = respond(RST_A, RST_B, 1500, 1e-6, 3)
    return u + 1e3, y + 1e3, Order(3, 2, 3), True


def huge_offset_not_estimated() -> Case:
    return (*huge_offset()[:3], False)


def near_collinear_inputs() -> Case:
    rng = np.random.default_rng(4)
    u = np.sin(1e-3 * np.arange(1500.0)) + 1e-9 * rng.standard_normal(1500)
    y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 1e-9 * rng.standard_normal(1500)
    return u, np.asarray(y), Order(1, 3, 1), False


def too_high_an_order() -> Case:
    return (*respond(RST_A, RST_B, 1500, 1e-6, 5), Order(6, 6, 0), False)


def burst_at_the_end() -> Case:
    u, y = respond(RST_A, RST_B, 1500, 1e-6, 6)
    y[-1] += 1e4
    return u, y, Order(3, 2, 3), False


@pytest.mark.parametrize(
    "case",
    [
        oversampled,
        huge_offset,
        huge_offset_not_estimated,
        near_collinear_inputs,
        too_high_an_order,
        burst_at_the_end,
    ],
)
def test_ill_conditioned_logs_are_fitted_as_accurately_as_by_qr(case: Callable[[], Case]) -> None:
    u, y, order, offset = case()
    X, target = regressors(u, y, order, offset)
    scale = np.linalg.norm(X, axis=0)
    exact = rational_solution(X, target)
    size = np.linalg.norm(exact * scale)

    def error(found: Array) -> float:
        return float(np.linalg.norm((found - exact) * scale) / size)

    model = fit_arx((u, y), order.na, order.nb, order.nk, H, offset=offset)
    qr = np.linalg.lstsq(X / scale, target, rcond=None)[0] / scale
    # R itself is rounded to double, so the floor is that of any method that returns one.
    assert error(theta(model)) <= 4.0 * error(qr) + 2.0**-53 * model.condition
    plain = factor_of([(u, y)], order, exact=False)
    assert not plain.trusted(model.condition, model.residual_rms)
    normal = np.linalg.solve((X / scale).T @ (X / scale), (X / scale).T @ target) / scale
    if case is not burst_at_the_end:
        assert error(normal) > 100.0 * error(theta(model))


@given(st.integers(0, 10**6), st.floats(-7.0, 0.0), st.integers(0, 3), st.integers(0, 3))
@settings(max_examples=40, deadline=None)
def test_plain_products_are_trusted_only_where_harmless(
    seed: int, noise: float, more_na: int, more_nb: int
) -> None:
    log = respond(RST_A, RST_B, 9000, 1e-4 * 10.0**noise, seed)
    order = Order(2 + more_na, 1 + more_nb, 2)
    plain = factor_of([log], order, exact=False)
    exact = arx_of_factor(factor_of([log], order), order, H)
    if plain.trusted(exact.condition, exact.residual_rms):
        found = arx_of_factor(plain, order, H)
        assert found.noise_variance == pytest.approx(exact.noise_variance, rel=1e-4)
        scale = np.linalg.norm(regressors(*log, order, False)[0], axis=0)
        difference = np.linalg.norm((theta(found) - theta(exact)) * scale)
        assert difference <= 1e-8 * np.linalg.norm(theta(exact) * scale)


@given(
    st.lists(st.integers(0, 60), min_size=1, max_size=8),
    st.tuples(st.integers(0, 4), st.integers(0, 3), st.integers(0, 6)).filter(
        lambda o: o[0] + o[1]
    ),
    st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_chunks_give_what_the_whole_gives(
    cuts: list[int], order: tuple[int, int, int], exact: bool
) -> None:
    u, y = respond([1.0, -0.8], [0.0, 0.5, 0.2], 240, 0.1, 7)
    whole = ArxAccumulator(*order, exact=exact)
    whole.update(u, y)
    parts = ArxAccumulator(*order, exact=exact)
    bounds = [0, *np.cumsum(cuts).clip(0, 240).tolist(), 240]
    for start, end in pairwise(bounds):
        parts.update(u[start:end], y[start:end])
    assert parts.factor().rows == whole.factor().rows == 240 - Order(*order).lag
    np.testing.assert_allclose(parts.factor().R, whole.factor().R, rtol=1e-10, atol=1e-11)


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6), st.booleans())
@settings(max_examples=30, deadline=None)
def test_units_change_only_the_units(of_u: float, of_y: float, offset: bool) -> None:
    u, y = respond([1.0, -1.2, 0.5], [0.0, 0.3, 0.1], 400, 0.05, 8)
    y += 0.2
    base = fit_arx((u, y), 2, 2, 1, H, offset=offset)
    scaled = fit_arx((of_u * u, of_y * y), 2, 2, 1, H, offset=offset)
    np.testing.assert_allclose(scaled.A, base.A, rtol=1e-9)
    np.testing.assert_allclose(scaled.B * of_u / of_y, base.B, rtol=1e-8)
    np.testing.assert_allclose(scaled.sd_b * of_u / of_y, base.sd_b, rtol=1e-8)
    np.testing.assert_allclose(scaled.noise_variance / of_y**2, base.noise_variance, rtol=1e-8)


stable_pole = st.floats(-0.9, 0.9)


@given(
    st.lists(stable_pole, max_size=3),
    st.lists(st.floats(0.2, 2.0), min_size=1, max_size=3),
    st.integers(0, 4),
    st.integers(0, 1000),
)
@settings(max_examples=40, deadline=None)
def test_without_noise_any_model_comes_back(
    poles: list[float], b: list[float], nk: int, seed: int
) -> None:
    A, B = np.atleast_1d(np.poly(poles)), np.array([0.0] * nk + b)
    u = np.random.default_rng(seed).standard_normal(400)
    y = np.asarray(lfilter(B, A, u))
    try:
        model = fit_arx((u, y), len(poles), len(b), nk, H)
    except NotIdentifiable:
        return  # a pole on a zero
    if model.condition < 1e4:
        np.testing.assert_allclose(model.A, A, atol=1e-9)
        np.testing.assert_allclose(model.B, B, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("nk", [0, 1, 3, 12])
@pytest.mark.parametrize(("na", "nb"), [(0, 1), (0, 9), (1, 0), (2, 1), (3, 2), (9, 1), (5, 12)])
def test_any_order_is_the_same_regression_as_lstsq(na: int, nb: int, nk: int, exact: bool) -> None:
    u, y = respond([1.0, -0.5], [0.3, 0.5, 0.2], 9000, 0.5, 20 + nk)
    order = Order(na, nb, nk)
    for offset in (False, True):
        X, target = regressors(u, y + 0.3, order, offset)
        model = arx_of_factor(
            factor_of([(u, y + 0.3)], order, exact=exact), order, H, offset=offset
        )
        np.testing.assert_allclose(theta(model), np.linalg.lstsq(X, target)[0], atol=1e-11)
        assert len(model.B) == (nk + nb if nb else 1)


def test_several_runs_are_one_regression_without_the_joints() -> None:
    logs = [respond(RST_A, RST_B, n, 1e-5, n) for n in (700, 50, 900)]
    order = Order(3, 2, 3)
    pairs = [regressors(u, y, order, True) for u, y in logs]
    X, target = (np.concatenate(part) for part in zip(*pairs, strict=True))
    model = fit_arx(logs, 3, 2, 3, H, offset=True)
    assert model.rows == len(target)
    np.testing.assert_allclose(theta(model), np.linalg.lstsq(X, target)[0], rtol=1e-8, atol=1e-12)
    residual = target - X @ theta(model)
    np.testing.assert_allclose(model.residual_rms, np.sqrt(np.mean(residual**2)), rtol=1e-8)
    np.testing.assert_allclose(
        model.relative_error, np.sqrt(residual @ residual / np.sum((target - target.mean()) ** 2))
    )
    covariance = residual @ residual / (len(target) - 6) * np.linalg.inv(X.T @ X)
    np.testing.assert_allclose(model.covariance, covariance[1:, 1:], rtol=1e-6)
    assert model.sd_offset == pytest.approx(np.sqrt(covariance[0, 0]))


def test_other_types_and_strides_and_long_logs_give_the_same() -> None:
    u, y = respond([1.0, -0.9], [0.0, 0.5], 700_000, 0.1, 9)
    y = y.astype(np.float32).astype(np.float64)
    base = fit_arx((u, y), 1, 1, 1, H)
    both = np.column_stack([u, y])
    narrow: Any = (u.astype(np.int8), y.astype(np.float32))
    for log in ((both[:, 0], both[:, 1]), narrow):
        np.testing.assert_allclose(theta(fit_arx(log, 1, 1, 1, H)), theta(base), rtol=1e-12)
    X, target = regressors(u, y, Order(1, 1, 1), False)
    np.testing.assert_allclose(theta(base), np.linalg.lstsq(X, target)[0], rtol=1e-11)


@pytest.mark.parametrize("exact", [False, True])
def test_memory_does_not_grow_with_the_log(exact: bool) -> None:
    rng = np.random.default_rng(14)
    peaks = []
    for n in (600_000, 2_400_000):
        log = rng.standard_normal(n), rng.standard_normal(n)
        tracemalloc.start()
        factor_of([log], Order(3, 2, 3), exact=exact)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2 * peaks[0] + 200_000 < 5_000_000


def test_the_callers_arrays_stay_as_they_are() -> None:
    u, y = respond(RST_A, RST_B, 500, 1e-5, 10)
    before = u.copy(), y.copy()
    model = fit_arx((u, y), 3, 2, 3, H, offset=True)
    select_arx((u, y), None, H, orders=OrderRange(2, 2, 2))
    predict_one_step(model, u, y)
    simulate_arx(model, u, y[:10])
    np.testing.assert_array_equal(u, before[0])
    np.testing.assert_array_equal(y, before[1])
    assert u.flags.writeable and y.flags.writeable
    assert not model.A.flags.writeable


def test_prediction_and_simulation_follow_the_difference_equation() -> None:
    u, y = respond(RST_A, RST_B, 300, 1e-4, 11)
    model = fit_arx((u, y + 0.3), 3, 2, 3, H, offset=True)
    assert model.offset is not None
    predicted = predict_one_step(model, u, y)
    simulated = simulate_arx(model, u, y[:10])
    assert np.isnan(predicted[:4]).all()
    np.testing.assert_array_equal(simulated[:10], y[:10])
    for t in (4, 5, 77, 299):
        by_input = model.B[3] * u[t - 3] + model.B[4] * u[t - 4] + model.offset
        past = y[t - 3 : t][::-1]
        assert predicted[t] == pytest.approx(by_input - model.A[1:] @ past)
        if t >= 10:
            own = simulated[t - 3 : t][::-1]
            assert simulated[t] == pytest.approx(by_input - model.A[1:] @ own)
    np.testing.assert_allclose(one_step_errors(model, u, y), (y - predicted)[4:], atol=1e-12)
    np.testing.assert_allclose(
        simulation_errors(model, u, y), y[4:] - simulate_arx(model, u, y[:4])[4:]
    )
    at_rest = simulate_arx(fit_arx((u, y), 3, 2, 3, H), u)
    assert at_rest[0] == 0.0


def test_models_without_input_or_without_past_outputs() -> None:
    u, y = respond([1.0, -0.7], [0.0], 5000, 1.0, 12)
    series = fit_arx((u, y), 1, 0, 0, H)
    np.testing.assert_array_equal(series.B, [0.0])
    assert series.A[1] == pytest.approx(-0.7, abs=0.05)
    fir = fit_arx((u, lfilter([0.0, 2.0, 1.0], [1.0], u)), 0, 2, 1, H)
    np.testing.assert_allclose(fir.B, [0.0, 2.0, 1.0], atol=1e-12)
    np.testing.assert_array_equal(fir.A, [1.0])


ones, ramp = np.ones(100), np.arange(100.0)
u0, y0 = respond(RST_A, RST_B, 100, 1e-5, 13)
hole = y0.copy()
hole[17] = np.nan
early = y0.copy()
early[0] = np.inf


@pytest.mark.parametrize(
    ("log", "order", "kind", "words"),
    [
        ((u0, hole), (3, 2, 3), BadLog, "run 1: y is nan at sample 17"),
        ((early, y0), (3, 2, 3), BadLog, "run 1: u is inf at sample 0"),
        ((u0, y0[:-1]), (3, 2, 3), BadLog, "same n"),
        ((u0[:4], y0[:4]), (3, 2, 3), BadLog, "0 samples"),
        ((u0[:8], y0[:8]), (3, 2, 3), BadLog, "5 coefficients need"),
        ((1e200 * u0, y0), (3, 2, 3), BadLog, "overflow"),
        ((u0.astype(str), y0), (3, 2, 3), BadLog, "real numbers"),
        ([], (3, 2, 3), BadLog, "no run"),
        ([(u0, y0, y0)], (3, 2, 3), BadLog, "3 signals"),
        ((u0, y0), (-1, 2, 3), BadModel, "negative"),
        ((u0, y0), (0, 0, 3), BadModel, "at least 1"),
        ((ones, y0), (3, 2, 3), NotIdentifiable, r"u\(t-4\) is a combination"),
        ((0.0 * u0, y0), (3, 2, 3), NotIdentifiable, r"u\(t-3\) is zero"),
        ((u0, 0.0 * y0), (3, 2, 3), NotIdentifiable, r"y\(t-1\) is zero"),
        ((-0.5 * y0, y0), (2, 1, 1), NotIdentifiable, r"u\(t-1\) is a combination"),
        ((u0, ramp), (3, 2, 3), NotIdentifiable, r"y\(t-3\) is a combination"),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_one_line(
    log: tuple[Array, Array], order: tuple[int, int, int], kind: type[UserError], words: str
) -> None:
    with pytest.raises(kind, match=words) as refusal:
        fit_arx(log, *order, H)
    assert "\n" not in str(refusal.value)


def test_other_refusals() -> None:
    model = fit_arx((u0, y0), 3, 2, 3, H)
    with pytest.raises(BadModel, match="sampling period"):
        fit_arx((u0, y0), 3, 2, 3, 0.0)
    with pytest.raises(NotIdentifiable, match="combination"):
        fit_arx((u0, 5.0 * ones), 1, 1, 1, H, offset=True)
    with pytest.raises(BadLog, match="first outputs"):
        simulate_arx(model, u0, y0[:2])
    with pytest.raises(BadLog, match="same n above 4"):
        predict_one_step(model, u0, y0[:9])
    with pytest.raises(BadModel, match="split"):
        select_arx((u0, y0), None, H, split=1.0)
    with pytest.raises(BadModel, match="delays"):
        OrderRange(min_nk=3, max_nk=2)
    with pytest.raises(BadLog, match="validation samples"):
        select_arx((u0, y0), (u0[:20], y0[:20]), H)
    with pytest.raises(NotIdentifiable, match="zero"):
        select_arx((u0, 0.0 * y0), (u0, y0), H, orders=OrderRange(max_nb=0))
    second = ArxAccumulator(1, 1, 1)
    second.update(u0, y0)
    second.new_run()
    with pytest.raises(BadLog, match="run 2: y is nan at sample 17"):
        second.update(u0, hole)


def test_a_refused_chunk_leaves_no_trace() -> None:
    accumulator = ArxAccumulator(3, 2, 3)
    accumulator.update(u0[:50], y0[:50])
    with pytest.raises(BadLog):
        accumulator.update(u0, hole)
    accumulator.update(u0[50:], y0[50:])
    whole = factor_of([(u0, y0)], Order(3, 2, 3))
    np.testing.assert_allclose(accumulator.factor().R, whole.R, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-6, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("seed", range(5))
def test_the_papers_order_and_delay_are_found(noise: float, seed: int) -> None:
    log = respond(RST_A, RST_B, 4000, noise, seed)
    choice = select_arx(log, None, H)
    assert (choice.model.na, choice.model.nb, choice.model.nk) == (3, 2, 3)
    assert choice.model.rows < 0.6 * 4000
    held_out = [part[2400:] for part in log]
    errors = one_step_errors(choice.model, *held_out)[-choice.samples :]
    assert choice.one_step_rms == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-6)


def test_the_papers_order_without_noise_and_in_simulation() -> None:
    clean = select_arx(respond(RST_A, RST_B, 1500, 0.0, 3), None, H)
    assert (clean.model.na, clean.model.nb, clean.model.nk) == (3, 2, 3)
    u, y = respond(RST_A, RST_B, 6000, 0.0, 4)
    y = y + 1e-6 * np.random.default_rng(5).standard_normal(6000)
    free = select_arx((u, y), None, H, criterion="simulation")
    assert free.model.nk in (2, 3, 4)
    smallest = min(c.simulation_rms for c in free.best_of_size)
    assert free.simulation_rms <= 1.2 * smallest
    sizes = [candidate.size for candidate in free.best_of_size]
    assert sizes == sorted(set(sizes))


RANGES = ((0, 2), (1, 3), (1, 4), (0, 6))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_random_plants_are_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pairs, singles, nb, nk = (int(rng.integers(low, high)) for low, high in RANGES)
    poles = rng.uniform(0.4, 0.9, pairs) * np.exp(1j * rng.uniform(0.3, 2.0, pairs))
    A = np.real(np.poly([*poles, *poles.conj(), *rng.uniform(0.4, 0.9, singles)]))
    B = np.concatenate([np.zeros(nk), rng.choice([-1.0, 1.0], nb) * rng.uniform(0.5, 1.0, nb)])
    logs = [respond(A, B, 3000, 0.2, 100 + seed), respond(A, B, 2000, 0.2, 200 + seed)]
    choice = select_arx(logs, respond(A, B, 3000, 0.2, 300 + seed), H)
    assert (choice.model.na, choice.model.nb, choice.model.nk) == (len(A) - 1, nb, nk)
