"""When a force is taken to be held between its samples: where the position is likelier so."""

import numpy as np
import pytest

from identification.estimation import force_hold
from identification.estimation.force_hold import whole_samples_late
from identification.log import Log

N = 10
LOG = Log("rod", {"t": 1e-3 * np.arange(float(N)), "y": np.zeros(N), "F": np.ones(N)})


@pytest.mark.parametrize(
    ("line", "late", "zoh", "until", "half", "whole"),
    [
        (0.0, 0.0, 20.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 20.0, 0.0, -1.0),
        (0.0, 0.0, 10.0, 0.0, 0.0, None),  # no more than chance
        (0.0, 15.0, 20.0, 0.0, 0.0, None),  # a line so late does as well
        (0.0, 0.0, 20.0, 0.0, 30.0, 0.0),  # a smooth force that is held looks half a sample late
        (0.0, 0.0, 20.0, 0.0, 40.0, None),  # and one that is late is not held
    ],
)
def test_the_likelier_instant_is_taken(
    line: float, late: float, zoh: float, until: float, half: float, whole: float | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    likely = np.array([line, late, zoh, until, half, 0.0])
    monkeypatch.setattr(force_hold, "sliding_likelihoods", lambda *_, **__: likely)
    assert whole_samples_late([LOG], 3.0, rotary=True) == whole


def test_nothing_is_said_of_a_log_without_inertia(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(force_hold, "sliding_likelihoods", lambda *_, **__: None)
    assert whole_samples_late([LOG], 0.0, rotary=False) is None
