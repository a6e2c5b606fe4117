"""Refinement on the free run: from a rough start to the parameters, without bending the good."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.gauss_newton import WIDE_STEP, Minimum, gauss_newton
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.windowed_run.parameters import (
    even,
    names_of,
    plant_with,
    units_in,
    values_of,
)
from identification.estimation.windowed_run.refinement import HaltedRefit, descended, refit
from identification.estimation.windowed_run.run_errors import mean_loss, misfit
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.progress import Halt
from identification.simulation.free_run import free_run
from tests.identification.motor_logs import NINE, made, plant, seen

SLIPPERY = Karnopp(0.045, 1.0, 1.0, 0.015, 0.015, 0.02, -0.02, 1.1, -1.1)
ROUGH = Karnopp.from_array(NINE.array * (1.0, 1.01, 0.99, 0.99, 1.01, 1.3, 0.7, 1.1, 0.92))


def test_a_rough_start_comes_to_the_true_parameters() -> None:
    one = seen(made(2))
    found = refit(replace(plant(), friction=ROUGH), [one], "command", prior={}, band=0.012)
    assert found.misfit < 1.05
    for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn", "F_sp", "F_sn", "dv_p", "dv_n"):
        assert getattr(found.plant.friction, name) == pytest.approx(
            getattr(NINE, name), rel=0.02 if name.startswith("dv") else 2e-3
        )


def test_a_rough_refinement_ends_where_it_cannot_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    one = seen(made(3, {"spring": {"k": 60.0}}))
    steps: list[float] = []

    def counted(
        fun: Any, x: Array, most: int, step: float = WIDE_STEP, *, reach: Any = np.inf,
        little: float = 0.0,
    ) -> Minimum:  # fmt: skip
        steps.append(little)
        return gauss_newton(fun, x, most, step, reach, little)

    monkeypatch.setattr("identification.estimation.windowed_run.refinement.gauss_newton", counted)
    whole = refit(plant(), [one], "command", prior={}, band=0.012)
    count = len(steps)
    rough = refit(plant(), [one], "command", prior={}, band=0.012, effort="rough")
    assert whole.misfit > 5.0 and rough.misfit < 1.1 * whole.misfit
    assert len(steps) - count < count and min(steps[count:]) > max(steps[:count])


@pytest.mark.slow
def test_effects_are_refined_with_the_nine() -> None:
    effects = {"spring": {"k": 60.0}}
    one = seen(made(3, effects))
    rough = replace(plant({"spring": {"k": 50.0}}), friction=ROUGH)
    found = refit(rough, [one], "command", prior={}, band=0.012)
    assert found.misfit < 1.1
    assert found.plant.effects[0].values["k"] == pytest.approx(60.0, rel=0.01)
    assert 0 < found.sd["spring.k"] < 1.0


@pytest.mark.parametrize(
    ("seed", "off"),
    [
        (2, (1.2, 1.1, 0.9, 0.9, 1.1, 0.3, 3.0, 1.4, 0.7)),
        (3, (1.0, 1.01, 0.99, 0.99, 1.01, 1.6, 0.5, 1.15, 0.9)),
        (4, (1.05, 1.05, 0.95, 0.9, 1.1, 2.0, 0.4, 1.3, 0.8)),
    ],
)
def test_a_motor_far_off_comes_to_its_parameters_through_windows_that_grow(
    seed: int, off: tuple[float, ...]
) -> None:
    one = seen(made(seed))
    begun = replace(plant(), friction=Karnopp.from_array(NINE.array * off))
    assert refit(begun, [one], "command", prior={}, effort="near").misfit > 10.0
    found = descended(begun, [one], "command")
    assert found.misfit < 1.05
    assert np.allclose(found.plant.friction.array, NINE.array, rtol=0.02)


def test_no_refined_body_lets_go_below_the_friction_with_which_it_slides() -> None:
    """Without a stick limit above it the run of such a log ends its rests too early or at once."""
    one = seen(made(3, friction=replace(NINE, F_sp=NINE.F_cp, F_sn=-NINE.F_cn)))
    begun = replace(plant(), friction=replace(NINE, F_sp=0.8 * NINE.F_cp, F_sn=-0.7 * NINE.F_cn))
    found = refit(begun, [one], "command", prior={}, effort="near").plant.friction
    assert found.F_sp >= found.F_cp and -found.F_sn >= found.F_cn
    assert found.F_sp == pytest.approx(NINE.F_cp, rel=0.02)
    assert found.F_sn == pytest.approx(-NINE.F_cn, rel=0.02)


def test_a_descent_that_is_halted_gives_what_it_has_come_to() -> None:
    one, asked = seen(made(2)), iter([True] * 200)
    halted = replace(one, halt=Halt(lambda: next(asked, False)))
    begun = replace(plant(), friction=ROUGH)
    with pytest.raises(HaltedRefit) as ended:
        descended(begun, [halted], "command")
    assert misfit(ended.value.plant, [one], "command") < misfit(begun, [one], "command")


@pytest.mark.method
@pytest.mark.parametrize("seed", [2, 3])
def test_windows_that_grow_lead_where_long_ones_lead_astray(seed: int) -> None:
    warm = {"a": 0.3, "b": 0.2, "tau": 6.0, "asymmetry": 0.1}
    one = seen(made(seed, {"warmup": warm}))
    rough = plant({"warmup": {"a": 0.25, "b": 0.1, "tau": 7.0}})
    off = NINE.array * (1.0, 1.01, 0.99, 0.99, 1.01, 1.15, 0.85, 1.05, 0.96)
    begun = replace(rough, friction=Karnopp.from_array(off))
    astray = refit(begun, [one], "command", prior=even(begun), effort="near")
    found = descended(begun, [one], "command")
    assert found.misfit < 1.1 < 5.0 < astray.misfit
    values = found.plant.effects[0].values
    assert values["asymmetry"] == pytest.approx(0.1, abs=2e-3)  # begun as none
    assert values["a"] == pytest.approx(0.3, rel=0.01)
    assert np.allclose(found.plant.friction.array, NINE.array, rtol=0.02)


@pytest.mark.slow
def test_a_shape_other_than_the_asymmetry_stays_at_its_default() -> None:
    one = seen(made(3, {"stribeck": {"F_s": 3.0, "v_s": 0.02}}))
    found = descended(plant({"stribeck": {"F_s": 2.5, "v_s": 0.025}}), [one], "command")
    assert found.misfit < 1.1
    assert found.plant.effects[0].values["delta"] == 2.0


def test_where_the_model_lacks_something_no_deviation_is_below_the_regressions() -> None:
    one = seen(made(3, {"cogging": {"a": 4.0, "b": 0.0, "period": 0.02}}))
    tight = {
        name: 1e-4 * abs(getattr(NINE, name)) for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn")
    }
    found = refit(plant(), [one], "command", prior=tight, band=0.01)
    assert found.misfit > 3.0
    assert all(found.sd[name] >= tight[name] for name in tight)


def test_a_search_never_makes_the_mass_vanish() -> None:
    started = Plant(NINE)
    names = ["m", "F_sn", "dv_p"]
    far = plant_with(started, names, np.array([-5.0, 3.0, -1.0]))
    assert far.friction.m > 0.01 * NINE.m
    assert far.friction.F_sn < 0 < far.friction.dv_p


def test_least_squares_of_a_curved_valley() -> None:
    def rosenbrock(x: Array) -> Array:
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    found = gauss_newton(rosenbrock, np.array([-1.2, 1.0]), 100)
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-4)
    assert found.covariance().shape == (2, 2) and found.mean < 1e-8


def test_breakaways_lost_by_chance_do_not_count() -> None:
    r = np.random.default_rng(8).standard_normal(20_000)
    window = np.arange(len(r)) // 1000
    assert mean_loss(r) == pytest.approx(1.0, abs=0.03)
    assert mean_loss(r, window) == pytest.approx(1.0, abs=0.06)
    r[window >= 17] += 100.0
    assert mean_loss(r) > 5.0
    assert mean_loss(r, window) == pytest.approx(1.0, abs=0.06)
    few = window >= 16  # a body that hardly moves is not followed by one that never does
    assert mean_loss(r, window, few) > 5.0
    r[window >= 15] += 100.0
    assert mean_loss(r, window) > 5.0


def test_a_size_of_none_is_changed_by_parts_of_a_typical_one() -> None:
    key = "pressure_dependent_friction"
    one = plant({key: {"mu_p": 3e-5, "mu_n": 0.0, "asymmetry": -0.1}})
    names = names_of(one, "command")
    units = dict(zip(names, units_in(one, names, values_of(one, names)).tolist(), strict=True))
    assert units["F_sn"] == 14.0
    assert units[f"{key}.mu_p"] == 3e-5
    assert units[f"{key}.mu_n"] == 2e-5
    assert units[f"{key}.asymmetry"] == 1.0


def test_a_reach_holds_what_least_squares_would_throw_far() -> None:
    def fun(x: Array) -> Array:
        return np.asarray(np.array([x[0] - 5.0, 0.1 * (x[1] - 1.0)]))

    assert gauss_newton(fun, np.zeros(2), 30).x == pytest.approx([5.0, 1.0], abs=1e-3)
    bounded = gauss_newton(fun, np.zeros(2), 30, reach=np.array([0.4, 2.0]))
    assert bounded.x == pytest.approx([0.4, 1.0], abs=1e-3)


def test_a_search_that_only_leads_on_ends_early() -> None:
    def valley(x: Array) -> Array:
        return np.array([1.0 - x[0], 10.0 * (x[1] - x[0] ** 2)])

    first = np.array([-1.2, 1.0])
    whole, early = gauss_newton(valley, first, 60), gauss_newton(valley, first, 60, little=0.5)
    assert whole.mean < 1e-3 * early.mean < 1e-3 * float(np.mean(valley(first) ** 2))


def swung(seed: int) -> Log:
    """A body of little viscous friction, swung by the sines of a measured force, noise 0.3 N."""
    rng, fine = np.random.default_rng(seed), 1e-3 * np.arange(3300, dtype=np.float64)
    waves = zip((3.0, 3.0, 2.0), (0.9, 1.7, 2.9), rng.uniform(0.0, 6.28, 3), strict=True)
    F = sum((a * np.sin(2 * np.pi * f * fine + p) for a, f, p in waves), np.zeros(len(fine)))
    blank = Log("swung", {"t": fine, "y": np.zeros(len(fine)), "F": F})
    y = free_run(Plant(SLIPPERY), blank, (0.0, 0.0, F[0]), "force").y[::10]
    y = y + 1e-3 * rng.standard_normal(len(y))
    F = F[::10] + 0.3 * rng.standard_normal(len(y))
    return Log("swung", {"t": fine[::10], "y": y, "F": F})


def test_beside_a_viscous_term_at_its_bound_the_coulomb_force_is_no_better_known() -> None:
    one = motion_log(swung(40), zoh=False, by_command=False)
    found = refit(Plant(SLIPPERY), [one], "force", prior={}, effort="near")
    assert found.plant.friction.F_vp < 2e-9 < 1e-3 < found.plant.friction.F_vn
    assert found.sd["F_cp"] > 0.7 * found.sd["F_cn"]
    assert abs(found.plant.friction.F_cp - SLIPPERY.F_cp) < 2.0 * found.sd["F_cp"]
