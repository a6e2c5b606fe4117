"""Tables within tables: structs of a trace, rollouts, states in each step."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.logs.table import damaged, vectors_of
from workbench.logs.tables import read_table
from workbench.logs.unknown import read_unknown

N = 200
T = [0.01 * k for k in range(N)]
Q = [float(k % 7) for k in range(N)]


def columns(path: Path, content: object) -> dict[str, float]:
    """The columns of a JSON file as `init` finds them, by the value in row 10."""
    path.write_text(json.dumps(content), "utf-8")
    found = read_unknown(path)
    table = read_table(path, FileSpec.model_validate(found.layout))
    assert {one.key for one in found.columns} <= set(table.names)
    return {str(one.key): one.values[10] for one in found.columns if not one.unusable}


def test_lists_in_tables_go_by_their_path(tmp_path: Path) -> None:
    content = {"seed": 1, "run": {"t": T, "obs": {"q": Q}, "act": {"u": Q[:-1]}}}
    assert columns(tmp_path / "a.json", content) == {"t": 0.1, "obs.q": 3.0, "act.u": 3.0}


def test_steps_hold_tables_and_lists(tmp_path: Path) -> None:
    steps = [{"t": t, "obs": {"q": q}, "act": [q, 2 * q]} for t, q in zip(T, Q, strict=True)]
    right = {"t": 0.1, "obs.q": 3.0, "act[0]": 3.0, "act[1]": 6.0}
    assert columns(tmp_path / "a.json", steps) == right
    assert columns(tmp_path / "b.json", {"episodes": [{"id": 4, "steps": steps}]}) == right


def test_of_several_runs_the_first_is_read_and_that_is_said(tmp_path: Path) -> None:
    content = {"rollouts": [{"t": T, "q": Q}, {"t": T, "q": T}]}
    assert columns(tmp_path / "a.json", content) == {"t": 0.1, "q": 3.0}
    (said,) = read_unknown(tmp_path / "a.json").notes
    assert said == "2 runs in rollouts: the card reads the first"


@pytest.mark.parametrize("scope", [True, False])
def test_structs_of_a_trace_go_by_their_labels(tmp_path: Path, scope: bool) -> None:
    path = tmp_path / "a.mat"
    signals = np.empty(2, dtype=object)
    if scope:
        signals[:] = [{"values": np.array(Q)[:, None], "label": "angle"},
                      {"values": np.array(T)[:, None], "label": "drive"}]  # fmt: skip
        content = {"log": {"time": np.array(T), "signals": signals, "blockName": "x"}}
    else:
        signals[:] = [{"Name": "angle", "Data": Q, "XIndex": 1.0},
                      {"Name": "drive", "Data": T, "XIndex": 1.0}]  # fmt: skip
        content = {"log": {"X": {"Name": "time", "Data": T}, "Y": signals}}
    scipy.io.savemat(path, content)
    found = {one.header: one.values for one in read_unknown(path).columns if not one.unusable}
    assert found["angle"].tolist() == Q
    assert found["drive"][10] == 0.1
    clock = next(name for name in found if name not in ("angle", "drive"))
    assert found[clock].tolist() == T
    table = read_table(path, FileSpec(rows="log"))
    assert table.column("angle", "a")[10] == 3.0


def test_two_vectors_of_one_name_keep_apart() -> None:
    found = vectors_of({"x": [{"name": "a", "v": Q}, {"name": "a", "v": T}]})
    assert [one[10] for one in found.values()] == [3.0, 0.1]
    assert len(found) == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"t": [0, 1, 2', "ends in the middle.*copy it again"),
        ('{"t": 0}\n{"t": 1\n{"t": 2}\n', "line 2, column 1 is no JSON"),
        ('{"t": [0, 1, x]}', "line 1, column 14 is no JSON"),
    ],
)
def test_what_is_wrong_with_a_json_is_said(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(text, "utf-8")
    with pytest.raises(BadLog, match=said) as refused:
        read_table(path, FileSpec())
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("end", ["\n", "", '\n{"t": 0.9, "motor": {"q"'])
def test_a_json_value_a_line_is_a_row(end: str, tmp_path: Path) -> None:
    """As telemetry is written, killed while it writes or not."""
    rows = [json.dumps({"t": t, "motor": {"q": q}}) for t, q in zip(T, Q, strict=True)]
    path = tmp_path / "a.jsonl"
    path.write_text("\n".join(rows) + end, "utf-8")
    found = {one.header: one.values.tolist() for one in read_unknown(path).columns}
    assert found == {"t": T, "q": Q}


def test_text_in_brackets_is_no_json(tmp_path: Path) -> None:
    rows = [f"{k}\t{k % 7}" for k in range(N)]
    (tmp_path / "a.txt").write_text("\n".join(["[Recording]", "t\tq", *rows]), "utf-8")
    assert [one.header for one in read_unknown(tmp_path / "a.txt").columns] == ["t", "q"]


def test_a_whole_file_of_another_layout_is_not_called_damaged_alone() -> None:
    said = str(damaged(Path("a.mat"), "mat", ValueError("odd")))
    assert "damaged or cut off, or laid out as is not read here" in said
