"""What each number of `identification.thresholds` decides, a little below it and a little above.

A statistic at four fifths and one at five quarters of a number: halved or doubled, the number lets
one of the two fall on the wrong side. The numbers are written out here, so that one which has
slipped shows.
"""

import ast
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from identification import thresholds
from identification.arrays import Array, IntArray
from identification.drift.drift_test import DriftSettings, too_coarse
from identification.drift.log_estimate import allowed_misfit
from identification.drift.own_logs import OwnMisfit
from identification.drift.practical_margin import Change
from identification.drift.reference_model import ReferenceModel
from identification.drift.single_log import detectable_together
from identification.effects._base import Param
from identification.effects._library import built_in
from identification.errors import BadSpecification
from identification.estimation.axis_equation import slides_enough
from identification.estimation.converged_fit import is_adequate
from identification.estimation.estimates import Events, estimates
from identification.estimation.fit import leaves_much
from identification.estimation.gauss_newton import Minimum
from identification.estimation.latent_force import rubs
from identification.estimation.prescribed_motion import is_unexplained
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regressed_plant import inertia_is_lost
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    FIVE,
    MECHANICAL,
    MotionLog,
)
from identification.estimation.regression.force_terms import predicts_as_much
from identification.estimation.regression.intersample_command import significant_share
from identification.estimation.regression.row_fit import RowFit, rough
from identification.estimation.regression.weighted_rows import Fitted, Rows
from identification.estimation.run_or_equation import LeftOfEquation, is_no_run
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.surroundings import (
    apart,
    explains,
    explains_most,
    is_likelier,
    larger_than_friction,
    stands_out,
)
from identification.estimation.turn_orders import are_most, is_significant, turns
from identification.estimation.two_masses import are_two, shows_a_load
from identification.estimation.windowed_run.run_errors import mean_loss
from identification.estimation.windowed_run.windows import Freed, Starts
from identification.experiment import identifiability
from identification.experiment.information import Information
from identification.frequency.estimate import Response, is_apart
from identification.frequency.modes import explains_more, fit_modes, is_deep, is_large
from identification.frequency.stretches import bands
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.signals.clock_jitter import jitters
from identification.signals.force_random_walk import shows
from identification.signals.frozen import frozen
from identification.signals.one_way import is_one_way
from identification.signals.steps import (
    jump_size,
    outstanding,
    small_spikes,
    steps_between,
    white_noise,
)
from identification.thresholds import FAULT_FROM
from identification.tracing.dependence import dependence
from identification.tracing.free_run.backward_elimination import (
    Setting,
    earned,
    enough,
    equations_explained,
    followed_up_to,
)
from identification.tracing.free_run.forward_selection import decisive
from identification.tracing.levels_refitted import explains_the_change, follows_worse
from identification.tracing.model_errors import OnTest, lacks, share_left
from identification.tracing.parameter_drift import changes
from identification.tracing.predictive_check import is_worse
from identification.tracing.recorded_rows import without_speed_effects
from identification.tracing.regression.candidates import EffectCandidate, shaped
from identification.tracing.regression.significance import chance, is_chance
from identification.tracing.regression.stepwise import (
    Choice,
    Step,
    equal_rivals,
    material,
    merit,
)
from identification.tracing.result import Errors
from identification.tracing.verdict import explains_most as explains_most_of_it
from tests.identification.motor_logs import K_A, NOISE, H, made, plant, seen
from tests.identification.tracing.settings import setting_of

N = 100  # rows
NONE = np.zeros(1)
BEGUN = Starts(np.array([0]), NONE, NONE, NONE, np.zeros((3, 1)))
FREE = Freed(BEGUN, np.ones((1, 1)), np.zeros((3, 1, 1)), np.eye(3)[np.newaxis])


@cache
def log() -> MotionLog:
    """A motor's log of 4 s, to and fro at up to 60 mm/s."""
    t = H * np.arange(2000.0)
    y = 0.01 * np.sin(2.0 * np.pi * t) + NOISE * np.random.default_rng(0).standard_normal(2000)
    u = np.cos(2.0 * np.pi * t)
    return seen(Log("to and fro", {"t": t, "y": y, "u": u, "F": K_A * u}))


def signs(n: int = N) -> Array:
    """Alternately 1 and -1, (n,)."""
    return np.resize([1.0, -1.0], n)


def rows_of(X: Array, b: Array | None = None) -> Rows:
    """Rows of noise 1, all of them fast enough to count."""
    n, k = X.shape
    right = np.zeros(n) if b is None else b
    block = np.zeros(n, dtype=np.int64)
    return Rows(right, X, np.ones(n), block, np.ones(n), FIVE[:k])


def leaving(square: float, *, robust: bool = False, criterion: float = 0.0) -> RowFit:
    """An equation that leaves this mean square, in units of the noise."""
    size = np.sqrt(0.455 * square if robust else square)
    fit = Fitted(np.zeros(1), size * signs(), N * square)
    return RowFit(rows_of(np.zeros((N, 1))), fit, criterion, 0.0, robust)


def stage(*, prescribed: bool = False, coulomb: float = 10.0) -> EffectRows:
    """A plant of this Coulomb level [N] in either direction."""
    theta = np.array([1.0, coulomb, coulomb, 0.0, 0.0])
    return EffectRows((replace(log(), prescribed=prescribed),), theta, np.zeros(3), False)


def candidate(key: str, gain: float = 0.0, **outcomes: RowFit) -> EffectCandidate:
    """An effect of the library that gains so much."""
    effect = built_in()[key]
    return EffectCandidate(effect, {p.name: p.typical for p in effect.params}, outcomes, gain)


def choice(*keys: str, first: float = 1.0, base: float = 1.0) -> Choice:
    """Effects taken; first, base: what sliding leaves without them and with them."""
    before, after = {MECHANICAL: leaving(first)}, {MECHANICAL: leaving(base)}
    steps = tuple(Step(candidate(key), 0.001, (), stage(), before) for key in keys)
    return Choice(stage(), before, steps, stage(), after)


def run(misfit: float, *, prescribed: bool = False) -> FittedStructure:
    """A plant of which the free run leaves this."""
    return FittedStructure(stage(prescribed=prescribed), {}, plant(), {}, prescribed, misfit)


def setting(plain: float, *, first: float = 1.0) -> Setting:
    """A trace of which the plain run, and its equation of sliding, leave this."""
    model = replace(run(plain), outcomes={MECHANICAL: leaving(first)})
    return setting_of([log()], model, {}, np.random.default_rng(0))


FLOOR = Errors(1.0, None, None, None)  # of the sensors


def left_of(force: float) -> OnTest:
    """What a model leaves of the test logs' force [N], without a run."""
    return OnTest(Errors(force, None, None, None), None)


def followed(misfit: float) -> OnTest:
    """What a model's run leaves of the test logs."""
    return OnTest(Errors(None, None, None, None), misfit)


def test_complete() -> None:
    """A run that hardly leaves more than noise may do so with one effect alone; beside others it
    is not followed yet."""
    assert followed_up_to(choice("spring"), setting(41.0), False) == pytest.approx(1.1, abs=0.02)
    assert not lacks(run(1.08), left_of(9.0).errors, FLOOR)
    assert lacks(run(1.12), left_of(9.0).errors, FLOOR)


def test_adequate() -> None:
    """A fit that leaves little more than noise is called adequate, and its run followed; an error
    on the test logs is spoken of from there."""
    assert is_adequate(1.2) and not is_adequate(1.9)
    found = Minimum(lambda x: x, np.zeros(1), 1.2)
    assert found.followed and not replace(found, mean=1.9).followed
    assert share_left(followed(1.2), followed(1.1), FLOOR) == 0.0
    assert share_left(followed(1.9), followed(1.45), FLOOR) == pytest.approx(0.5)
    # A prescribed motion lacks what its force says, a free one what its run says.
    prescribed = run(np.inf, prescribed=True)
    assert not lacks(prescribed, left_of(1.09).errors, FLOOR)
    assert lacks(prescribed, left_of(1.38).errors, FLOOR)
    assert not lacks(run(1.2), left_of(1.38).errors, FLOOR)


def test_astray() -> None:
    """Something is missing from an equation that leaves this; a model that left noise may leave so
    much of the next log."""
    assert not lacks(run(1.2), left_of(np.sqrt(2.4)).errors, FLOOR)
    assert lacks(run(1.2), left_of(np.sqrt(3.75)).errors, FLOOR)
    assert equations_explained({MECHANICAL: leaving(2.4)})
    assert not equations_explained({MECHANICAL: leaving(3.75)})
    assert not equations_explained({MECHANICAL: leaving(1.0), ACTUATOR: leaving(3.75)})

    def follows(left: float) -> bool:
        return left <= allowed_misfit(2.0)

    assert follows(4.8) and not follows(7.5)


def test_hopeless_for_effects_and_actuators() -> None:
    """However much was missing, an effect that only the run shows leaves no more; a linear actuator
    that leaves more of the force, in units of the noise, is none."""
    assert 20.0 < decisive(1001.0, ()) < 31.0
    assert not leaves_much(0.1, 4.5) and leaves_much(0.1, 5.6)


def test_hopeless() -> None:
    """A run by the measured force that leaves this is given up for the force equation, and an
    equation that does is that of a machine which no model follows."""
    assert not is_no_run(20.0) and is_no_run(31.0)
    assert not rough({MECHANICAL: leaving(20.0)}) and rough({MECHANICAL: leaving(31.0)})
    misfit = OwnMisfit(1.0, np.zeros(1), 3, 20.0)
    assert not misfit.has_lost_its_way(20.0 * 20.0) and misfit.has_lost_its_way(31.0 * 20.0)


def test_twice_what_is_left() -> None:
    """Inertia shows beside what is left, or it does not and the motion counts as prescribed."""

    def of(inertia: float) -> RowFit:
        fit = Fitted(np.array([inertia]), signs(), 0.0)
        return RowFit(rows_of(signs()[:, np.newaxis]), fit, 0.0, 0.0)

    assert inertia_is_lost(of(1.6))
    assert not inertia_is_lost(of(2.5))


def test_penalty() -> None:
    """A spring has two parameters, stiffness and its cube: each has to gain that much, and a
    rival that gains hardly less explains as much."""
    assert merit(candidate("spring", 16.0)) < 0.0 < merit(candidate("spring", 25.0))
    assert rivals(200.0, 208.0) == 1 and rivals(200.0, 212.5) == 0
    # A spring, in the place of gravity, has to be so much likelier.
    assert is_likelier(1.0, 1.0125, 1000.0) and not is_likelier(1.0, 1.008, 1000.0)
    # A mode has three, and sixteen neighbouring points count as one.
    assert explains_more(100.0 + 600.0, 100.0, 1000)
    assert not explains_more(100.0 + 380.0, 100.0, 1000)
    # An exponent leaves its default only where the log calls for another one.
    free = [Param("delta", "1", 0.5, 4.0, 2.0, "exponent", default=2.0)]

    def found(gain: float) -> float:
        """The exponent that is chosen, where 1 gains so much over 2."""
        best = shaped(free, [(0.5, 4.0)], {"delta": 2.0}, lambda x: gain * (x["delta"] - 1.0) ** 2)
        return best["delta"]

    assert found(8.0) == 2.0
    assert found(12.5) == pytest.approx(1.0, abs=0.1)


def test_beyond_chance() -> None:
    """So many deviations a size is from 0 that is no chance, though many are tried; the square of
    it a criterion gains."""
    assert not stands_out(4.0, 1.0) and not stands_out(-4.0, 1.0)
    assert stands_out(6.25, 1.0) and stands_out(-6.25, 1.0)
    assert is_significant(0.63, 0.1) and not is_significant(0.4, 0.1)
    assert not shows(20.0) and shows(31.0)
    assert significant_share(0.4, 0.1, 1.0) == 0.0 and significant_share(0.4, 0.064, 1.0) == 0.4
    # Nor may one be cut to the largest that is so unsure: leakage made a share of 3.3.
    assert significant_share(3.3, 0.5, 1.0) == 0.0
    # A change of 20 or 31 by the rows, of which 2.5 count as one.
    assert not drifted(np.sqrt(0.5), 100) and drifted(np.sqrt(0.5), 156)


def test_chance_level() -> None:
    """A gain of so small a chance is no chance, of an effect and of a parameter that has
    drifted."""
    assert not is_chance(0.008)
    assert is_chance(0.0125)
    # The second of two: chances of 0.4 % and 0.7 %, half of the level for each of them.
    both = Change(("m", "F_cp"), np.array([9.0, 2.9]), np.eye(2), 0.0)
    assert both.moved() == (0, 1)
    assert replace(both, change=np.array([9.0, 2.7])).moved() == (0,)


def test_twice_the_gain_of_columns() -> None:
    """By chance a search over shapes finds more than columns at one place, which gain 4 here."""
    at_one_row = np.zeros((40, 1))
    at_one_row[0] = 1.0
    after = RowFit(rows_of(at_one_row), Fitted(np.zeros(1), 2.0 * signs(40), 0.0), 0.0, 0.0)
    before = replace(after, rows=rows_of(np.zeros((40, 0))))

    def p_value(gain: float) -> float:
        one = candidate("spring", gain, mechanical=after)
        return chance(one, [], stage(), {MECHANICAL: before}, np.random.default_rng(0))

    assert p_value(6.4) == 1.0
    assert p_value(10.0) < 0.005


def test_material() -> None:
    """What adds less than this share of the Coulomb level, here 10 N, is not reported."""

    def matters(size: float, share: float = 1.0) -> bool:
        before = leaving(4.0)
        acts = np.arange(len(signs())) < share * len(signs())
        less = replace(before.fit, residual=before.fit.residual - size * acts * signs())
        one = candidate("spring", mechanical=replace(before, fit=less))
        return material(one, stage(coulomb=10.0), {MECHANICAL: before})

    assert not matters(0.08)
    assert matters(0.125)
    # What acts at one end of the stroke alone counts as it is there.
    assert matters(0.125, 0.05) and not matters(0.08, 0.05)
    # Nor does a change by this share of a parameter's value, or what a run leaves beyond the
    # equation where friction would hardly feel it.
    assert not drifted(0.8, 2000, level=100.0) and drifted(1.25, 2000, level=100.0)
    assert LeftOfEquation(0.015, 0.009, 1.0).is_material(1.0)
    assert not LeftOfEquation(0.015, 0.0128, 1.0).is_material(1.0)
    # Nor is a share of the command's step that explains next to nothing.
    assert (
        significant_share(0.3, 0.01, 0.008) == 0.0 and significant_share(0.3, 0.01, 0.0125) == 0.3
    )
    # What is beyond half a step is no more to it, where half explains all but this of the square.
    assert significant_share(0.54, 0.005, 0.9) == 0.5 and significant_share(0.57, 0.005, 0.9) == 0.0


def rivals(gain: float, mine: float) -> int:
    """Rivals of equal worth, where one gains so much and the effect taken `mine`, of 400."""
    base = {MECHANICAL: leaving(5.0, criterion=500.0)}
    rival, own = (candidate("spring", x, mechanical=leaving(1.0)) for x in (gain, mine))
    return len(equal_rivals(Step(own, 0.001, (rival,), stage(), base)))


def test_earns() -> None:
    """Whatever joins a model takes its part of what was missing: an effect of a run's 10 or of the
    criterion's 400, gravity or a lag of the equation's square, other levels of a day's error."""
    assert 1.0 + 6.4 < earned(11.0) < 1.0 + 10.0
    assert rivals(64.0, 64.0) == 0 and rivals(100.0, 100.0) == 1
    assert explains(1.0, 0.64) and not explains(1.0, 0.99)
    assert explains_the_change(1.6, 1.25, 1.0) and not explains_the_change(1.6, 1.3, 1.0)


def test_half() -> None:
    """Half of what was missing, left by what is reported first, by orders of a turn, by a lag that
    no run shows, by an effect that the run alone shows; half of the force, left by no model."""
    assert explains_most_of_it(0.4) and not explains_most_of_it(0.625)
    assert are_most(2.0, 0.9) and not are_most(2.0, 1.1)
    assert explains_most(1.0, 0.45) and not explains_most(1.0, 0.55)
    assert 1.0 + 0.24 < decisive(1.6, ()) < 1.0 + 0.375
    assert not is_unexplained(0.4) and is_unexplained(0.625)


def test_far_less() -> None:
    """Two masses explain what one body leaves where they leave hardly a third."""
    assert are_two(2.0, 0.5) and not are_two(2.0, 0.7)


def test_of_account_to_a_run() -> None:
    """Where much is left, an effect is taken that leaves far less than any other, of 20 here; and
    a run that leaves so little of what it lacked, 40, is not contested."""
    assert 1.0 + 1.6 < decisive(21.0, ()) < 1.0 + 2.5
    assert 1.0 + 3.2 < enough(setting(41.0), choice("spring").steps) < 1.0 + 5.0


def test_twice() -> None:
    """A run follows other logs as usual up to so many times its usual error."""
    assert follows_worse(2.5, 1.0) and not follows_worse(1.6, 1.0)


def test_worse_by_hardly_anything() -> None:
    """Fewer terms of friction that leave hardly more; two frequencies hardly apart."""
    assert shows_a_load(1.06, 1.0) and not shows_a_load(1.04, 1.0)
    assert predicts_as_much(1.04, 1.0) and not predicts_as_much(1.06, 1.0)


def test_worse() -> None:
    """So many times the error of the equation of motion, or of the plain model, is clearly worse;
    and so many times less is clearly better."""
    assert not LeftOfEquation(1.04, 1.0, 9.0).surer and not LeftOfEquation(0.6, 1.0, 9.0).surer
    assert LeftOfEquation(1.06, 1.0, 9.0).surer
    assert not is_worse(10.0, 10.3) and is_worse(10.0, 10.8)
    assert not is_worse(1.0, 1.4)  # both are noise


def test_of_account() -> None:
    """A rest of which a signal explains this little depends on none; a change that takes away so
    little of the error is none, however sure."""
    valve = np.repeat(signs(48), 10)

    def named(share: float) -> tuple[str, ...]:
        """On what a rest depends, of which a valve's two states explain this share."""
        r = np.sqrt(share) * valve + np.sqrt(1.0 - share) * signs(480)
        found = dependence(r, {"valve": valve}, valve < 2.0, np.arange(480) // 60)
        assert found.explained == pytest.approx(share, rel=0.01)
        return found.depends_on

    assert named(0.08) == () and named(0.125) == ("valve",)
    assert not drifted(np.sqrt(0.08 / 0.92), 2000) and drifted(np.sqrt(0.125 / 0.875), 2000)


def drifted(change: float, n: int, level: float = 10.0) -> bool:
    """Whether a friction of this level [N] has changed by so much, in n rows of noise 1 N."""
    X = np.ones((n, 1))
    before = RowFit(rows_of(X), Fitted(np.array([level]), signs(n), float(n)), 0.0, 0.0)
    after = rows_of(X, level + change + signs(n))
    return bool(changes(before, after, np.ones(n, dtype=np.bool_), FIVE[:1], np.zeros(1)))


def identifiable(name: str, relative: float, events: int) -> bool:
    """Whether a value is given of this deviation and so many breakaways and crossings."""
    happened = Events((events, 9), (events, 9), (900, 900), (1.0, 1.0))
    found = estimates({name: 10.0}, {name: 10.0 * relative}, happened, Rig("force"), "log")
    return found[name].value is not None


def says_none(size: float, settings: DriftSettings) -> bool:
    """Whether a log without an alarm is said to show no drift, that sees so much of F_cp."""
    nine = Karnopp(2.0, 10.0, 10.0, 100.0, 100.0, 0.01, -0.01, 15.0, -15.0)
    known = ReferenceModel(
        Plant(nine), ("F_cp",), np.array([10.0]), np.eye(1), Rig("force"), "force"
    )
    return not too_coarse(known, {"F_cp": size}, "log", settings)


def test_seen() -> None:
    """A log that would have shown so small a change of the Coulomb level shows that there is none.

    One that would not judges nothing.
    """
    for margin in (0.0, 0.02, 0.08):
        assert says_none(margin + 0.06, DriftSettings(margin=margin))
        assert not says_none(margin + 0.1, DriftSettings(margin=margin))


def test_nearly_all() -> None:
    """Of the smallest change that a test sees, nine in ten are found."""
    size = float(detectable_together(Change(("F_cp",), np.zeros(1), np.eye(1), 0.0), 9.0)[0])
    assert norm.sf(3.0 - size) == pytest.approx(0.9, abs=0.005)


@pytest.mark.parametrize("name", ["F_sp", "dv_p"])
def test_events_needed(name: str) -> None:
    """Fewer breakaways tell no stick limit, and fewer crossings no band."""
    assert not identifiable(name, 0.01, 2)
    assert identifiable(name, 0.01, 3)


def test_events_needed_over_frequency() -> None:
    """Full coherence of fewer averages is chance, and fewer stretches are none; a response of fewer
    points that count by themselves is no ground to say that there are no modes."""
    assert response_of(0.999, 3.8).seen[0] and not response_of(0.999, 2.4).seen[0]
    assert bands([5.0, 5.0], [1e-3, 1e-3], 3.0)
    with pytest.raises(BadSpecification, match=r"2 in .* at least 3 needed"):
        bands([3.0], [1e-3], 3.0)
    for points, shown in ((38, False), (60, True)):
        one = np.ones(points)
        found = Response(
            np.linspace(1.0, 20.0, points), one.astype(np.complex128), 0.99 * one, 50.0 * one
        )
        assert (fit_modes(found) is not None) is shown


def test_half_of_a_value() -> None:
    """A value with an interval wider than itself is not given."""
    assert identifiable("F_sp", 0.204, 9)
    assert not identifiable("F_sp", 0.319, 9)


def test_fourfold() -> None:
    """Strokes of a rig at much the same speed tell no friction of speed alone."""
    library = {"stribeck": built_in()["stribeck"]}

    def tried(ratio: float) -> bool:
        speed = np.repeat([1.0, ratio], 40)
        rig = replace(log(), speed=speed, up=signs(80) > 0, prescribed=True)
        return bool(without_speed_effects(library, [rig])[0])

    assert not tried(3.2)
    assert tried(5.0)


def test_material_to_an_actuator() -> None:
    """One that leaves a negligible part of the force is one, however little noise there is."""
    assert not leaves_much(0.008, 100.0)
    assert leaves_much(0.0125, 100.0)


def test_half_the_noise() -> None:
    """A clock's jitter counts where it makes the position noisier than its sensor."""
    assert not jitters(0.4)
    assert jitters(0.625)


def smooth(size: float, at: int, length: int) -> Array:
    """A motion behind a sensor of noise 1, off by this much from a sample on."""
    t = np.arange(4000.0)
    y = 200.0 * np.sin(2.0 * np.pi * t / 4000.0)
    y += np.random.default_rng(1).standard_normal(4000)
    y[at : at + length] += size
    return y


def test_fault_from() -> None:
    """A position that steps by so many deviations has jumped; a sample that is so far from its
    neighbours is no sample of the body."""

    def jumps(size: float) -> bool:
        y = smooth(0.0, 0, 0)
        y[2000:] += size - jump_size(y, 1999)  # by the widest lines, of which noise has its part
        return bool(len(outstanding(steps_between(y), FAULT_FROM * white_noise(y))))

    assert not jumps(6.5)
    assert jumps(12.5)
    assert not np.any(small_spikes(smooth(7.0, 2000, 1)))
    assert np.any(small_spikes(smooth(13.0, 2000, 1)))


def test_many_of_a_kind_in_a_row() -> None:
    """A value that a noisy signal repeats so many times stands still."""

    def found(length: int) -> bool:
        y = smooth(0.0, 0, 0)
        y[2000 : 2000 + length] = y[2000]
        return bool(np.any(frozen(y)))

    assert not found(6)
    assert found(10)


def test_gate_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    """So many times the information's deviation is what a log is said to tell a parameter by."""

    def can(relative: float) -> bool:
        identifiable = Information(("m", "F_cp"), np.diag(1.0 / np.array([relative, 1e-6]) ** 2))
        monkeypatch.setattr(identifiability, "judge", lambda *_a: None)
        monkeypatch.setattr(identifiability, "information", lambda *_a, **_k: identifiable)
        recorded = recorded_logs([made(3)], Rig("motor", force_per_command=K_A))
        found = identifiability.identifiability(recorded)
        assert found["F_cp"] == pytest.approx(0.03)
        return found["m"] <= thresholds.HALF

    limit = 0.5 / 1.96 / 3.0
    assert can(0.8 * limit)
    assert not can(1.25 * limit)


def test_far_less_than_a_sample() -> None:
    """Columns so many samples apart, of either sign, are of two instants."""
    assert not apart(0.24) and not apart(-0.24)
    assert apart(0.375) and apart(-0.375)


def test_material_beyond_friction() -> None:
    """By so much of one Coulomb level the other is below 0 where a weight is more than both."""
    assert not larger_than_friction(30.0, -0.008 * 30.0)
    assert larger_than_friction(-0.0125 * 30.0, 30.0)


def test_half_a_turn() -> None:
    assert turns(4.0) and not turns(2.5)
    assert turns(1.2 * np.pi) and not turns(0.9 * np.pi)


def test_material_to_the_other_way() -> None:
    assert is_one_way(0.008) and is_one_way(0.992)
    assert not is_one_way(0.0125) and not is_one_way(0.5)


def test_chance_windows() -> None:
    """Of twenty windows three may be lost to chance and no more; of four one, of three none."""
    assert mean_loss(*lost_windows(20, 3)) < 1.5 and mean_loss(*lost_windows(20, 4)) > 2.0
    assert mean_loss(*lost_windows(4, 1)) < 1.5 and mean_loss(*lost_windows(3, 1)) > 2.0


def lost_windows(windows: int, lost: int) -> tuple[Array, IntArray]:
    """Errors of so many windows, of which some are far off, and the window of each."""
    errors, window = np.ones(100 * windows), np.repeat(np.arange(windows), 100)
    errors[window < lost] = 100.0
    return errors, window.astype(np.int64)


def test_as_good_as_none() -> None:
    """A Coulomb level that is next to none of the force is not reported, however narrow."""
    happened = Events((9, 9), (9, 9), (900, 900), (1.0, 1.0), force=10.0)
    for level, identifiable in ((1.5e-2, True), (0.7e-2, False)):
        values, sd = {"F_cp": level}, {"F_cp": 0.01 * level}
        found = estimates(values, sd, happened, Rig("force"), "log")
        assert (found["F_cp"].value is not None) is identifiable
    # What is left of the force is a share of friction only where something rubs.
    assert rubs(1.5e-3, 1.0) and not rubs(0.7e-3, 1.0)


def response_of(coherence: float, averages: float) -> Response:
    """A response of one frequency."""
    one = np.ones(1)
    return Response(one, one.astype(np.complex128), coherence * one, averages * one)


def test_half_of_the_coherence() -> None:
    assert response_of(0.6, 100.0).seen[0] and not response_of(0.4, 100.0).seen[0]


def test_coherence_sure() -> None:
    assert response_of(0.84, 100.0).sure[0] and not response_of(0.76, 100.0).sure[0]


def test_material_to_an_input() -> None:
    found = is_apart(np.array([0.008, 0.0125]), np.ones(2))
    assert found.tolist() == [False, True]


def test_half_of_a_response() -> None:
    """A resonance adds so much to the response, an anti-resonance takes it away."""
    assert is_large(0.6, 1.0) and not is_large(0.4, 1.0)
    assert is_deep(0.4, 1.0) and not is_deep(0.6, 1.0)


def test_many_of_a_kind() -> None:
    assert slides_enough(8, 20) and not slides_enough(20, 7)


def test_every_threshold_has_a_test() -> None:
    """A new number is held on either side too: by `test_<its name>` above, and by others whose
    names begin so."""
    numbers = {f"test_{name.lower()}" for name in vars(thresholds) if name.isupper()}
    tests = {name for name in globals() if name.startswith("test_")}
    assert numbers - tests == set()
    tests -= {"test_every_threshold_has_a_test", "test_few_numbers_decide"}
    assert {one for one in tests if not one.startswith(tuple(numbers))} == set()


def test_few_numbers_decide() -> None:
    """Twenty, and what follows from them."""
    tree = ast.parse(Path(thresholds.__file__).read_text(encoding="utf-8"))
    free = [
        node.targets[0]
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
    ]
    assert len(free) <= 20
