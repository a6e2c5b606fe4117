"""Arrays as NumPy saves them (`.npy`, `.npz`); what is pickled in them is never opened."""

from pathlib import Path

import numpy as np

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.cards.nearest import nearest
from workbench.files import refuse_larger
from workbench.logs.table import BINARY_BYTES, RawColumn, Table, of_matrix, of_vectors, refuse_long


def read_numpy(path: Path, spec: FileSpec) -> Table:
    """The columns of an array, of its named fields, or of an archive's arrays.

    `rows` of the spec names one array of an archive. Raises BadLog, one line, where an array holds
    Python objects, or none holds rows and columns.
    """
    refuse_larger(path, BINARY_BYTES, "a NumPy file", BadLog)
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return _table(path, loaded, spec)
        with loaded as archive:
            found = {name: archive[name] for name in archive.files}
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        raise BadLog(
            f"{path}: holds Python objects (an array of dtype object), which are never unpickled;"
            " save the numbers alone: np.save(file, np.asarray(rows, dtype=float))"
        ) from None
    return _of_archive(path, found, spec)


def _of_archive(path: Path, found: dict[str, RawColumn], spec: FileSpec) -> Table:
    if spec.rows:
        if spec.rows not in found:
            raise BadLog(f"{path}: no array {spec.rows!r}{nearest(spec.rows, found)}")
        return _table(path, found[spec.rows], spec)
    vectors = {name: np.atleast_1d(np.squeeze(x)) for name, x in found.items()}
    flat = {name: x for name, x in vectors.items() if x.ndim == 1}
    long = max((x.size for x in flat.values()), default=0)
    matrices = [x for x in vectors.values() if x.ndim == 2]
    if matrices and long < max(max(x.shape) for x in matrices):
        return _table(path, max(matrices, key=lambda x: x.size), spec)
    for name, x in vectors.items():
        refuse_long(path, max(x.shape, default=0))
        if x.ndim == 2 and long in x.shape:  # a row, or a column, an axis
            each = x if x.shape[1] == long else x.T
            flat |= {f"{name}_{k}": row for k, row in enumerate(each)}
    return of_vectors(flat, spec)


def _table(path: Path, values: RawColumn, spec: FileSpec) -> Table:
    refuse_long(path, max(values.shape, default=0))
    if values.dtype.names:
        return of_vectors({name: values[name] for name in values.dtype.names}, spec)
    return of_matrix(path, np.squeeze(values), spec)
