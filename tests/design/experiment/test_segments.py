"""Pieces of a reference: they begin and end at home, and keep the limits that a reference can."""

import numpy as np
import pytest

from design.experiment.limits import MotionLimits, Peaks
from design.experiment.segments import allowed, library, reference
from identification.errors import BadSpecification

LIMITS = MotionLimits((-0.02, 0.1), 0.3, 12.0)


@pytest.mark.parametrize("h", [1e-3, 4e-3])
def test_every_piece_stays_within_the_stroke_and_ends_at_home(h: float) -> None:
    kinds = set()
    for one in library(LIMITS):
        if not allowed(one, LIMITS, h):
            continue
        kinds.add(one.kind)
        r = one.signal(h)
        assert np.max(np.abs(r)) <= LIMITS.reach * (1.0 + 1e-9), one
        assert not np.any(r[-round(0.3 / h) :]), one
        if one.kind in ("strokes", "creep"):
            assert np.max(np.abs(np.diff(r))) / h <= LIMITS.speed * 1.01, one
    assert kinds == {"steps", "strokes", "creep", "sine", "sweep", "stairs", "multisine"}


def test_a_reference_lasts_as_long_as_asked_about_home() -> None:
    parts = tuple(one for one in library(LIMITS) if one.kind == "steps")[:2]
    r = reference(parts, LIMITS, 2e-3)
    assert len(r) == 6000
    assert r[0] == r[-1] == pytest.approx(0.04)
    assert np.ptp(r) > 0.0


def test_a_change_keeps_the_kind() -> None:
    one = next(iter(library(LIMITS)))
    other = one.changed(0.5, 2.0)
    assert (other.kind, other.amplitude, other.rate) == (
        one.kind, 0.5 * one.amplitude, 2.0 * one.rate
    )  # fmt: skip


@pytest.mark.parametrize(
    ("peaks", "names"),
    [
        (Peaks(-0.01, 0.09, 0.2, 5.0, 1.0), ()),
        (Peaks(-0.021, 0.09, 0.2, 5.0, 1.0), ("stroke",)),
        (Peaks(-0.01, 0.09, 0.31, 21.0, 4.0), ("speed", "force", "command")),
    ],
)
def test_what_exceeds_a_limit_is_named(peaks: Peaks, names: tuple[str, ...]) -> None:
    limits = MotionLimits((-0.02, 0.1), 0.3, 12.0, 20.0, 3.0)
    assert peaks.exceeded(limits) == names
    assert (peaks.share_of(limits) > 1.0) == bool(names)


def test_limits_without_room_are_refused() -> None:
    with pytest.raises(BadSpecification, match="must be the lower"):
        MotionLimits((0.1, 0.1), 0.3, 12.0)
    with pytest.raises(BadSpecification, match="speed"):
        MotionLimits((0.0, 0.1), 0.0, 12.0)
