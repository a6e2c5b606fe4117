"""Responses of machines with friction beside the truth, and what is said and drawn of them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest

import workbench as wb
from benchmarks.response_rig import Machine, gains, machine, record
from design.machine.model import Model
from design.machine.source import Source
from design.measured.linear_force import freed, of_load, of_model
from design.measured.response import (
    Responded,
    curves_of,
    degrees,
    ranges,
    respond,
    response_document,
)
from identification.arrays import Array
from identification.errors import BadModel, BadSpecification, NotIdentifiable
from identification.frequency.estimate import Response
from identification.frequency.swinging_load import Rests, swinging_load
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.inverse_model import Smoothing
from identification.model.karnopp import Karnopp
from identification.signals.differentiate import differentiate
from identification.simulation.inverse_dynamics import force_needed, opposing_force
from tests.chain import model_of
from tests.made import made_once
from workbench.cards.card import card_from
from workbench.interface.logs import ResponseResult
from workbench.report.response import (
    loop_line,
    over_frequency,
    peak_table,
    plant_chart,
    response_sentence,
)
from workbench.report.view import view
from workbench.steps.response import response_frame

CARD: dict[str, Any] = {
    "card": {"name": "axis"},
    "rig": {"kind": "motor", "force_per_command": 1.0},
    "signals": {k: {"column": k, "unit": u} for k, u in zip("tryu", ("s", "m", "m", "V"),
                                                            strict=True)},
}  # fmt: skip
TWO, ONE = machine(5, True), machine(3, False)


def friction_of(one: Machine) -> Karnopp:
    return Karnopp(one.mass, one.F_cp, one.F_cn, one.F_vp, one.F_vn, 1e-4, -1e-4, one.F_s, -one.F_s)


@made_once
def log_of(one: Machine, seconds: float = 20.0) -> Log:
    rec = record(one, 5, seconds)
    t = np.asarray(rec.h * np.arange(len(rec.r)), dtype=np.float64)
    return Log("run.csv", {"t": t, "r": rec.r, "y": rec.y, "u": rec.u, "F": rec.u})


def of_logs(
    *logs: Log, model: Model, lowest: float | None = None, left_in: str | None = None
) -> Responded:
    rig = card_from(CARD, Path("card.toml")).rig()
    runs = [Source(log, log.name, "0" * 64, len(log)) for log in logs]
    return respond(runs, rig, "axis", model, lowest, left_in=left_in, read=("a remark",))


def model(one: Machine) -> Model:
    return replace(model_of(friction_of(one), k_a=1.0), card="axis")


@made_once
def responded(one: Machine, left_in: str | None = None) -> Responded:
    return of_logs(log_of(one), model=model(one), left_in=left_in)


def near(found: Response, one: Machine) -> tuple[float, int]:
    """Share of the sure points within 1 dB and 5 degrees of the truth, and how many are sure."""
    sure = found.sure
    off = found.H[sure] / one.truth(found.f[sure])
    good = (np.abs(20 * np.log10(np.abs(off))) < 1) & (np.abs(np.degrees(np.angle(off))) < 5)
    return float(np.mean(good)), int(sure.sum())


@pytest.mark.parametrize("one", [TWO, ONE])
def test_friction_taken_off_leaves_the_linear_machine(one: Machine) -> None:
    found, left = responded(one), responded(one, "asked for")
    share, points = near(found.found.position, one)
    with_friction, fewer = near(left.found.position, one)
    assert share > 0.97 and points > 150
    assert with_friction < 0.9 and fewer < points
    # The same curve stands beside the other as the one that friction is left in.
    np.testing.assert_array_equal(found.found.with_friction.H, left.found.body.H)


def test_the_load_that_swings_behind_a_motor_at_rest_is_seen() -> None:
    """The model knows one mass; the response's own modes hold the motor where it is stuck."""
    anti, resonance = responded(TWO).peaks
    assert (anti.kind, resonance.kind) == ("anti-resonance", "resonance")
    assert anti.frequency.value == pytest.approx(TWO.anti_resonance, rel=0.02)
    assert resonance.frequency.value == pytest.approx(TWO.resonance, rel=0.02)
    assert responded(ONE).peaks == ()


def test_peaks_in_a_gap_are_distinguished_from_those_that_are_seen() -> None:
    found = responded(TWO)
    assert found.modes is not None and TWO.anti_resonance and TWO.resonance
    body = found.found.body
    gap = (body.f > 0.8 * TWO.anti_resonance) & (body.f < 1.2 * TWO.resonance)
    hidden = replace(body, coherence=np.where(gap, 0.0, body.coherence))
    modes = replace(found.modes, peaks=(), felt=found.peaks)
    felt = replace(found, modes=modes, found=replace(found.found, body=hidden))
    low, high = felt.gap_around(felt.felt)
    assert low < 0.81 * TWO.anti_resonance < 1.19 * TWO.resonance < high
    said = response_sentence(felt)
    assert "no resonance" not in said and "where it is not identified at every frequency" in said
    assert "there is an anti-resonance at" in said and "and a resonance at" in said
    document = response_document(felt)
    assert document["peaks"] == [] and [one["kind"] for one in document["felt"]] == [
        "anti-resonance", "resonance"
    ]  # fmt: skip
    assert [row[0] for row in peak_table(felt).whole] == [
        "anti-resonance, felt", "resonance, felt"
    ]  # fmt: skip


@pytest.mark.slow
def test_the_hidden_load_is_found_where_friction_hides_the_force() -> None:
    for one in (TWO, ONE):
        known = model(one)
        free = freed(log_of(one), known)
        runs = [free.without_friction(of_model(known))]
        load = swinging_load(runs, [free.rests], one.mass)
        if one is ONE:
            assert load is None
            continue
        assert load is not None
        assert load.anti_resonance == pytest.approx(TWO.anti_resonance, rel=0.04)
        assert load.share == pytest.approx(TWO.m_2 / TWO.mass, abs=0.08)
        load_alone = free.without_friction(of_load(known, load))
        assert np.any(load_alone.linear != runs[0].linear)
        np.testing.assert_array_equal(load_alone.linear[free.slides], runs[0].linear[free.slides])


def test_a_body_that_hardly_rests_hides_no_load() -> None:
    known = model(TWO)
    free = freed(log_of(TWO), known)
    sliding = Rests(np.zeros(len(free.a), dtype=bool), free.a)
    assert swinging_load([free.plain], [sliding], TWO.mass) is None


def test_a_spring_stays_in_the_plant_but_for_its_cube() -> None:
    sizes = {"k": Estimate(500.0, "N/m"), "k_3": Estimate(2e4, "N/m**3")}
    plain, sprung = model(ONE), replace(model(ONE), effects={"spring": sizes})
    log = log_of(ONE, 6.0)
    without, found = freed(log, plain), freed(log, sprung)
    cube = 2e4 * differentiate(log["y"], log.h).y ** 3
    apart = (without.left - found.left)[found.slides]
    zoh = 0.5 * (cube + np.append(cube[1:], cube[-1]))
    np.testing.assert_allclose(apart, zoh[found.slides], rtol=1e-6, atol=1e-12)
    v = np.sin(np.arange(1000) * 1e-2)
    force = of_model(sprung)(v, np.zeros(1000), 1e-3) - of_model(plain)(v, np.zeros(1000), 1e-3)
    np.testing.assert_allclose(force, 500.0 * 1e-3 * np.cumsum(v))
    curves = curves_of(sprung, np.array([1e-4]))
    assert abs(curves.plant[0]) == pytest.approx(1 / 500.0, rel=1e-3)


@pytest.mark.slow
def test_of_many_logs_a_report_takes_the_longest(monkeypatch: pytest.MonkeyPatch) -> None:
    log = log_of(ONE, 6.0)
    monkeypatch.setattr("workbench.report.response.SAMPLES_IN_A_REPORT", len(log) + 1)
    short = log.part(0, len(log) // 2)
    runs = [Source(one, "a.csv", "0" * 64, len(one)) for one in (short, log, log, short)]
    (section,) = over_frequency(model(ONE), runs)
    (of_longest,) = over_frequency(model(ONE), runs[1:3])
    assert section.html == of_longest.html
    assert (
        section.title == "Over frequency" and "friction: subtracted from the force" in section.html
    )
    still = log.with_signals(y=np.zeros(len(log)))
    assert over_frequency(model(ONE), [replace(runs[1], log=still)]) == []


def true_controller(f: Array, one: Machine) -> Array:
    k_p, k_d, k_i, tau, h, _ = gains(one, 5e-4)
    z = np.exp(-2j * np.pi * f * h)
    slope = h / (tau + h) / (1.0 - tau / (tau + h) * z) * (1.0 - z) / h
    return np.asarray(k_p + k_d * slope + k_i * h / (1.0 - z))


def test_crossover_and_phase_margin_are_those_of_the_loop() -> None:
    found = responded(TWO)
    m = found.margins
    assert m is not None and m.crossover is not None and m.phase_deg is not None
    f = np.array([m.crossover])
    L = true_controller(f, TWO) * TWO.truth(f)
    assert abs(L[0]) == pytest.approx(1.0, abs=0.05)
    assert m.phase_deg == pytest.approx(180 + np.degrees(np.angle(L[0])), abs=4.0)
    open_loop = found.open_loop
    assert open_loop is not None
    for part, said in ((open_loop.f > 20.0, "below 2"), (open_loop.f < 5.0, "above 4.")):
        unseen = np.where(part, open_loop.coherence, 0.0)
        cut = replace(found, open_loop=replace(open_loop, coherence=unseen),
                      margins=replace(m, crossover=None))  # fmt: skip
        assert f"crosses 0 dB {said}" in loop_line(cut)
    assert f"crosses 0 dB at {m.crossover:.3g} Hz" in loop_line(found)


def test_what_is_opposed_is_the_needed_force_but_for_the_linear_part() -> None:
    """One equation: inertia and mean viscous friction are what is left of the inverse model's."""
    log, known = log_of(ONE, 6.0), model(ONE)
    plant, p = known.simulated, known.karnopp
    motion = differentiate(log["y"], log.h)
    d = np.where(motion.v >= p.dv_p, 1.0, np.where(motion.v <= p.dv_n, -1.0, 0.0))
    needed = force_needed(log, plant, Smoothing())
    linear = p.m * motion.a + 0.5 * (p.F_vp + p.F_vn) * motion.v
    opposed = opposing_force(log, plant, motion.y, motion.v, d)
    np.testing.assert_allclose(opposed[d != 0], (needed - linear)[d != 0], atol=1e-9)


def test_document_and_table() -> None:
    found = responded(TWO)
    document, frame = response_document(found), response_frame(found)
    assert document["schema"] == "response/1" and document["instrument"] == "r"
    assert document["plant"]["unit"] == "m/N" and document["controller"]["unit"] == "N/m"
    assert document["open_loop"]["gain_margin"]["unit"] == "dB"
    assert [one["kind"] for one in document["peaks"]] == [one.kind for one in found.peaks]
    assert document["peaks"][0]["frequency"]["unit"] == "Hz"
    assert document["friction"]["taken_out"]
    assert len(frame) == document["frequencies"] == len(found.found.f)
    seen = found.found.body.seen
    np.testing.assert_array_equal(np.isfinite(frame["plant_magnitude_db"]), seen)
    slope = frame["velocity_phase_deg"] - frame["plant_phase_deg"]
    np.testing.assert_allclose(np.mod(slope[seen], 360.0), 90.0, atol=1e-6)
    assert np.all(frame["plant_band_db"][seen] > 0)


def test_python_control_takes_every_curve() -> None:
    found = ResponseResult(responded(TWO))
    plant = found.to_control()
    assert isinstance(plant, control.FRD)
    body = found.found.found.body
    np.testing.assert_allclose(plant.omega, 2 * np.pi * body.f[body.seen])
    at = np.abs(plant(1j * plant.omega))
    np.testing.assert_allclose(at, np.abs(found.found.found.position.H[body.seen]))
    for what in ("velocity", "plant_with_friction", "controller", "open_loop"):
        assert len(found.to_control(what).omega) > 50
    with pytest.raises(BadModel, match="no curve 'plnt'"):
        found.to_control("plnt")  # type: ignore[arg-type]


def test_without_a_reference_it_says_so_and_shows_no_loop() -> None:
    log = log_of(ONE)
    bare = Log("bare.csv", {k: log[k] for k in ("t", "y", "u", "F")})
    found = of_logs(bare, model=model(ONE))
    assert found.open_loop is None and not found.found.instrument
    assert any("no reference is logged" in one for one in found.remarks)
    assert "no moving reference is logged" in loop_line(found)
    with pytest.raises(BadModel, match="the logs show no open loop"):
        ResponseResult(found).to_control("open_loop")
    still = of_logs(log.with_signals(r=np.zeros(len(log))), model=model(ONE))
    assert any("the reference rests" in one for one in still.remarks)


def test_points_apart_are_no_range_of_frequencies(monkeypatch: pytest.MonkeyPatch) -> None:
    log = log_of(ONE, 6.0)
    shown = of_logs(log, model=model(ONE)).found
    apart = np.where(np.isin(np.arange(len(shown.f)), (3, 20)), shown.body.coherence, 0.0)
    few = replace(shown, body=replace(shown.body, coherence=apart))
    assert np.count_nonzero(few.body.seen) == 2
    monkeypatch.setattr("design.measured.response._measured", lambda *_: (few, None))
    with pytest.raises(NotIdentifiable, match="needed at 3 in a row"):
        of_logs(log, model=model(ONE))


def test_what_shows_nothing_is_refused() -> None:
    log = log_of(ONE, 6.0)
    rng = np.random.default_rng(1)
    noise = log.with_signals(y=1e-6 * rng.standard_normal(len(log)))
    with pytest.raises(NotIdentifiable, match=r"run.csv: no frequency at which the motion follows"):
        of_logs(noise, model=model(ONE))
    with pytest.raises(BadSpecification, match=r"lowest frequency 0\.1 Hz"):
        of_logs(log, model=model(ONE), lowest=0.1)
    rotary = replace(model(ONE), rig=replace(model(ONE).rig, motion="rotary"))
    with pytest.raises(BadModel, match="the model is of a rotary machine"):
        of_logs(log, model=rotary)
    followed = replace(
        model(ONE), rig=Rig("force"), actuator=None,
        log=tuple(replace(one, position_rms=None) for one in model(ONE).log),
    )  # fmt: skip
    prescribed = replace(followed, fit=replace(followed.fit, adequate=False))
    assert prescribed.prescribed_motion and not followed.prescribed_motion
    no_mass = {**prescribed.friction, "m": Estimate(None, "kg", reason="none shows", assumed=1.0)}
    with pytest.raises(NotIdentifiable, match="axis is prescribed by a rig"):
        of_logs(log, model=replace(prescribed, friction=no_mass))


@pytest.mark.slow
def test_several_logs_narrow_the_band() -> None:
    both = of_logs(log_of(ONE), log_of(ONE).part(0, 30_000), model=model(ONE), lowest=2.0)
    alone = of_logs(log_of(ONE), model=model(ONE), lowest=2.0)
    assert both.found.body.averages[5] > 1.3 * alone.found.body.averages[5]


def test_words_and_pictures() -> None:
    found = responded(TWO)
    assert "an anti-resonance at 4" in response_sentence(found)
    text = view(found).screen().text()
    assert "Hz" in text.splitlines()[0] and "friction: subtracted from the force" in text
    html = view(found).page()
    assert html.count('<figure class="chart"') == 3
    for title in ("Plant", "Resonances and margins", "Open loop", "Controller"):
        assert f">{title}<" in html
    panels = plant_chart(found).panels
    assert [one.y.split()[0] for one in panels] == ["magnitude", "phase", "coherence"]
    low, high = panels[0].x_range or (0.0, 0.0)
    assert low <= found.found.f[0] and np.log10(low) == pytest.approx(round(np.log10(low)), abs=0.7)
    assert high > (TWO.resonance or 0.0)
    measured = next(one for one in panels[0].lines if one.name == "measured")
    assert np.isnan(measured.y).sum() == np.count_nonzero(~found.found.body.seen[: len(measured.y)])


def test_phases_are_unwrapped_and_ranges_forgive_small_gaps() -> None:
    H = np.exp(1j * np.radians(np.linspace(-170.0, -330.0, 50)))
    assert degrees(H)[0] == pytest.approx(-170.0) and degrees(H)[-1] == pytest.approx(-330.0)
    assert np.all(np.isnan(degrees(np.full(3, np.nan + 0j))))
    f = np.arange(1.0, 21.0)
    where = np.ones(20, dtype=bool)
    where[[5, 6, 11, 12, 13, 14]] = False
    assert ranges(f, where) == [(1.0, 11.0), (16.0, 20.0)]
    assert ranges(f, ~np.ones(20, dtype=bool)) == []


def test_the_function_of_python_is_the_command() -> None:
    assert callable(wb.response)
    log = log_of(ONE)
    table = {k: log[k] for k in ("t", "r", "y", "u")}
    rig = {"kind": "motor", "force_per_command": "1 N/V"}
    found = wb.response(table, rig=rig, model=model(ONE))
    assert found.document["friction"]["taken_out"]
    left = wb.response(table, rig=rig, friction_left_in=True)
    assert left.document["friction"] == {"taken_out": False, "reason": "asked for"}
    assert list(left.frame) == list(response_frame(responded(ONE)))
