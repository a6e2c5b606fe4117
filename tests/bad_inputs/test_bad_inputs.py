"""A sample of the bad inputs in this process; `benchmarks/bad_inputs.py` runs them all."""

from pathlib import Path

import pytest

from tests.bad_inputs.cases import Case, cases
from tests.bad_inputs.running import ended
from tests.bad_inputs.shop import Shop, make_shop
from workbench.cli import main

NUMBER = 330
# Long runs and what would stop this process, were it to go wrong, are left to the benchmark.
LEFT_OUT = (
    *("signal", "clock", "option trace", "option validate", "type many", "file", "unit", "name"),
    *("card force", "card motor", "card pneumatic", "option design", "model 0", "design 0"),
)
SAMPLE = [case for case in cases(NUMBER, 1) if not case.name.startswith(LEFT_OUT)]


@pytest.fixture(scope="session")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Shop:
    return make_shop(tmp_path_factory.mktemp("shop"))


def test_the_cases_are_many_and_differ() -> None:
    found = cases(600, 0)
    assert len(found) == 600
    assert len({case.name for case in found}) > 560


@pytest.mark.slow
@pytest.mark.parametrize("case", SAMPLE, ids=lambda case: case.name.encode("unicode_escape"))
def test_a_bad_input_ends_in_one_line(
    case: Case, shop: Shop, capfd: pytest.CaptureFixture[str]
) -> None:
    def run(arguments: list[str]) -> tuple[int, str]:
        status = main(arguments)
        return status, capfd.readouterr().err

    found = ended(case, shop, run)
    assert not found.faults, found


@pytest.mark.slow
def test_an_ending_is_judged(shop: Shop) -> None:
    def make(_shop: Shop, folder: Path) -> list[str]:
        (folder / "a.part").touch()
        return ["predict"]

    wrong = ended(Case("x", make), shop, lambda _arguments: (3, "a\nb"))
    assert wrong.faults == ("exit status 3", "more than one line", "left over: a.part")
    refused = ended(Case("x", make), shop, lambda _arguments: (1, "a\nnext (b): c"))
    assert refused.faults == ("left over: a.part",)
    assert ended(Case("x", make), shop, lambda _arguments: (None, "")).faults == ("does not end",)
