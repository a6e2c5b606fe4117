"""What a log tells of its own noise."""

import numpy as np
import pytest

from identification.errors import BadLog
from identification.estimation.regression.motion_log import LEAST_PART, motion_log, shortened
from identification.estimation.regression.weighted_rows import Rows, solve_rows
from identification.log import Log


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_noise_is_never_nothing(noise: float) -> None:
    # A position that stands for most of its log to the last digit has no third differences there.
    t = 2e-3 * np.arange(4000, dtype=np.float64)
    swing = 0.05 * np.sin(2.0 * np.pi * np.clip(t - 6.0, 0.0, None))
    y = swing + np.where(t > 6.0, noise, 0.0) * np.random.default_rng(3).standard_normal(len(t))
    log = Log("stands", {"t": t, "y": y, "F": np.cos(t)})
    assert 0.0 < motion_log(log, zoh=False, by_command=False).noise.y < 1e-3


def test_what_no_row_tells_comes_out_as_nothing() -> None:
    rng = np.random.default_rng(0)
    X = np.column_stack([rng.standard_normal(40), np.zeros(40)])
    one = np.ones(40)
    rows = Rows(3.0 * X[:, 0], X, one, np.zeros(40, dtype=np.int64), one, ("m", "F_cp"))
    assert solve_rows(rows).theta == pytest.approx([3.0, 0.0], abs=1e-12)


def standing(h: float = 2e-3, n: int = 20_000) -> Log:
    """A log that stands on one count of its encoder for 12 s, and then swings."""
    t = h * np.arange(n, dtype=np.float64)
    swing = 0.05 * np.sin(2.0 * np.pi * 0.7 * np.clip(t - 12.0, 0.0, None))
    return Log("stands", {"t": t, "y": 2e-5 * np.round(swing / 2e-5), "F": np.cos(t)})


def test_a_part_of_a_log_begins_where_the_body_does_and_has_the_noise_of_the_whole() -> None:
    one = motion_log(standing(), zoh=False, by_command=False)
    part = shortened(one, 5.0)
    assert 11.0 < part.log["t"][0] < 12.0
    assert len(part.log) == 2500
    assert (part.noise.y, part.noise.F) == (one.noise.y, one.noise.F)
    assert shortened(one, 100.0).log.signals.keys() == one.log.signals.keys()
    slow = motion_log(standing(0.2, 500), zoh=False, by_command=False)
    assert len(shortened(slow, 5.0).log) == LEAST_PART  # fewer samples show no motion


def test_a_log_shorter_than_one_stretch_is_refused() -> None:
    n = 5000
    t = 1e-5 * np.arange(n, dtype=np.float64)
    log = Log("short", {"t": t, "y": np.sin(100.0 * t), "F": np.cos(100.0 * t)})
    with pytest.raises(BadLog, match=r"short: 5000 samples in 0\.05 s, 6001 needed"):
        motion_log(log, zoh=False, by_command=False)
