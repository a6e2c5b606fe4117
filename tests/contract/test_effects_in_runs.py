"""Effects in a run, beside what `effect_contract.runs` checks; mutants that must fail."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from identification.effect_contract.declaration import Broken
from identification.effect_contract.runs import (
    HYDRAULIC,
    START_AT_REST,
    check_never_drives,
    check_sampling,
    check_shows,
    check_vanishes,
    run_with,
    trial_log,
    typical,
)
from identification.effects._base import Effect, R, Rs
from identification.effects._library import built_in
from identification.errors import BadModel
from identification.simulation.free_run import free_run
from workbench.cards.effect_checks import CHECKS, failures

# Parameters as large as they may well be, of a sign that would drive if it were not held back.
DRIVING: Mapping[str, Mapping[str, float]] = {
    "position_dependent_friction": {"c1": -5e3, "a": -60.0, "period": 0.01, "asymmetry": 0.5},
    "warmup": {"a": -0.95, "b": -900.0, "tau": 0.5, "asymmetry": 0.8},
    "frictional_lag": {"tau": 0.05},
}


@pytest.mark.parametrize("key", sorted(DRIVING))
def test_friction_that_would_drive_is_held_back(key: str) -> None:
    check_never_drives(built_in()[key], DRIVING[key])


def test_all_at_once() -> None:
    library = built_in()
    log = trial_log(10.0)
    every = [typical(e) for e in library.values() if e.acts != "bristle"]
    for effects in (every, [*every, typical(library["presliding"])]):
        found = run_with(HYDRAULIC, log, *effects)
        assert 0.001 < np.ptp(found.y) < 1.0
    with pytest.raises(BadModel, match="replaces sticking"):
        run_with(HYDRAULIC, log, typical(library["presliding"]), typical(library["presliding"]))


def test_a_measured_force_has_its_leakage_in_it() -> None:
    leak = built_in()["leakage"].acting({"leak": 50.0})
    log = trial_log(5.0)
    seen = run_with(HYDRAULIC, log)
    log = log.with_signals(F=seen.F, y=seen.y)
    plain = free_run(HYDRAULIC, log, START_AT_REST, "force")
    found = free_run(replace(HYDRAULIC, effects=(leak,)), log, START_AT_REST, "force")
    assert np.max(np.abs(found.y - plain.y)) < 1e-12


def driving(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """Friction that pushes along the stroke: more is taken off than there is."""
    return -p[0] * f


def offset(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """A spring with a force of its own."""
    return -(p[0] + p[1] * y * y) * y + 2.0


def quick(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """A force that turns within less than a sample."""
    return p[0] if (t * 3331.0) % 1.0 < 0.5 else -p[0]


def test_wrong_runs_are_found() -> None:
    spring = built_in()["spring"]
    for check, mutant in (
        (check_vanishes, replace(spring, value=offset)),
        (check_shows, replace(spring, params=(replace(spring.params[0], typical=1e-9),
                                              replace(spring.params[1], typical=0.0)))),
        (check_sampling, replace(spring, value=quick)),
    ):  # fmt: skip
        with pytest.raises(Broken):
            check(mutant)
        check(spring)


def test_what_an_effect_breaks_is_listed_by_check() -> None:
    spring: Effect = built_in()["spring"]
    assert failures(spring) == {}
    found = failures(replace(spring, source="", depends_on=("y", "u")))
    assert found == {
        "declaration is complete": "its source is empty; say it in a few words",
        "signals and parameters are those declared": (
            "depends_on names u, with which nothing of it varies"
        ),
    }
    assert set(found) <= set(CHECKS)
    hot = failures(replace(spring, signals=("temperature",), needs=("temperature",)))
    assert "cannot be simulated" not in hot and "temperature" in hot["signals can be simulated"]
