"""Writers of small logs in every format, for the tests of readers."""

import json
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io

from identification.arrays import Array
from tests.workbench.channel_files import (
    write_mcap,
    write_mdf,
    write_tdms,
    write_ulog,
    write_xlsx,
)
from workbench.cards.card import Card, load_card

Signals = Mapping[str, Array]

CARD = """
[card]
name = "bench"
[rig]
kind = "force"
[signals]
t = { column = "t", unit = "s" }
y = { column = "y", unit = "m" }
F = { column = "F", unit = "N" }
"""


def card(folder: Path, text: str = CARD) -> Card:
    """The card of that text, written into the folder."""
    path = folder / "card.toml"
    path.write_text(text, encoding="utf-8")
    return load_card(path)


def signals(n: int = 400, h: float = 0.01) -> dict[str, Array]:
    """A body sliding to and fro against friction."""
    t = h * np.arange(n)
    w = 2.0 * np.pi
    y, v = 0.1 * np.sin(w * t), 0.1 * w * np.cos(w * t)
    return {"t": t, "y": y, "F": 10.0 * np.sign(v) + 20.0 * v}


def write_csv(path: Path, columns: Signals, delimiter: str = ",", decimal: str = ".") -> None:
    """A CSV with header, numbers printed so that they read back to the same bits."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [delimiter.join(columns)]
    lines += [delimiter.join(repr(v).replace(".", decimal) for v in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_parquet(path: Path, columns: Signals) -> None:
    """A Parquet file of float64 columns."""
    pq.write_table(pa.table({name: pa.array(v) for name, v in columns.items()}), path)


def write_mat(path: Path, columns: Signals) -> None:
    """A MAT v5 file of column vectors."""
    scipy.io.savemat(str(path), {name: v[:, None] for name, v in columns.items()})


def write_mat73(path: Path, columns: Signals) -> None:
    """A MAT v7.3 file as MATLAB lays it out: HDF5 after 512 bytes, vectors transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file[name] = values[None, :]
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_hdf5(path: Path, columns: Signals) -> None:
    """An HDF5 file of one-dimensional data sets."""
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file[name] = values


def write_json(path: Path, columns: Signals) -> None:
    """A JSON list of records."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    path.write_text(json.dumps([dict(zip(columns, row, strict=True)) for row in rows]), "utf-8")


WRITERS = {
    "a.csv": write_csv,
    "a.parquet": write_parquet,
    "a.mat": write_mat,
    "a73.mat": write_mat73,
    "a.h5": write_hdf5,
    "a.json": write_json,
    "a.tdms": write_tdms,
    "a.mf4": write_mdf,
    "a.mcap": write_mcap,
    "a.ulg": write_ulog,
    "a.xlsx": write_xlsx,
}
