"""What a response says of friction."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from workbench.report.response import friction_line


def test_a_response_that_shows_no_frequency_says_so() -> None:
    """It ended in an IndexError, and the whole report with it."""
    body = SimpleNamespace(seen=np.zeros(3, dtype=np.bool_))
    found: Any = SimpleNamespace(left_in=None, found=SimpleNamespace(f=np.ones(3), body=body))
    assert "no frequency" in friction_line(found)
