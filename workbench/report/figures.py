"""Figures of matplotlib for notebooks and PNG files: one look, labelled axes."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.arrays import Array, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's colours, which colour-blind readers can distinguish.
MEASURED, MODEL, REFERENCE, OTHER = "#000000", "#d55e00", "#0072b2", "#009e73"
BAND = "#e69f00"
GREY = "#7a7a7a"
BEFORE = "#8a8a8a"
LINE_POINTS = 1200  # of a line; more than a screen shows
SCATTER = 6000
SHOWN_SHARE = 0.995  # of the points that axes hold; the rarest would flatten the rest
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.size": 9.0,
    "font.family": "sans-serif",
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.constrained_layout.use": True,
}


@contextmanager
def style() -> Iterator[None]:
    """Matplotlib in the reports' look, as it was afterwards."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        yield


def figure(width: float, height: float) -> "Figure":
    """An empty figure [inch] without a window; a notebook shows it, whatever its backend."""
    return _shown_figure()(figsize=(width, height))


@cache
def _shown_figure() -> "type[Figure]":
    from matplotlib.figure import Figure

    class ShownFigure(Figure):
        def _repr_png_(self) -> bytes:
            out = io.BytesIO()
            self.savefig(out, format="png", dpi=110)
            return out.getvalue()

    return ShownFigure


def line(axes: "Axes", x: Array, y: Array, **look: Any) -> None:
    """A line of at most `LINE_POINTS` points that keeps every peak."""
    axes.plot(*thinned(x, y), **look)


def thinned(x: Array, y: Array, points: int = LINE_POINTS) -> tuple[Array, Array]:
    """Lowest and highest sample of equal blocks, in the order of time."""
    n = len(x)
    if n <= points:
        return x, y
    size = int(np.ceil(2 * n / points))
    count = n // size
    blocks = y[: count * size].reshape(count, size)
    first = np.arange(count) * size
    ends = np.sort(np.stack([blocks.argmin(axis=1), blocks.argmax(axis=1)]), axis=0) + first
    index = np.unique(np.concatenate([[0], ends.T.ravel(), [n - 1]]))
    return x[index], y[index]


def evenly_spread(count: int, most: int = SCATTER) -> IntArray:
    """Indices of at most `most` of `count` points, evenly spread."""
    step = max(1, -(-count // most))
    return np.arange(0, count, step, dtype=np.int64)


def label(axes: "Axes", x: str, y: str, title: str = "") -> None:
    """Axis labels with units and a small title."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left", fontsize=9.5)
