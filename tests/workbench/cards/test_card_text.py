"""Cards written by a program are TOML, whatever the names in them."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.cards.card_text import Line, card_text, toml

TEXT = st.text(st.characters(codec="utf-8"), max_size=30)
VALUE = st.one_of(TEXT, st.booleans(), st.integers(-(2**62), 2**62), st.floats(allow_nan=False))


@given(value=st.one_of(VALUE, st.lists(TEXT), st.dictionaries(st.sampled_from(["a", "b"]), VALUE)))
def test_a_value_comes_back(value: object) -> None:
    assert tomllib.loads(f"x = {toml(value)}")["x"] == value


@given(remark=TEXT, name=TEXT)
def test_remarks_never_become_keys(remark: str, name: str) -> None:
    lines = {"card": [Line("name", name, remark), Line("title", None, remark)]}
    text = card_text(["made by a test"], lines, [])
    assert tomllib.loads(text) == {"card": {"name": name}}


def test_a_long_reason_goes_on_below_its_line() -> None:
    reason = " ".join(f"word{k}" for k in range(100))
    text = card_text([], {"card": [Line("name", "a", reason), Line("title", "b")]}, [])
    assert max(map(len, text.splitlines())) < 200
    assert reason in " ".join(text.replace("#     ", "").split())
    assert tomllib.loads(text) == {"card": {"name": "a", "title": "b"}}


@pytest.mark.parametrize("value", [None])
def test_a_value_that_is_to_be_filled_in_is_a_remark(value: None) -> None:
    assert "# area = ..." in card_text([], {"rig": [Line("area", value)]}, [])
