"""Layouts of files as people have them: clocks, headers and containers of many kinds.

Each takes named columns, the clock first, and writes one file: it gives its path. `part` is that of
the words: layouts of "judge" differ in detail from those of "choose".
"""

import json
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from identification.arrays import Array

Columns = Sequence[tuple[str, Array]]
Layout = Callable[[Path, Columns, np.random.Generator, str], Path]
BAG_TYPE = "sensor_msgs/msg/JointState"


def plain(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """A table with a line of names."""
    return _csv(path, [[name for name, _ in columns]], _rows(columns), ",")


def clock_pairs(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """A clock for each signal, a pair of columns each, one of them a row shorter."""
    (clock, t), *rest = columns
    step = float(t[1] - t[0])
    names, parts = list[str](), list[list[str]]()
    for k, (name, x) in enumerate(rest):
        late = step * k / (3.0 * len(rest))
        own, values = _cells(t), _cells(np.interp(t + late, t, x))
        own = _cells(t + late)
        if k % 2:
            own[-1] = values[-1] = ""
        called = f"{clock} {k + 1}" if part == "choose" else f"{name} {clock}"
        names += [called, name]
        parts += [own, values]
    mark = ";" if part == "judge" else ","
    return _csv(path, [names], list(zip(*parts, strict=True)), mark)


def two_clocks(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """Two instruments beside each other, each with its clock; the second begins a little later."""
    (clock, t), *rest = columns
    half = max(1, len(rest) // 2)
    late = 0.4 * float(t[1] - t[0])
    other = [(name, np.interp(t + late, t, x)) for name, x in rest[half:]]
    first, second = ("drive", "daq") if part == "choose" else ("A", "B")
    table = [(f"{clock}_{first}", t), *rest[:half], (f"{clock}_{second}", t + late), *other]
    return plain(path, table, rng, part)


def stamps(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """Stamps as ISO 8601 writes them, with a zone."""
    (clock, t), *rest = columns
    second = 1.0 if t[-1] < 1000.0 else 1e-3
    begun = datetime(2025, 3, 9, 11, 59, 50, tzinfo=UTC)
    moments = [begun + timedelta(seconds=float(one) * second) for one in t]
    cells = [one.isoformat(timespec="microseconds") for one in moments]
    if part == "judge":
        cells = [one.replace("+00:00", "+0100") for one in cells]
    rows = [[cell, *row] for cell, row in zip(cells, _rows(rest), strict=True)]
    return _csv(path, [[clock, *(name for name, _ in rest)]], rows, ",")


def ticks(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """A clock in ticks: since 1601 by 100 ns, or of a microsecond's counter."""
    (clock, t), *rest = columns
    if part == "choose":
        cells = [str(133_500_000_000_000_000 + round(float(one) * 1e7)) for one in t]
    else:
        cells = [str(4_100_000 + round(float(one) * 1e6)) for one in t]
    rows = [[cell, *row] for cell, row in zip(cells, _rows(rest), strict=True)]
    return _csv(path, [[clock, *(name for name, _ in rest)]], rows, ",")


def ugly(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """Leading spaces, a nameless index, columns of "|", empty cells at the end, nan here and there,
    and one name twice."""
    names, cells = [""], [[str(k) for k in range(len(columns[0][1]))]]
    for k, (name, x) in enumerate(columns):
        own = _cells(x)
        if k > 1:
            for at in rng.integers(100, len(own) - 100, 3):
                own[at] = "nan" if part == "choose" else "NaN"
        names.append(f" {name}")
        cells.append(own)
        if k == 1:
            names.append("|" if part == "choose" else " ")
            cells.append(["|"] * len(own))
    names.append(names[-1])
    cells.append(["0.0"] * len(cells[0]))
    rows = [[*row, "", ""] for row in zip(*cells, strict=True)]
    rows[-1] = [*rows[-1][:-3], "", "", ""]
    return _csv(path, [[*names, "", ""]], rows, ",")


def instrument(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """Lines of an instrument above the names, and a row of units where the names have brackets."""
    names, units = list[str](), list[str]()
    for name, _ in columns:
        head, _, unit = name.partition(" [")
        names.append(head)
        units.append(unit.rstrip("]"))
    if part == "choose":
        above = [["Recorder", "MX-4 rev. 2.1"], ["Start", "2025-02-11 09:30:12"],
                 ["Sample rate", "500 Hz"], [""]]  # fmt: skip
    else:
        above = [["// Aufzeichnung 17"], ["// Takt;2,0"], ["Kanäle", str(len(names))],
                 ["Datei", "C:\\mess\\a.dat"]]  # fmt: skip
    heads = [*above, names, *([units] if any(units) else [])]
    return _csv(path, heads, _rows(columns), "\t" if part == "choose" else ";")


def headless(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """No names at all."""
    return _csv(path, [], _rows(columns), "\t" if part == "choose" else " ")


def array(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """An array of rows, or of columns, or an archive of vectors and one array."""
    table = np.column_stack([x for _, x in columns])
    if part == "choose":
        path = path.with_suffix(".npy")
        np.save(path, table.T if rng.random() < 0.5 else table)
        return path
    path = path.with_suffix(".npz")
    named = {
        "time": columns[0][1],
        "data": table[:, 1:],
        "names": np.array([n for n, _ in columns]),
    }
    np.savez(path, **named)  # type: ignore[arg-type]
    return path


def struct(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """A MATLAB struct of a trace: time with an array of signals, or axes X and Y."""
    import scipy.io

    path = path.with_suffix(".mat")
    (_, t), *rest = columns
    if part == "choose":
        signals = np.empty(len(rest), dtype=object)
        for k, (name, x) in enumerate(rest):
            signals[k] = {"values": x[:, None], "label": name, "dimensions": 1.0}
        content = {"logsout": {"time": t[:, None], "signals": signals, "blockName": "m/Scope"}}
    else:
        y = np.empty(len(rest), dtype=object)
        for k, (name, x) in enumerate(rest):
            y[k] = {"Name": name, "Data": x[None, :], "XIndex": 1.0, "Unit": ""}
        content = {"rec_003": {"X": {"Name": "time", "Data": t[None, :]}, "Y": y,
                               "Description": "capture"}}  # fmt: skip
    scipy.io.savemat(path, content)
    return path


def rollouts(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """JSON of a rollout: lists in tables in each other, or a list of steps with tables in them."""
    path = path.with_suffix(".json")
    (clock, t), *rest = columns
    half = max(1, len(rest) // 2)
    if part == "choose":
        content: object = {
            "meta": {"seed": 3, "policy": "pd"},
            "rollout": {clock: t.tolist(), "obs": {n: x.tolist() for n, x in rest[:half]},
                        "act": {n: x.tolist() for n, x in rest[half:]}},
        }  # fmt: skip
    else:
        content = {"episodes": [{"id": 0, "steps": [
            {clock: float(t[k]), "state": {n: float(x[k]) for n, x in rest[:half]},
             "action": [float(x[k]) for _, x in rest[half:]]} for k in range(len(t))
        ]}]}  # fmt: skip
    path.write_text(json.dumps(content), "utf-8")
    return path


def bag(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """A bag of ROS 1 with the states of one joint, and a second topic where there is a fourth."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    path = path.with_suffix(".bag")
    store = get_typestore(Stores.ROS1_NOETIC)
    state, header = store.types[BAG_TYPE], store.types["std_msgs/msg/Header"]
    stamp, number = store.types["builtin_interfaces/msg/Time"], store.types["std_msgs/msg/Float64"]
    (_, t), y, drive, *rest = columns
    writer = Writer(path)
    if part == "judge":
        writer.set_compression(writer.CompressionFormat.BZ2)
    with writer:
        joint = writer.add_connection("/joint_states", BAG_TYPE, typestore=store)
        others = [
            writer.add_connection(f"/extra_{k}", "std_msgs/msg/Float64", typestore=store)
            for k in range(len(rest))
        ]
        for k, at in enumerate(t):
            ns = 1_700_000_000_000_000_000 + round(float(at) * 1e9)
            head = header(k, stamp(ns // 10**9, ns % 10**9), "base")
            values = (np.array([x[k]]) for x in (y[1], rest[0][1] if rest else y[1], drive[1]))
            message = state(head, ["joint_1"], *values)
            writer.write(joint, ns, store.serialize_ros1(message, BAG_TYPE))
            for own, (_, x) in zip(others, rest, strict=True):
                data = store.serialize_ros1(number(float(x[k])), "std_msgs/msg/Float64")
                writer.write(own, ns, data)
    return path


def blocks(path: Path, columns: Columns, rng: np.random.Generator, part: str) -> Path:
    """A trace of a PLC's engineering tool: a block of lines for each variable."""
    (clock, t), *rest = columns
    lines = ["Trace;TRACE_1", "Task;MotionTask", ""] if part == "choose" else ["[Recording]"]
    for k, (name, x) in enumerate(rest):
        head = (
            [f"Variable;PLC_PRG.{name}", "Type;LREAL", f"{clock};Value"]
            if part == "choose"
            else [f"[Channel{k + 1}]", f"Name={name}", f"Samples={len(x)}"]
        )
        mark = ";" if part == "choose" else "\t"
        rows = [mark.join(row) for row in zip(_cells(t), _cells(x), strict=True)]
        lines += [*head, *(rows[:-1] if k == 1 else rows), ""]
    path = path.with_suffix(".csv" if part == "choose" else ".txt")
    path.write_text("\n".join(lines), "utf-8")
    return path


def _cells(x: Array) -> list[str]:
    return [f"{one:.10g}" for one in x.tolist()]


def _rows(columns: Columns) -> list[tuple[str, ...]]:
    return list(zip(*(_cells(x) for _, x in columns), strict=True))


def _csv(
    path: Path, heads: Sequence[Sequence[str]], rows: Sequence[Sequence[str]], mark: str
) -> Path:
    path = path.with_suffix(".csv")
    path.write_text("\n".join(mark.join(row) for row in (*heads, *rows)) + "\n", "utf-8")
    return path
