"""What trials of structures need, of logs and a plain model that a test has made."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.effects._base import Effect
from identification.effects._library import Library
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.row_fit import RowFit
from identification.estimation.structure_fit import FittedStructure
from identification.log import Rig
from identification.model.estimates import Drive
from identification.tracing.free_run.backward_elimination import Setting
from identification.tracing.plain_model import PlainModel
from identification.tracing.recorded_rows import RecordedRows
from identification.tracing.regression.candidates import EffectCandidate, first_shape, refined
from tests.identification.motor_logs import K_A

MOTOR = Rig("motor", force_per_command=K_A)


def setting_of(
    logs: Sequence[MotionLog], model: FittedStructure, library: Library, rng: np.random.Generator,
    drive: Drive = "command",
) -> Setting:  # fmt: skip
    """The setting of a motor's logs with this plain model."""
    recorded = RecordedLogs(tuple(logs), MOTOR, drive)
    rows = RecordedRows(recorded, None, ())
    plain = PlainModel(rows, model.stage, model.outcomes, model, library, recorded)
    return Setting(plain, rng, short=tuple(logs))


def with_plain(setting: Setting, model: FittedStructure) -> Setting:
    """The setting with another plain model of the same rows."""
    return replace(setting, plain=replace(setting.plain, model=model))


def best_of(
    stage: EffectRows, effect: Effect, base: Mapping[str, RowFit]
) -> EffectCandidate | None:
    """The effect at its best beside what the stage holds; None where it cannot show or stand."""
    start = first_shape(stage, effect, base)
    return None if start is None else refined(start)
