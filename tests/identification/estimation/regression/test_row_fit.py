"""Rows of an equation solved for their sizes: which of them count."""

from dataclasses import replace

import pytest

from identification.effects._library import built_in
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.row_fit import base_fits, first_stage, with_sizes
from tests.identification.motor_logs import made, seen

DIP = {"stribeck": {"F_s": 6.0, "v_s": 0.02, "asymmetry": 0.0, "delta": 2.0}}


@pytest.mark.parametrize("band", [0.0, 0.012])
def test_no_sliding_above_a_known_band_is_left_out(band: float) -> None:
    """It hid a dip of a fifth of the Coulomb level in slow motion of which there was little."""
    start, first = first_stage([seen(made(4, DIP))], False)
    found = base_fits(replace(start, band=band))[MECHANICAL]
    assert first[MECHANICAL].slowest > 0.012
    assert (found.slowest <= 0.012) == (band > 0.0)


def test_a_size_of_which_no_equation_is_there_stays_as_it_is() -> None:
    """Of the stick force after rests, in a log without breakaways: it ended in an error of ours."""
    rising = built_in()["rising_stiction"]
    shape = {p.name: p.typical or 1.0 for p in rising.params}
    _, first = first_stage([seen(made(4))], False, (MECHANICAL,))
    assert with_sizes(rising, shape, first) == pytest.approx(shape)
