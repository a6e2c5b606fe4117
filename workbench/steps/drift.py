"""An active model and new runs -> drift tests, the state that is stored, and drift.json.

And what no wear does: every length, every force or the time of a log moved by one factor, a mass
that is another. The first is a slip of unit or of scale, the second another load, gear or unit.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from design.machine.active_model import active_model
from design.machine.documents import model_document
from design.machine.model import Model
from design.machine.plain import as_number, plain
from design.machine.plausible import refuse_other_machine, refuse_other_units
from design.machine.readable import number
from design.machine.source import Source
from design.machine.versions import versions
from design.measured.predict import of_one_instant
from identification.drift.drift_result import DriftTest, DriftVerdict, Shift, Statistic
from identification.drift.drift_test import DriftSettings, drift_test
from identification.drift.mewma import DriftState
from identification.estimation.estimates import reported_estimate
from identification.model.estimates import NORMAL_95, Estimate
from identification.model.karnopp import NAMES
from identification.signals.bad_samples import BadSamples
from identification.thresholds import ADEQUATE, OF_ACCOUNT, TWICE
from workbench.documents.reading import read_result
from workbench.logs.sources import Sources
from workbench.output import dumps, write_whole

DRIFT_SCHEMA, DRIFT_STREAM_SCHEMA = "drift/1", "drift_stream/1"
QUANTITIES = ("length", "force", "time")
# By which power of a factor in length, force and time each kind of the nine parameters moves.
_POWERS: Mapping[str, tuple[int, int, int]] = {
    "m": (-1, 1, 2),
    "F_v": (-1, 1, 1),
    "F_c": (0, 1, 0),
    "F_s": (0, 1, 0),
    "dv": (1, 0, -1),
}
_COLUMNS = ("the position", "the force (or of force_per_command)", "the clock")
_FEWEST = 3  # parameters, the mass among them: two factors would explain two


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
        return no_wear(moved, self.model.rotary)

    @property
    def tested(self) -> bool:
        """Whether any run was tested, whatever it could have shown."""
        return any(one.test.tested for one in self.tests)


def model_key(model: Model) -> str:
    """What names a model in a stored state: sha256 of what model.json says of it."""
    document = model_document(model)
    if model.own_logs is None:  # as a model was named before it could hold them
        del document["own_logs"]
    if not document["bad_samples"]:
        del document["bad_samples"]
    return hashlib.sha256(dumps(document).encode()).hexdigest()


def drift_of(
    model: Model, key: str, sources: Sources, *, stream: Stream | None = None,
    settings: DriftSettings | None = None, seed: int = 0,
) -> Drifted:  # fmt: skip
    """The runs tested one after the other against the model.

    stream: of the same model, what was stored after earlier logs; one of another model is not
    used, with a remark. Raises BadModel where model and card are not of one kind of machine, BadLog
    where a run is in other units than the model's logs.
    """
    settings = settings or DriftSettings()
    card = f"the card {sources.card.name}"
    refuse_other_machine(model.rig, sources.rig, card, "motion", "kind")
    refuse_other_units([one.log for one in sources.runs], model.log, sources.rig)
    active = replace(active_model(model, key), rig=sources.rig)
    remarks = [*model.read, *sources.remarks]
    if sources.card.name != model.card:
        remarks.append(f"the model is of {model.card}, the logs of {sources.card.name}")
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
    for source in sources.runs:
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
    return Drifted(model, key, settings, tuple(tests), after, tuple(remarks), sources.bad)


def _ratio(found: Statistic | None) -> float | None:
    return None if found is None else found.value / found.threshold


def read_stream(path: Path) -> Stream | None:
    """What `--state` stored at `path`, None where there is no file yet; raises BadModel."""
    return read_result(path, Stream, DRIFT_STREAM_SCHEMA) if path.exists() else None


def write_stream(path: Path, stream: Stream) -> None:
    """Store the stream, whole or not at all. Raises BadOutput where it cannot be written."""
    write_whole(path, dumps(stream) + "\n", "--state")


def drift_document(found: Drifted, model_file: str) -> dict[str, Any]:
    """The tests as drift.json holds them."""
    return {
        "schema": DRIFT_SCHEMA,
        "card": found.model.card,
        "model": {"file": model_file, "key": found.key},
        "settings": {**asdict(found.settings), "to_be_seen": found.settings.to_be_seen},
        "verdict": found.verdict,
        "log": [_of_run(one) for one in found.tests],
        "seen": [asdict(one) for one in found.stream.seen],
        "bad_samples": [one.as_json() for one in found.bad],
        "remarks": list(found.remarks),
        "versions": versions(),
    }


def _of_run(one: Tested) -> dict[str, Any]:
    test, source = one.test, one.source
    return {
        "file": source.file,
        "sha256": source.sha256,
        "rows": source.rows,
        "verdict": test.verdict,
        "reason": test.reason,
        "found_by": test.found_by,
        "moved": [_number(shift) for shift in test.moved],
        "unsure": list(test.unsure),
        "parameters": {name: _number(shift) for name, shift in test.shifts.items()},
        "not_judged": dict(test.not_judged),
        "could_have_seen": detectable_sizes(test),
        "single": plain(test.single),
        "alone": plain(test.alone),
        "mean": plain(test.mean),
        "chi_square": test.chi_square,
        "chi_square_allowed": test.allowed,
    }


def detectable_sizes(test: DriftTest) -> dict[str, float | None]:
    """Minimum detectable change of each parameter in a test, None where it detects none."""
    return {n: x if np.isfinite(x) else None for n, x in test.could_have_seen.items()}


def _number(shift: Shift) -> dict[str, Any]:
    """A parameter before, after, and its relative change, each as results carry a parameter."""
    return {
        "name": shift.name,
        "before": as_number(reported_estimate(shift.before, shift.unit, shift.before_sd)),
        "after": as_number(reported_estimate(shift.after, shift.unit, shift.after_sd)),
        "change": as_number(Estimate(shift.change, "1", shift.sd, shift.low, shift.high)),
    }


class Moved(NamedTuple):
    """A parameter before and after, in one unit, and the standard deviation of after/before."""

    before: float
    after: float
    sd: float


def moved_between(
    before: Mapping[str, Estimate], after: Mapping[str, Estimate]
) -> dict[str, Moved]:
    """The parameters that two models both identify."""
    out = dict[str, Moved]()
    for name, old in before.items():
        new = after[name]
        if old.value and new.value:
            sd = np.hypot((new.sd or 0.0) / old.value, new.value * (old.sd or 0.0) / old.value**2)
            out[name] = Moved(old.value, new.value, float(sd))
    return out


def slip_of_scale(moved: Mapping[str, Moved], rotary: bool) -> str:
    """That all moved as if every length, every force or the time had changed by one factor of two
    at least, in words; "" where that is not so."""
    found = [
        f"every {'angle' if rotary and what == 'length' else what} by the factor {number(factor)}"
        f" (the unit of {_COLUMNS[k]} 1/{number(factor)} of what the card says)"
        for k, what in enumerate(QUANTITIES)
        for factor in [_common_factor(moved, k)]
        if factor is not None
    ]
    if not found:
        return ""
    return (
        f"no wear but a slip of unit or scale, as if one thing alone had changed:"
        f" {', or '.join(found)}; correct the unit in the card, or the logger"
    )


def no_wear(moved: Mapping[str, Moved], rotary: bool) -> str:
    """What else than wear has moved the parameters, in words; "" where wear may have."""
    return slip_of_scale(moved, rotary) or other_mass(moved, rotary)


def other_mass(moved: Mapping[str, Moved], rotary: bool) -> str:
    """That the mass is another by a factor of two at least, in words; "" where it is not."""
    if "m" not in moved:
        return ""
    old, new, sd = moved["m"]
    if max(new / old, old / new) < TWICE or abs(new / old - 1.0) < NORMAL_95 * sd:
        return ""
    unit = "kg m^2" if rotary else "kg"
    return (
        f"m {old:.4g} -> {new:.4g} {unit}, which no wear does: another load or gear, a wrong unit"
        " or scale, or a fault in the log"
    )


def _common_factor(moved: Mapping[str, Moved], k: int) -> float | None:
    """The factor of one quantity that moves every parameter to where it is now; None without."""
    if "m" not in moved or len(moved) < _FEWEST:
        return None
    ratio = {name: one.after / one.before for name, one in moved.items()}
    if min(ratio.values()) <= 0.0:
        return None
    power = {n: next(p[k] for key, p in _POWERS.items() if n.startswith(key)) for n in moved}
    factor = float(np.exp(np.median([np.log(ratio[n]) / p for n, p in power.items() if p])))
    if max(factor, 1.0 / factor) < TWICE:
        return None
    for name, one in moved.items():
        by = factor ** power[name]
        if abs(ratio[name] / by - 1.0) > max(OF_ACCOUNT, NORMAL_95 * one.sd / by):
            return None
    return factor
