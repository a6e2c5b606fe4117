"""The axis test: lights by limits of the card and of the machine's own logs."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from design.machine.source import Source
from design.measured.axis_document import axis_document
from design.measured.axis_limits import Allowed, own_limits
from design.measured.axis_test import AxisTest, Earlier, judged
from design.measured.card_limits import LimitsSection
from design.simulated.record import record
from identification.errors import BadCard
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from tests.chain import short_recipe
from tests.screens import one_screen
from workbench.cards.card_tables import CardFile
from workbench.cards.units import in_unit_of
from workbench.logs.sources import Sources
from workbench.report.axis_test import axis_charts, axis_sentence
from workbench.report.view import view
from workbench.steps.axis_test import axis_test_of_sources


def sources(limits: Mapping[str, tuple[float, float]] | None = None, seed: int = 7) -> Sources:
    card, recipe = short_recipe()
    log = record("short", recipe, seed)
    source = Source(log, "short.csv", "0" * 64, len(log))
    return Sources(replace(card, limits=limits or {}), card.rig(), (source,), ("a remark",))


def earlier(**values: float) -> Earlier:
    """A past of 30 logs about these values, 1 % apart."""
    spread = 1 + 0.01 * np.random.default_rng(1).standard_normal(30)
    found = {
        name: [(float(k), value * x) for k, x in enumerate(spread.tolist())]
        for name, value in values.items()
    }
    return Earlier("short", found, 3)


def lights(test: AxisTest) -> dict[str, str]:
    return {one.name: one.light for one in test.quantities}


def test_within_the_limits_it_is_green() -> None:
    test = axis_test_of_sources(sources({"F_cp": (11.0, 13.0), "F_cn": (14.0, 16.0)}))
    assert test.light == "green" and test.reasons == ()
    assert lights(test)["F_cp"] == "green" and lights(test)["F_vp"] == ""
    assert axis_sentence(test).startswith("GREEN: paper_table1_rich is within its limits in 3 of 3")


def test_surely_beyond_a_limit_it_is_red_and_says_by_which() -> None:
    test = axis_test_of_sources(sources({"F_cp": (8.0, 10.0), "F_cn": (14.0, 16.0)}))
    assert test.light == "red"
    (why,) = test.reasons
    assert why.startswith("Coulomb friction in positive direction is 1")
    assert "above the card's limit 10 N" in why


def test_where_the_log_is_not_sure_it_is_yellow() -> None:
    reported = Estimate(10.0, "N", 0.5, 9.0, 11.0)
    for allowed, light, said in (
        (Allowed(8.0, 12.0, "card"), "green", ""),
        (Allowed(8.0, 10.5, "card"), "yellow", "perhaps above"),
        (Allowed(8.0, 9.5, "card"), "yellow", "above the card's limit 9.5 N, though"),
        (Allowed(10.5, 12.0, "card"), "yellow", "below"),
        (Allowed(8.0, 8.9, "card"), "red", "above"),
        (Allowed(11.1, 12.0, "card"), "red", "below"),
    ):
        one = judged("F_cp", reported, allowed)
        assert one.light == light and said in one.why, allowed
    not_identifiable = Estimate(None, "m", reason="no play seen; trace it")
    assert judged("backlash", not_identifiable, None).light == ""
    one = judged("backlash", not_identifiable, Allowed(0.0, 1e-4, "card"))
    assert one.light == "yellow" and "is not identifiable, and the card has limits" in one.why


def test_the_machines_own_logs_give_its_limits() -> None:
    values = 10.0 + 0.3 * np.random.default_rng(2).standard_normal(500)
    found = own_limits(values)
    assert found is not None and found.mean is not None and found.sd is not None
    assert (found.high - found.mean) / found.sd == pytest.approx(3.0, rel=0.02)
    few = own_limits(values[:5])
    assert few is not None and few.mean is not None and few.sd is not None
    assert (few.high - few.mean) / few.sd > 5.0  # of few logs wider
    assert own_limits(values[:4]) is None
    alike = own_limits(np.full(30, 10.0))
    assert alike is not None and (alike.low, alike.high) == pytest.approx((9.8, 10.2))


def test_few_logs_seldom_raise_a_light_without_reason() -> None:
    rng = np.random.default_rng(3)
    beyond = 0
    for _ in range(2000):
        *past, now = 10.0 + 2.0 * rng.standard_normal(7)
        found = own_limits(np.array(past))
        assert found is not None
        beyond += not found.low <= now <= found.high
    assert beyond / 2000 < 0.006  # 0.0027 of normal values


def test_a_past_of_other_friction_is_red_and_the_card_goes_first() -> None:
    past = earlier(F_cp=10.0, F_cn=15.0)
    test = axis_test_of_sources(sources(), past)
    assert test.light == "red" and lights(test)["F_cn"] == "green"
    assert "above its last 30 sound logs' limit" in test.reasons[0]
    assert "% of their mean" in test.reasons[0]
    assert axis_test_of_sources(sources({"F_cp": (11.0, 13.0)}), past).light == "green"


def test_unequal_friction_is_not_called_a_constant_force() -> None:
    test = axis_test_of_sources(sources({"constant_force": (-0.5, 0.5)}))
    one = test.of("constant_force")
    assert one.meaning.startswith("half the difference of F_cn and F_cp: unequal friction or")
    assert one.light == "red" and test.reasons[0].startswith(
        "half the difference of F_cn and F_cp (unequal friction or a constant force) is 1.5"
    )
    assert one.meaning in view(test).page()


def test_without_limits_it_is_yellow_and_says_what_to_give() -> None:
    test = axis_test_of_sources(sources())
    assert test.light == "yellow" and "give --registry, or the card [limits]" in test.reasons[0]
    few = Earlier("short", {"F_cp": [(0.0, 12.0)]}, 1, None, "short has 1 tested logs")
    assert "short has 1 tested logs" in axis_test_of_sources(sources(), few).reasons[0]


def test_what_is_larger_than_friction_is_said_and_no_number_is_reported() -> None:
    found = sources({"F_cp": (11.0, 13.0)})
    log = found.runs[0].log
    rough = 60.0 * np.sin(40.0 * log["t"])
    other = Log(log.name, {**log.signals, "F": log["F"] + rough})
    test = axis_test_of_sources(replace(found, runs=(replace(found.runs[0], log=other),)))
    assert test.light in ("red", "yellow")
    assert test.of("explained").light == "red" or test.of("F_cp").estimate.value is None


def test_a_fit_of_the_model_active_goes_before_the_equation() -> None:
    own = {"F_cp": Estimate(9.0, "N", None, 8.9, 9.1), "backlash": Estimate(1e-4, "m")}
    past = replace(earlier(F_cp=9.0), estimates=own, remarks=("by the fit of version 3",))
    test = axis_test_of_sources(sources(), past)
    assert test.of("F_cp").estimate.value == 9.0 and test.of("backlash").estimate.value == 1e-4
    assert test.light == "green" and test.remarks[0] == "by the fit of version 3"


def test_its_document_page_and_screen(tmp_path: Path) -> None:
    test = axis_test_of_sources(
        sources({"F_cp": (8.0, 10.0)}), earlier(F_cp=12.0, F_cn=15.0, m=1.0)
    )
    document = axis_document(test)
    assert (
        document["light"] == "red" and document["quantities"]["F_cp"]["limits"]["source"] == "card"
    )
    assert document["quantities"]["m"]["limits"]["logs"] == 30
    assert document["quantities"]["backlash"]["value"] is None
    assert document["version"] == 3
    html = view(test).page()
    assert '<div class="lamp red"' in html and "@page { size: A4" in html and ">signature<" in html
    along, past = axis_charts(test)
    assert len(along.panels) == 1 and len(past.panels) == 2
    assert list(past.panels[0].lines[0].x) == [float(k) for k in range(-30, 1)]
    assert past.panels[0].bands[0].low == 8.0
    assert len(axis_charts(axis_test_of_sources(sources()))) == 1
    text = one_screen(view(test).screen(tmp_path))
    assert text.startswith("RED: ") and "written: " in text


def test_limits_of_a_card_with_units() -> None:
    section = LimitsSection.model_validate(
        {"F_cp": [10, "0.013 kN"], "backlash": ["0 mm", "0.2 mm"]}
    )
    found = section.value(Rig("force"), in_unit_of)
    assert found["F_cp"] == (10.0, 13.0) and found["backlash"] == pytest.approx((0.0, 2e-4))
    turned = LimitsSection.model_validate({"F_cp": ["100 N mm", 1.0]}).value(
        Rig("force", motion="rotary"), in_unit_of
    )
    assert turned["F_cp"] == pytest.approx((0.1, 1.0))
    for wrong, said in (
        ({"F_cp": [13, 10]}, "the lower limit first"),
        ({"F_cp": ["10 kg", 13]}, "of another kind"),
        ({"F_cp": ["much", 13]}, "a number needed"),
    ):
        with pytest.raises(BadCard, match=said):
            LimitsSection.model_validate(wrong).value(Rig("force"), in_unit_of)
    with pytest.raises(ValueError, match="unknown_key"):
        LimitsSection.model_validate({"F_c": [1, 2]})
    assert "limits" in CardFile.model_fields
