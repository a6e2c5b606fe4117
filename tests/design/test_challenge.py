"""Who wins and who does not, on held-out logs and in the loop, each with its reason."""

import re
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest

from design.challenge import Contender, Contest, Terms, challenge
from design.simulated.record import record
from identification.errors import BadModel
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator
from tests.chain import TABLES, designed, model_of, short_recipe

ACTUATOR = Actuator(19530.0, 10405.0)
OLD = TABLES["paper_table1"]
NEW = replace(OLD, F_cp=17.0, F_cn=20.0, F_vp=150.0, F_vn=120.0, F_sp=26.0, F_sn=-29.0)


@cache
def held_out(p: Karnopp) -> Log:
    """A log of the machine with these parameters."""
    card, recipe = short_recipe()
    return record(card.name, replace(recipe, plant=replace(recipe.plant, friction=p)), seed=9)


@cache
def contender(p: Karnopp) -> Contender:
    """A model of these parameters and the design made for it."""
    model = model_of(p, ACTUATOR)
    return Contender(model, designed(model))


def contest(
    old: Contender, new: Contender, p: Karnopp = NEW, terms: Terms | None = None
) -> Contest:
    return challenge(old, new, [held_out(p)], np.random.default_rng(1), terms)


@pytest.mark.slow
def test_the_model_of_the_machine_as_it_is_wins() -> None:
    found = contest(contender(OLD), contender(NEW), terms=Terms(loop=-10.0))
    assert found.won, found.reason
    old, new = found.held_out["champion"], found.held_out["challenger"]
    assert old.position_rms is not None and new.position_rms is not None
    assert new.position_rms < 0.1 * old.position_rms
    units = r"held out: free run [\d.]+ (mm|µm) rms against [\d.]+ mm, force [\d.]+ N rms against"
    assert re.match(units + r" [\d.]+ N; simulation: tracking error [\d.]+ mm rms", found.reason)
    document = asdict(found)
    assert document["won"] is True
    assert document["held_out"]["challenger"]["position_rms"] == new.position_rms


@pytest.mark.slow
def test_a_model_that_follows_no_better_is_refused() -> None:
    found = contest(contender(NEW), contender(NEW))
    assert not found.won
    assert "one of them has to fall by 10 % at least" in found.reason


@pytest.mark.slow
def test_a_model_that_follows_worse_is_refused() -> None:
    found = contest(contender(NEW), contender(OLD))
    assert not found.won
    assert "worse than the active one" in found.reason


def test_the_margin_counts() -> None:
    strict = Terms(held_out=0.9999, loop=-10.0)
    found = contest(contender(OLD), contender(NEW), terms=strict)
    assert not found.won
    assert "99.99 % at least" in found.reason


@pytest.mark.slow
def test_a_design_that_tracks_no_better_is_refused() -> None:
    same = Contender(contender(OLD).model, contender(NEW).design)
    found = contest(same, contender(NEW))
    assert not found.won
    assert "on the same machine, at least 2 % less needed" in found.reason
    loop = found.loop
    assert loop["champion"] == loop["challenger"]
    assert found.model_won
    assert not contest(contender(OLD), contender(NEW), OLD).model_won


def test_without_a_design_there_is_nothing_to_win() -> None:
    model = contender(NEW).model
    found = contest(contender(OLD), Contender(model, None))
    assert not found.won and found.reason.endswith("simulation: no design")
    assert not found.model_won  # the active design misses its limits on this machine
    none = replace(contender(NEW).design or pytest.fail("no design"), recommended="none")
    found = contest(contender(OLD), Contender(model, none))
    assert found.reason.endswith("simulation: no controller keeps its goals")


def test_against_a_model_without_a_design_the_held_out_log_decides() -> None:
    found = contest(Contender(contender(OLD).model, None), contender(NEW))
    assert found.won, found.reason
    assert found.reason.endswith("no design before")
    assert found.loop["champion"] is None


def test_a_design_that_does_not_fit_the_machine_any_more_loses() -> None:
    fitting = contender(OLD).design
    assert fitting is not None
    misfit = Contender(contender(OLD).model, replace(fitting, force=None))
    found = contest(misfit, contender(NEW))
    assert found.won, found.reason
    assert "no force loop" in found.reason


def test_a_held_out_log_has_to_be_long_enough() -> None:
    short = held_out(NEW).part(0, 500)
    with pytest.raises(BadModel, match="no held-out log of at least 2 s"):
        challenge(contender(OLD), contender(NEW), [short], np.random.default_rng(1))
