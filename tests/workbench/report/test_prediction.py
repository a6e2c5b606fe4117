"""The table of a prediction, whatever its clock counts from."""

from io import StringIO

import numpy as np
import pandas as pd
import pytest

from workbench.report.prediction import csv_text


@pytest.mark.parametrize("begin", [0.0, 12.0, 1_695_000_000.0])
@pytest.mark.parametrize("step", [2.5e-4, 4e-3, 1.0])
def test_times_stay_apart_however_far_from_zero(begin: float, step: float) -> None:
    """A log that counts from 1970 had the same time in all rows of its prediction."""
    t = begin + step * np.arange(200)
    text = csv_text(pd.DataFrame({"t": t, "y": np.full(200, np.nan)}), 10)
    found = pd.read_csv(StringIO(text))
    np.testing.assert_allclose(np.diff(found["t"]), step, rtol=0.01)
    np.testing.assert_allclose(found["t"], t, rtol=0.0, atol=0.01 * step)
    assert found["y"].isna().all()
