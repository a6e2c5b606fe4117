"""What the plain model of a motor's logs is used for: a reference, and whether to look further."""

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.log import Rig
from identification.thresholds import ADEQUATE
from identification.tracing import plain_model as module
from identification.tracing.plain_model import PlainModel, plain_model
from identification.tracing.recorded_rows import recorded_rows
from tests.identification.motor_logs import K_A, made

RIG = Rig("motor", force_per_command=K_A)
COGGING = {"cogging": {"a": 1.5, "b": 0.0, "period": 0.012}}


def plain_of(effects: dict[str, dict[str, float]] | None) -> PlainModel:
    library = built_in()
    rows = recorded_rows([made(4, effects)], RIG)
    return plain_model(rows, library, np.random.default_rng(0))


@pytest.mark.slow
def test_only_a_plant_that_is_followed_says_how_far_noise_drifts() -> None:
    followed, lost = plain_of(None), plain_of(COGGING)
    assert followed.model.misfit <= ADEQUATE < lost.model.misfit
    assert [one.reference for one in followed.rows.logs] == [followed.model.plant.friction]
    assert [one.reference for one in lost.rows.logs] == [None]


@pytest.mark.slow
def test_nothing_is_looked_for_only_where_run_and_equations_leave_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert not plain_of(None).library
    assert plain_of(COGGING).library
    monkeypatch.setattr(module, "misfit", lambda *_, **__: 1.0)  # a run that is followed
    assert plain_of(COGGING).library == built_in()
