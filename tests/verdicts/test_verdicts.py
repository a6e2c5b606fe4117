"""The table of verdicts: each log's answer is no worse than the committed one.

`pytest -m verdicts -n 2 --dist worksteal` runs it and prints what changed.
"""

import os
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.verdicts.answers import answer
from tests.verdicts.comparison import change, committed, committed_of, to_plain
from tests.verdicts.entries import Entry, entries
from tests.verdicts.logs import Absent
from tests.verdicts.plugin import PROPERTY, WRITE, Outcome

ENTRIES = entries()
COMMITTED = committed()


def measured_data() -> Path | None:
    """The measured sets' folder, None where there is none: most entries need no data."""
    named = os.environ.get("WORKBENCH_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    return folder if folder.is_dir() else None


@pytest.mark.verdicts
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.method] * entry.long)
        for name, entry in ENTRIES.items()
    ],
)
def test_verdict(
    name: str,
    tmp_path: Path,
    record_property: Callable[[str, object], None],
    request: pytest.FixtureRequest,
) -> None:
    entry: Entry = ENTRIES[name]
    try:
        said = answer(entry, measured_data(), tmp_path)
    except Absent as error:
        pytest.skip(str(error))
    now = committed_of(said, entry.right)
    writing = bool(request.config.getoption(WRITE))
    before = COMMITTED.get(name, now if writing else None)
    assert before is not None, f"{name} has no committed answer: python tools/verdicts.py --write"
    changed = change(entry, now, before)
    outcome = Outcome(
        name=name,
        answer=to_plain(now),
        worse=list(changed.worse),
        better=list(changed.better),
        cost=changed.cost,
        seconds=said.seconds,
        evaluations=f"{said.evaluations} evaluations{'!' if said.halted else ''}",
        refusal=said.refusal,
    )
    record_property(PROPERTY, asdict(outcome))
    if not writing:
        assert not changed.worse, "\n".join(
            ["worse than committed:", *outcome.worse, outcome.refusal]
        )
