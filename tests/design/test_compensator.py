from dataclasses import FrozenInstanceError

import pytest

from design.compensator import Compensator
from identification.errors import BadModel
from identification.karnopp import Karnopp

FRICTION = Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.04, -0.04, 20.6, -23.0)


def test_narrow_band_is_the_band_over_N_c() -> None:
    c = Compensator(FRICTION, N_c=2.0, e_T=0.003)
    assert (c.dv_p1, c.dv_n1) == (0.02, -0.02)
    with pytest.raises(FrozenInstanceError):
        c.N_c = 3.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("N_c", "e_T", "text"),
    [
        (1.0, 0.003, "N_c"),
        (float("nan"), 0.003, "N_c"),
        (2.0, 0.0, "e_T"),
        (2.0, float("inf"), "e_T"),
    ],
)
def test_bad_parameters_are_refused(N_c: float, e_T: float, text: str) -> None:
    with pytest.raises(BadModel, match=text):
        Compensator(FRICTION, N_c, e_T)
