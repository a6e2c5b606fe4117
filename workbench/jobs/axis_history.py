"""What the registry has of a machine for its axis test: its last logs, and its active model."""

import re
from collections.abc import Sequence

import numpy as np

from design.measured import axis_lights
from design.measured.axis_lights import LAST_ON_PAGE, few_sound_logs, history, left_out
from design.measured.axis_limits import FEWEST_EARLIER, MEANING_OF
from design.measured.axis_test import Earlier
from identification.drift.drift_result import Shift
from identification.model.estimates import Estimate
from workbench.documents.reading import Stored
from workbench.documents.result_files import read_model
from workbench.jobs.judge import drift_by_chart
from workbench.logs.sources import Sources
from workbench.registry.results import TestedLog, last_logs
from workbench.registry.store import Registry

LAST_LOGS_READ = 120  # of a machine's last logs, among which those are that identify its parameters
# Effects that the equation of motion takes out, and those that it does not see
BY_EQUATION = ("constant_force", "gravity", "input_delay", "cogging", "backlash")


def earlier_of(registry: Registry, machine: str, sources: Sources, seed: int = 0) -> Earlier:
    """The machine's last sound logs, and this log by the active model where that has further
    effects.

    Raises BadRegistry where there is no such machine.
    """
    state = registry.machine(machine)
    own = {source.sha256 for source in sources.runs}
    accepted = registry.accepted_version(machine)
    number = None if accepted is None else accepted.number

    def earlier(sound: bool) -> list[TestedLog]:
        found = last_logs(registry.database, machine, LAST_LOGS_READ, sound=sound)
        return [one for one in found if one.sha256 not in own and one.parameters]

    logs = earlier(sound=True)
    values = history(list(reversed(logs[:LAST_ON_PAGE])))
    said = ""
    if len(logs) < FEWEST_EARLIER:
        said = f"{machine} has {few_sound_logs(len(logs), number)}"
    remarks = list(filter(None, [left_out(earlier(sound=False), number)]))
    if state.in_force is None:
        return Earlier(machine, values, None, None, said, tuple(remarks))
    if accepted is not None and state.in_force.model != accepted.model:
        remarks.append(
            f"nobody has accepted the active version {state.in_force.number}; `workbench registry"
            f" promote {machine} {state.in_force.number} --reason ...` does, and the limits begin"
            " anew with it"
        )
    model = read_model(Stored("model.json", registry.document(state.in_force, "model")))
    estimates = None
    kinds = {key: re.sub(r"_\d+$", "", key) for key in model.effects}  # also of a second one
    further = [key.replace("_", " ") for key, kind in kinds.items() if kind not in BY_EQUATION]
    if further:
        remarks.append(
            f"by the fit of the active version {state.in_force.number}, which has"
            f" {', '.join(further)}"
        )
        found = drift_by_chart(model, sources.logs, np.random.default_rng(seed), {})
        nine = {name: one for name, one in model.friction.items() if name in MEANING_OF}
        unidentified = {n: Estimate(None, e.unit, reason=found.reason) for n, e in nine.items()}
        estimates = unidentified | by_quantity(found.parameters)
    width = model.effects.get("backlash", {}).get("width")
    if width is not None and width.value is not None and "backlash" not in (estimates or {}):
        active_width = Estimate(width.value, width.unit, width.sd, width.low, width.high)
        estimates = {**(estimates or {}), "backlash": active_width}
        remarks.append(f"backlash is that of the active version {state.in_force.number}")
    return Earlier(machine, values, state.in_force.number, estimates, said, tuple(remarks))


def by_quantity(shifts: Sequence[Shift]) -> dict[str, Estimate]:
    """This log's parameters as the drift test has them, by quantity."""
    found = axis_lights.by_quantity(vars(one) for one in shifts)
    return {
        name: Estimate(value, unit, None, low, high)
        for name, (unit, value, low, high) in found.items()
    }
