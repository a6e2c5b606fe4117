"""What a log tells of its own noise."""

import numpy as np
import pytest

from identification.evidence import Rows, moving, solve
from identification.log import Log


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_noise_is_never_nothing(noise: float) -> None:
    # A position that stands for most of its log to the last digit has no third differences there.
    t = 2e-3 * np.arange(4000, dtype=np.float64)
    swing = 0.05 * np.sin(2.0 * np.pi * np.clip(t - 6.0, 0.0, None))
    y = swing + np.where(t > 6.0, noise, 0.0) * np.random.default_rng(3).standard_normal(len(t))
    log = Log("stands", {"t": t, "y": y, "F": np.cos(t)})
    assert 0.0 < moving(log, held=False, by_command=False).noise_y < 1e-3


def test_what_no_row_tells_comes_out_as_nothing() -> None:
    rng = np.random.default_rng(0)
    X = np.column_stack([rng.standard_normal(40), np.zeros(40)])
    one = np.ones(40)
    rows = Rows(3.0 * X[:, 0], X, one, np.zeros(40, dtype=np.int64), one, ("m", "F_cp"))
    assert solve(rows).theta == pytest.approx([3.0, 0.0], abs=1e-12)
