"""Columns on clocks of their own in one table: pairs, two instruments, and what is none."""

from pathlib import Path

import numpy as np

from identification.arrays import Array
from workbench.cards.card import load_card
from workbench.logs.runs import read_log
from workbench.logs.unknown import read_unknown

T: Array = np.asarray(2e-3 * np.arange(600), dtype=np.float64)
Y: Array = 0.1 * np.sin(6.0 * T)
F: Array = np.cos(6.0 * T)


def write(path: Path, names: str, *columns: Array, shorter: int = 0) -> Path:
    """A table; the last `shorter` columns lack their last row."""
    rows = [[f"{one:.10g}" for one in row] for row in np.column_stack(columns).tolist()]
    if shorter:
        rows[-1][-shorter:] = [""] * shorter
    path.write_text("\n".join([names, *(",".join(row) for row in rows)]), "utf-8")
    return path


def test_pairs_are_read_on_one_clock(tmp_path: Path) -> None:
    late = T + 7e-4
    path = write(tmp_path / "run.csv", "t1,pos,t2,force", T, Y, late, np.cos(6.0 * late), shorter=2)
    (tmp_path / "card.toml").write_text(
        '[card]\nname = "a"\n[rig]\nkind = "force"\n[signals]\n'
        't = { column = "t1", unit = "s" }\ny = { column = "pos", unit = "m" }\n'
        'F = { column = "force", unit = "N" }\n',
        "utf-8",
    )
    log = read_log(path, load_card(tmp_path / "card.toml"))
    assert np.max(np.abs(log["F"] - np.cos(6.0 * log["t"]))[:-1]) < 1e-3
    raw = {one.header: one for one in read_unknown(path).columns}
    whole = np.isfinite(raw["force"].values)
    assert np.mean(whole) > 0.99
    assert np.max(np.abs(raw["force"].values[whole] - F[: len(whole)][whole])) < 1e-3
    assert raw["t2"].unusable == "the clock of 'force'"
