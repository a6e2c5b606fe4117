"""Remarks on several logs are reported once: none is lost in the count, one alone stays as it
is."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.remarks import MinorRemark
from workbench.remarks import merged, printed_once
from workbench.report.view import notes, report_notes

LOGS = tuple(f"run{n}.csv" for n in range(40))
SAID = (
    "uneven clock, resampled every {:.3g} ms",
    "isolated spikes of 'y' in {} samples interpolated (at most 3 in a row), first in row {}",
    "in {} runs; {} s in gaps left out",
    "the command is at its limit in {} samples, t = {} s to 9 s",
)
NUMBERS = st.integers(-5, 5) | st.floats(-1e6, 1e6).map(lambda x: round(x, 3))
OF_A_LOG = st.builds(
    lambda log, said, a, b: f"{log}: {said.format(a, b)}",
    st.sampled_from(LOGS), st.sampled_from(SAID), NUMBERS, NUMBERS,
)  # fmt: skip
REMARKS = st.lists(OF_A_LOG | st.text(min_size=1, max_size=9), max_size=20)


@given(REMARKS)
def test_no_remark_is_lost(remarks: list[str]) -> None:
    found = merged(remarks, LOGS)
    assert sorted(one for group in found for one in group.of) == sorted(remarks)
    assert [group.of[0] for group in found] == list(dict.fromkeys(group.of[0] for group in found))


@given(REMARKS)
def test_the_counts_are_those_of_logs_and_remarks(remarks: list[str]) -> None:
    for group in merged(remarks, LOGS):
        if len(set(group.of)) == 1:
            continue
        head = re.match(r"(?:(\d+) logs|run\d+\.csv)(?:, (\d+) times)?: ", group.text)
        assert head is not None
        logs = {one.split(":")[0] for one in group.of}
        assert int(head[1] or 1) == len(logs)
        assert int(head[2] or len(logs)) == len(group.of)


@given(OF_A_LOG | st.text(min_size=1))
def test_one_alone_is_unchanged(remark: str) -> None:
    assert printed_once([remark], LOGS) == [remark]
    assert printed_once([remark, "another"], LOGS) == [remark, "another"]


@given(st.lists(NUMBERS, min_size=2, max_size=30))
def test_a_number_that_differs_is_a_range_that_holds_all(numbers: list[float]) -> None:
    remarks = [f"run{n}.csv: {x} of it is lost" for n, x in enumerate(numbers)]
    (said,) = printed_once(remarks, LOGS)
    found = re.fullmatch(r"\d+ logs: (\S+)(?: to (\S+))? of it is lost", said)
    assert found is not None
    assert float(found[1]) == min(numbers) and float(found[2] or found[1]) == max(numbers)


def test_thirteen_logs_in_one_line() -> None:
    remarks = [f"run{n}.csv: uneven clock, resampled every 6.67 ms" for n in range(13)]
    assert printed_once(remarks, LOGS) == ["13 logs: uneven clock, resampled every 6.67 ms"]


def test_where_in_its_log_something_is_falls_away_where_it_differs() -> None:
    said = "{}: isolated spikes of 'y' in {} samples interpolated, first in row {}"
    alike = [said.format("run1.csv", 3, 12), said.format("run2.csv", 5, 480)]
    assert printed_once(alike, LOGS) == [
        "2 logs: isolated spikes of 'y' in 3 to 5 samples interpolated"
    ]
    stretches = [f"run1.csv: the command is at its limit in 4 samples, t = {t} s" for t in (1, 2)]
    assert printed_once(stretches, LOGS) == [
        "run1.csv, 2 times: the command is at its limit in 4 samples"
    ]


@pytest.mark.parametrize(
    "pair", [("RST: slow", "PID: slow"), ("signals.y: 3 m", "signals.r: 3 m"), ("3 m", "4 m")]
)
def test_what_is_of_no_log_is_never_counted(pair: tuple[str, str]) -> None:
    assert printed_once(pair, LOGS) == list(pair)


def test_the_longer_name_is_the_log() -> None:
    names = ("a.csv", "old: a.csv")
    assert printed_once(["old: a.csv: 3 lost", "a.csv: 4 lost"], names) == ["2 logs: 3 to 4 lost"]


def test_asides_are_for_verbose_and_reports() -> None:
    remarks = (MinorRemark("run1.csv: jitters by 4 us"), "run1.csv: gaps", "run2.csv: gaps")
    part = notes(remarks, LOGS)
    assert part.entries == ("note: 2 logs: gaps",)
    assert part.whole == tuple(f"note: {one}" for one in remarks)
    said = report_notes(remarks, LOGS)
    assert [one.text for one in said] == ["2 logs: gaps", "run1.csv: jitters by 4 us"]
    assert said[0].of == remarks[1:]
