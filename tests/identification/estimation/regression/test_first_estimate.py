"""First estimates: near enough to centre a search, and a refusal where nothing moves."""

import numpy as np
import pytest

from identification.errors import NotIdentifiable
from identification.estimation.regression.first_estimate import first_estimate
from identification.estimation.regression.motion_log import motion_log
from tests.identification.plants import made_log, table


@pytest.mark.parametrize("number", [1, 2, 3])
def test_sliding_and_breakaway_are_near(number: int) -> None:
    truth = table(number)
    first = first_estimate(motion_log(made_log(truth, seed=number), zoh=False, by_command=False))
    nine = dict(zip(truth.__dataclass_fields__, first.nine, strict=True))
    assert nine["m"] == pytest.approx(truth.m, rel=0.5)
    for name in ("F_cp", "F_cn", "F_vp", "F_vn"):
        assert nine[name] == pytest.approx(getattr(truth, name), rel=0.25)
    # Smoothing makes the body seem to rest while its force already grows.
    for name in ("F_sp", "F_sn"):
        assert nine[name] == pytest.approx(getattr(truth, name), rel=1.0)
    magnitudes = np.abs(truth.array)
    assert np.all(first.low < magnitudes)
    assert np.all(magnitudes < first.high)


def test_a_still_log_is_refused() -> None:
    log = made_log(table(2), seconds=2.0)
    y = 1e-5 * np.random.default_rng(0).standard_normal(len(log))
    with pytest.raises(NotIdentifiable, match="no motion above the noise"):
        first_estimate(motion_log(log.with_signals(y=y), zoh=False, by_command=False))
