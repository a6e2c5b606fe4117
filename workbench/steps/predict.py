"""The table of what a model predicts of a log."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from design.measured.predict import Prediction

if TYPE_CHECKING:
    import pandas as pd

PREDICTION_COLUMNS = (
    "t",
    "force_applied",
    "force_predicted",
    "force_simulated",
    "position_measured",
    "position_simulated",
)


def prediction_frame(found: Sequence[Prediction]) -> "pd.DataFrame":
    """The columns of prediction.csv of the runs of one log; NaN where there is no value."""
    import pandas as pd

    frames = [
        pd.DataFrame({name: getattr(one, name) for name in PREDICTION_COLUMNS}) for one in found
    ]
    return pd.concat(frames, ignore_index=True)
