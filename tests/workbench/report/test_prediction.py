"""The table of a prediction, whatever its clock counts from."""

from io import StringIO

import numpy as np
import pandas as pd
import pytest

from design.machine.readable import Display
from design.measured.predicted_logs import Predicted
from workbench.report.prediction import csv_text, error_lines


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


def test_a_prediction_that_is_worse_than_none_is_said_so() -> None:
    summary = {"drive": "force", "window": None, "position_rms": None, "run_refused": None,
               "force_predicted_rms": 167.0, "force_simulated_rms": None}  # fmt: skip
    for applied, worse in (
        (60.0, ": worse than none, whose error is the force, 60 N rms"),
        (200.0, ""),
    ):
        for inertia, noise in ((True, ", the acceleration's noise in it"), (False, "")):
            found = Predicted((), {**summary, "force_applied_rms": applied}, inertia)
            said = f"force, inverse model: error 167 N rms while sliding{noise}{worse}"
            assert error_lines(found, Display()) == [said]


@pytest.mark.parametrize(("steady", "said"), [(3.0, ", 3 N off starts and stops"), (30.0, "")])
def test_starts_and_stops_that_make_most_of_the_error_are_told_apart(
    steady: float, said: str
) -> None:
    summary = {"drive": "force", "window": None, "position_rms": None, "run_refused": None,
               "force_predicted_rms": 40.0, "force_steady_rms": steady, "force_applied_rms": 90.0,
               "force_simulated_rms": None}  # fmt: skip
    (line,) = error_lines(Predicted((), summary, inertia=False), Display())
    assert line == f"force, inverse model: error 40 N rms while sliding{said}"
