"""A model's machine in its loop as an experiment sees it: what it does, logs, and identifies."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.experiment.precision import Machine
from design.loop import LoopRun
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.estimation.recorded_logs import RecordedLogs, recorded_logs
from identification.experiment.information import (
    Errors,
    Information,
    information,
    log_errors,
    rests_of,
    run_errors,
)
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.plant import Actuator, Motor, Plant
from workbench.documents.design import Design
from workbench.documents.model import Model
from workbench.steps.closed_loop import (
    DrivenLoop,
    chambers,
    driven_loop,
    present_loop,
    run_plant,
)


@dataclass(frozen=True, eq=False)
class Bench:
    """A model, the loop that its machine runs in, and how its logs are taken (every loop.h)."""

    model: Model
    loop: DrivenLoop
    controller: str

    @property
    def by_command(self) -> bool:
        """Whether a fit's runs are driven by the logged command."""
        return self.model.fit.drive == "command" and self.model.simulated.actuator is not None

    @property
    def drive(self) -> Drive:
        """What drives a fit's runs."""
        return "command" if self.by_command else "force"

    def run(self, plant: Plant, r: Array, rng: np.random.Generator | None = None) -> LoopRun:
        """The loop on a plant along r [m], (n,) every loop.h; with the sensors' noise by rng."""
        return run_plant(self.model, plant, self.loop, r, rng)

    def log(
        self, run: LoopRun, name: str = "experiment", rng: np.random.Generator | None = None
    ) -> Log:
        """What the machine logs of a run; by rng, a motor's command with the noise of its force,
        which the motor was not given."""
        drive, u = self.model.simulated.actuator, run.u
        if isinstance(drive, Motor) and rng is not None:
            u = u + self.model.fit.noise_F / drive.k_a * rng.standard_normal(len(u))
        F = drive.k_a * u if isinstance(drive, Motor) else run.F_measured
        signals = {"t": run.t, "r": run.r, "y": run.y_measured, "F": F}
        if drive is not None and self.by_command:
            signals["u"] = u
        made = chambers(self.model.rig)
        return Log(name, signals | {key: np.asarray(of(run.F)) for key, of in made.items()})

    def fitted(self, plant: Plant) -> Plant:
        """The plant as a fit has it, without the actuator where the force drives its runs."""
        return plant if self.by_command else Plant(plant.friction, None, plant.effects)

    def recorded(self, log: Log) -> RecordedLogs:
        """A log as the estimator takes it."""
        return recorded_logs([log], self.model.rig, self.drive)

    def errors(self, plant: Plant, run: LoopRun) -> Errors:
        """Errors of plants along a run without noise; where the measured force drives a fit's runs,
        with the noise that it would have."""
        log, fit = self.log(run), self.model.fit
        if self.by_command:
            at = rests_of(run.v, float(run.t[1]))
            return run_errors(log, run.y, at, fit.noise_y, fit.noise_F)
        rng = np.random.default_rng(0)
        noisy = {
            key: log[key] + sd * rng.standard_normal(len(log))
            for key, sd in (("y", fit.noise_y), ("F", fit.noise_F))
        }
        return log_errors(self.fitted(plant), self.recorded(log.with_signals(**noisy)))

    def machine(self, plant: Plant, rivals: tuple[Acting, ...] = ()) -> Machine:
        """The plant as the search takes it, and what a run identifies of it and of these rivals."""
        own = self.fitted(plant)

        def information_of(run: LoopRun) -> Information:
            return information(own, self.errors(plant, run), self.drive, rivals)

        whole = self.by_command and isinstance(plant.actuator, Actuator)
        return Machine(lambda r: self.run(plant, r), information_of, whole)


def bench_of(model: Model, found: Design | None) -> Bench:
    """The machine in the loop of a design's recommended controller, or else in its own.

    Raises BadModel where there is neither, or nothing would follow a reference.
    """
    if model.prescribed_motion:
        raise BadModel(
            "the model's logs are of a prescribed motion; no controller moves this machine"
        )
    if found is not None:
        name = found.recommended if found.recommended in found.controllers else ""
        if not name:
            raise BadModel("the design recommends no controller; give one that does")
        return Bench(model, driven_loop(model, found, found.controllers[name]), name.upper())
    now = model.controller
    if now is None:
        raise BadModel(
            "the model has no controller that would follow a reference; give --design DESIGN, or"
            " --card CARD with a [controller]"
        )
    loop = present_loop(model, now)
    if isinstance(model.simulated.actuator, Actuator) and loop.force is None and not loop.direct:
        raise BadModel("its controller has no force loop for the actuator; add it to [controller]")
    return Bench(model, loop, f"present {now.kind}")


def asked_of(wanted: Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    """The parameters asked for, by default all; raises BadModel where one is none of them."""
    for name in wanted:
        if name not in known:
            raise BadModel(f"no parameter {name!r} in the model; it has {', '.join(known)}")
    return tuple(wanted) or tuple(known)
