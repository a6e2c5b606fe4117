"""Contract of every effect: equation, kernels, linearity, units, signals; and mutants that fail."""

import math
from dataclasses import replace

import pytest

from identification.effect_contract.declaration import (
    Broken,
    check_depends_on,
    check_equation,
    check_linear,
)
from identification.effects._base import Effect, R, Rs
from identification.effects._library import built_in
from workbench.cards.effect_checks import CHECKS, Check, check_units

KEYS = list(built_in())


@pytest.fixture(params=KEYS)
def effect(request: pytest.FixtureRequest) -> Effect:
    """Every effect of the library."""
    return built_in()[request.param]


@pytest.mark.parametrize("check", CHECKS.values(), ids=list(CHECKS))
def test_every_effect_holds_to(check: Check, effect: Effect) -> None:
    check(effect)


def test_declaration_is_complete(effect: Effect) -> None:
    assert effect.meaning
    assert any(k.isdigit() for k in effect.source) or effect.key == "spring"  # a year, or a law
    for p in effect.params:
        assert p.meaning
        assert p.low <= p.typical <= p.high
        if p.linear:
            assert p.low <= 0.0 <= p.high, "a regression must be able to leave it out"
    typical = {p.name: p.typical for p in effect.params}
    assert effect.acting(typical).values == typical
    short = {k: v for k, v in typical.items() if k != "asymmetry"}
    assert effect.acting(short).values == typical


def test_sliding_friction_can_be_unequal(effect: Effect) -> None:
    if effect.acts in ("slip", "stiction", "friction") and effect.key != "frictional_lag":
        assert "asymmetry" in effect.names


def swapped(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """Stribeck with its parameters in the wrong order."""
    return p[1] * (1.0 + p[2] * d) * math.exp(-((abs(v) / p[0]) ** p[3]))


def lopsided(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """Load-dependent friction without the modulus: right as long as the load is positive."""
    return p[0] * (1.0 + p[1] * d) * F


def symmetric(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """Stribeck that forgets the asymmetry."""
    return p[0] * math.exp(-((abs(v) / p[1]) ** p[3]))


@pytest.mark.parametrize(
    ("key", "mutant"),
    [
        ("stribeck", swapped),
        ("stribeck", symmetric),
        ("load_dependent_friction", lopsided),
    ],
)
def test_wrong_kernels_are_found(key: str, mutant: object) -> None:
    assert callable(mutant)
    with pytest.raises(Broken):
        check_equation(replace(built_in()[key], value=mutant))


def test_wrong_declarations_are_found() -> None:
    stribeck, spring = built_in()["stribeck"], built_in()["spring"]
    curved = (*stribeck.params[:2], replace(stribeck.params[2], linear=True))
    with pytest.raises(Broken):
        check_linear(replace(stribeck, params=curved))
    with pytest.raises(Broken):
        check_depends_on(replace(stribeck, depends_on=("v", "y")))
    with pytest.raises(Broken):
        check_depends_on(replace(spring, depends_on=()))
    with pytest.raises(Broken, match="multiply out"):
        check_units(replace(spring, params=(replace(spring.params[0], unit="N"), spring.params[1])))
    with pytest.raises(Broken, match="does nothing"):
        check_depends_on(replace(stribeck, value=symmetric))
