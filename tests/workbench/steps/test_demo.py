"""What the demo says of itself: whether it found the effect that was hidden in its log."""

from types import SimpleNamespace
from typing import Any

import pytest

from workbench.steps.demo import Demonstration


@pytest.mark.parametrize(
    ("found", "rightly"),
    [(["stribeck"], True), ([], False), (["spring"], False), (["stribeck", "spring"], False)],
)
def test_the_hidden_effect_alone_is_right(found: list[str], rightly: bool) -> None:
    effects = [SimpleNamespace(effect=SimpleNamespace(key=key)) for key in found]
    traced: Any = SimpleNamespace(trace=SimpleNamespace(effects=effects))
    none: Any = None
    shown = Demonstration(traced, none, none, {}, {"effects": {"stribeck": {}}})
    assert shown.named_rightly is rightly
