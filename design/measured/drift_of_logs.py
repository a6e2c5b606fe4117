"""An active model and new runs -> drift tests, and the state after them."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from design.machine.active_model import active_model
from design.machine.model import Model
from design.machine.plausible import refuse_other_machine, refuse_other_units
from design.machine.slip_of_scale import Moved, no_wear
from design.machine.source import MachineLogs, Source
from design.measured.predict import of_one_instant
from identification.drift.drift_result import DriftTest, DriftVerdict, Statistic
from identification.drift.drift_test import DriftSettings, drift_test
from identification.drift.mewma import DriftState
from identification.model.karnopp import NAMES
from identification.signals.bad_samples import BadSamples
from identification.thresholds import ADEQUATE


@dataclass(frozen=True)
class Seen:
    """A log that has been tested: its file, verdict, and the statistics over their thresholds."""

    file: str
    sha256: str
    verdict: DriftVerdict
    single: float | None
    mean: float | None


@dataclass(frozen=True)
class Stream:
    """What `--state` holds: the chart's state, and the logs that it has taken in, in order."""

    state: DriftState
    seen: tuple[Seen, ...]
    schema: Literal["drift_stream/1"] = "drift_stream/1"


@dataclass(frozen=True)
class Tested:
    """One run's test; again: its file had been taken in before, so the state does not count it."""

    source: Source
    test: DriftTest
    again: bool


@dataclass(frozen=True)
class Drifted:
    """The tests of new runs against an active model, and the stream after them."""

    model: Model
    key: str
    settings: DriftSettings
    tests: tuple[Tested, ...]
    stream: Stream
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()

    @property
    def verdict(self) -> DriftVerdict:
        """The worst of the runs' verdicts, or else that of the newest run that was tested at all.

        What an older log has shown says nothing of a change since.
        """
        found = [one.test.verdict for one in self.tests]
        alarms: tuple[DriftVerdict, ...] = ("structure", "drift")
        for verdict in alarms:
            if verdict in found:
                return verdict
        tested = [one.test.verdict for one in self.tests if one.test.tested]
        return tested[-1] if tested else "not_judged"

    @property
    def slip(self) -> str:
        """What else than wear has moved the newest log with drift; "" where wear may have."""
        found = [one.test.shifts for one in self.tests if one.test.verdict == "drift"]
        nine = {n: one for n, one in (found[-1] if found else {}).items() if n in NAMES}
        moved = {name: Moved(one.before, one.after, one.sd) for name, one in nine.items()}
        return no_wear(moved, self.model.display)

    @property
    def tested(self) -> bool:
        """Whether any run was tested, whatever it could have shown."""
        return any(one.test.tested for one in self.tests)


def drift_of(
    model: Model, key: str, logs: MachineLogs, *, stream: Stream | None = None,
    settings: DriftSettings | None = None, seed: int = 0,
) -> Drifted:  # fmt: skip
    """The runs tested one after the other against the model.

    stream: of the same model, what was stored after earlier logs; one of another model is not
    used, with a remark. Raises BadModel where model and card are not of one kind of machine, BadLog
    where a run is in other units than the model's logs.
    """
    settings = settings or DriftSettings()
    card = f"the card {logs.card}"
    refuse_other_machine(model.rig, logs.rig, card, "motion", "kind")
    refuse_other_units(logs.logs, model.log, logs.rig)
    active = replace(active_model(model, key), rig=logs.rig)
    remarks = [*model.read, *logs.remarks]
    if logs.card != model.card:
        remarks.append(f"the model is of {model.card}, the logs of {logs.card}")
    if model.own_logs is None and model.fit.chi_square > ADEQUATE:
        remarks.append(
            "the model leaves more than noise, and its file does not hold how far its own logs lie"
            " from it; identify it again, or the model's own misfit may be taken for drift"
        )
    if stream is not None and stream.state.model != key:
        remarks.append("the stored state is of another model; it starts again with this one")
        stream = None
    before = {one.sha256 for one in stream.seen} if stream else set()
    state = stream.state if stream else None
    tests: list[Tested] = []
    for source in logs.runs:
        # A log's own stream, so that its verdict does not hang on the others of the command.
        rng = np.random.default_rng([seed, int(source.sha256[:8], 16)])
        log = of_one_instant(source.log, model)
        found = drift_test(active, log, rng, state=state, settings=settings)
        again = source.sha256 in before
        if again:
            remarks.append(f"{source.file}: taken in before; the state does not count it again")
        state = state if again and state is not None else found.state
        tests.append(Tested(source, found, again))
    assert state is not None
    new = ((one.source, one.test) for one in tests if not one.again)
    seen = (*(stream.seen if stream else ()),
            *(Seen(source.file, source.sha256, test.verdict, _ratio(test.single), _ratio(test.mean))
              for source, test in new))  # fmt: skip
    after = Stream(state, seen)
    return Drifted(model, key, settings, tuple(tests), after, tuple(remarks), logs.bad)


def _ratio(found: Statistic | None) -> float | None:
    return None if found is None else found.value / found.threshold
