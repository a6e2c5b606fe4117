"""The installation looked over: what does not work is said with what to do."""

from pathlib import Path

import pytest

from workbench.report.doctor import installation_screen
from workbench.steps.installation import check_installation


def test_versions_kernels_and_cards_are_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "emps").mkdir()
    (tmp_path / "emps/DATA_EMPS.mat").write_bytes(b"")
    monkeypatch.setenv("WORKBENCH_DATA", str(tmp_path))
    found = check_installation()
    assert found.packages["numpy"][0].isdigit()
    cards = found.data["cards"]
    assert isinstance(cards, dict) and cards["emps"] == {"there": 1, "of": 2}
    assert found.wrong == ()
    shown = installation_screen(found, None, found.wrong).text()
    assert "emps: 1 of 2 files" in shown
    assert "none named" in shown


def test_a_folder_of_data_that_is_none_is_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WORKBENCH_DATA", str(tmp_path / "nowhere"))
    (line,) = check_installation().wrong
    assert "WORKBENCH_DATA" in line and "\n" not in line
