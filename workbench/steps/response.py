"""The table of a frequency response."""

from typing import TYPE_CHECKING

from design.measured.response import Responded
from design.measured.response_columns import response_columns

if TYPE_CHECKING:
    import pandas as pd


def response_frame(found: Responded) -> "pd.DataFrame":
    """The columns of response.csv, a row a frequency; NaN where nothing is seen."""
    import pandas as pd

    return pd.DataFrame(response_columns(found))
