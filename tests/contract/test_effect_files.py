"""Files of effects: a user's own in another folder works, a broken one fails loudly."""

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from identification.effect_contract.declaration import (
    check_depends_on,
    check_equation,
    check_linear,
)
from identification.effects._base import Effect, Param
from identification.effects._library import built_in, declared, joined_library
from identification.errors import BadModel
from identification.log import Log
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run
from tests.identification.plants import table
from workbench.cards.effect_checks import check_units

MAGNET = '''"""A magnet at the end of the stroke."""

import math

from identification.effects._base import Effect, Param


def value(t, y, v, F, u, d, z, c, f, s, p):
    """F_m exp(-y/reach)."""
    return p[0] * math.exp(-y / p[1])


EFFECT = Effect(
    key="magnet",
    meaning="a magnet at the end of the stroke",
    equation="F_m*exp(-y/reach)",
    source="made up, 2026",
    acts="force",
    params=(
        Param("F_m", "N", 0.0, 1e3, 5.0, "its pull at y = 0", linear=True),
        Param("reach", "m", 1e-3, 1.0, 0.02, "where 37 % of it is left"),
    ),
    value=value,
    depends_on=("y",),
)
'''

Write = Callable[[str], ModuleType]


@pytest.fixture
def written(tmp_path: Path) -> Write:
    """Writes a file in a folder of the user's and imports it."""

    def write(text: str) -> ModuleType:
        path = tmp_path / "magnet.py"
        path.write_text(text)
        spec = importlib.util.spec_from_file_location("magnet", path)
        assert spec and spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return write


def test_a_users_own_effect_joins_the_library(written: Write) -> None:
    magnet = declared(written(MAGNET))
    library = joined_library([magnet], built_in())
    assert list(library)[-1] == "magnet"
    for check in (check_equation, check_linear, check_units, check_depends_on):
        check(magnet)
    t = np.arange(1000, dtype=np.float64) * 1e-3
    log = Log("made", {"t": t, "y": 0 * t, "u": 0.1 * np.sin(6.0 * t)})
    plant = Plant(table(1), Motor(300.0))
    acting = (library["magnet"].acting({"F_m": 8.0, "reach": 0.05}),)
    plain = free_run(plant, log, (0.0, 0.0, 0.0), "command")
    found = free_run(replace(plant, effects=acting), log, (0.0, 0.0, 0.0), "command")
    assert found.y[-1] > plain.y[-1] + 1e-3


def test_a_file_without_an_effect_is_refused(written: Write) -> None:
    with pytest.raises(BadModel, match=r"magnet\.py: no EFFECT"):
        declared(written(MAGNET.replace("EFFECT =", "EFECT =")))


def test_a_file_that_does_not_import_is_not_passed_over(written: Write) -> None:
    with pytest.raises(NameError):
        written(MAGNET.replace("value=value", "value=valu"))


def test_a_kernel_that_does_not_compile_is_refused_by_name(written: Write) -> None:
    effect = declared(written(MAGNET.replace("math.exp(-y / p[1])", "open('x').read()")))
    with pytest.raises(BadModel, match="effect 'magnet': value does not compile"):
        _ = effect.addresses


@pytest.mark.parametrize(
    ("wrong", "found", "message"),
    [
        ('acts="force"', 'acts="push"', "acts = 'push'"),
        ('key="magnet"', 'key="my magnet"', "a word of letters"),
        ('depends_on=("y",)', 'depends_on=("y",), needs=("p_p",)', "must be among its signals"),
        ("1e3, 5.0", "1e3, 5e3", "typical and default must lie in"),
    ],
)
def test_a_declaration_that_contradicts_itself_is_refused(
    written: Write, wrong: str, found: str, message: str
) -> None:
    with pytest.raises(BadModel, match=message):
        written(MAGNET.replace(wrong, found))


def test_two_of_one_key_are_refused() -> None:
    with pytest.raises(BadModel, match="two effects with the key 'spring'"):
        joined_library([built_in()["spring"]], built_in())


def test_parameters_are_checked() -> None:
    stribeck: Effect = built_in()["stribeck"]
    for values, message in (
        ({"F_s": 1.0}, r"lacks v_s \[m/s\]"),
        ({"F_s": 1.0, "v_s": 0.1, "w": 1.0}, "no parameter 'w'; it has F_s, v_s, asymmetry"),
        ({"F_s": -1.0, "v_s": 0.1}, r"F_s = -1 N, must lie in \[0, 1e\+06\]"),
        ({"F_s": 1.0, "v_s": np.nan}, "v_s = nan"),
    ):
        with pytest.raises(BadModel, match=message):
            stribeck.acting(values)
    many = tuple(Param(f"a{i}", "N", 0.0, 1.0, 0.5, "one") for i in range(9))
    with pytest.raises(BadModel, match="at most 8 parameters"):
        replace(stribeck, params=many)
