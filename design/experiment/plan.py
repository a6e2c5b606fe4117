"""Model and limits -> the run to make next: searched, made safe, and promised."""

import itertools
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from design.asked import Wanted
from design.closed_loop.drawn_plants import drawn_plants, in_loop, lost_bands
from design.closed_loop.driven_loop import (
    DrivenLoop,
    chambers,
    driven_loop,
    effects_left_out,
    present_loop,
    run_plant,
)
from design.experiment.limits import MotionLimits, Peaks, peaks
from design.experiment.planned import (
    Experiment,
    Promised,
    Safety,
    Separation,
    half_width,
    limits_of,
)
from design.experiment.precision import Machine, evaluated, precision
from design.experiment.search import best_run
from design.experiment.separation import pairs_of, separation
from design.loop import LoopRun
from design.machine.design import Design
from design.machine.effect_values import known_effect
from design.machine.model import Model
from design.machine.readable import Display
from design.machine.versions import versions
from design.servo import moved_reference
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadModel, NotIdentifiable, UserError
from identification.estimation.fit import fit_plant
from identification.estimation.recorded_logs import RecordedLogs, recorded_logs
from identification.estimation.windowed_run.parameters import names_of, values_of
from identification.estimation.windowed_run.run_errors import Judge, judge
from identification.estimation.windowed_run.windows import longest_window
from identification.experiment.information import (
    Information,
    information,
    rests_of,
    run_errors,
    unknowns,
)
from identification.experiment.structures import discriminated, sought
from identification.log import Log
from identification.model.estimates import Drive, Estimate
from identification.model.plant import Actuator, Motor, Plant
from identification.progress import KeepGoing, Progress


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

    def errors(self, plant: Plant, run: LoopRun) -> Judge:
        """Errors of plants along a run without noise; where the measured force drives a fit's runs,
        with the noise that it would have, in the windows in which a fit would follow them."""
        log, fit = self.log(run), self.model.fit
        if self.by_command:
            at = rests_of(run.v, float(run.t[1]))
            return run_errors(log, run.y, at, fit.noise_y, fit.noise_F)
        rng = np.random.default_rng(0)
        noisy = {
            key: log[key] + sd * rng.standard_normal(len(log))
            for key, sd in (("y", fit.noise_y), ("F", fit.noise_F))
        }
        own, logs = self.fitted(plant), self.recorded(log.with_signals(**noisy)).logs
        return judge(own, logs, self.drive, longest_window(own, logs, self.drive))

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


EXPERIMENT_STAGES = {
    "segments": (0.0, 0.35),
    "sharing the time": (0.35, 0.4),
    "whole runs": (0.4, 0.8),
    "safety": (0.8, 0.85),
    "what it promises": (0.85, 1.0),
}
SEARCHED_PLANTS = 1  # drawn plants beside the model's, on which a search looks at every run
CHECKED_PLANTS = 40  # drawn plants, on which no limit may be exceeded
PROMISED_PLANTS = 2  # drawn plants beside the model's, whose logs are fitted
SHOWN_PLANTS = 12  # drawn plants in the picture


def experiment(
    model: Model, wanted: Wanted, design: Design | None, report: Progress, keep_going: KeepGoing
) -> Experiment:
    """The run that is most informative of the parameters asked for, within the limits.

    design: whose recommended controller moves the machine; None: its present one. Raises BadModel
    where nothing would follow a reference, NotIdentifiable where no run within the limits
    identifies anything.
    """
    limits = limits_of(model, wanted)
    bench = bench_of(model, design)
    search, draw, check, promise = np.random.default_rng(wanted.seed).spawn(4)
    plant = in_loop(model)
    plants = (plant, *drawn_plants(model, draw, CHECKED_PLANTS))
    rivals = _rivals(model, wanted)
    if rivals:  # each plant has none of them at first
        plants = tuple(
            replace(p, effects=tuple(one for one in p.effects if one.key not in wanted.rivals))
            for p in plants
        )
    machines = [bench.machine(one, rivals) for one in plants[: 1 + SEARCHED_PLANTS]]
    keys = tuple(one.key for one in rivals)
    asked = asked_of(wanted.parameters, unknowns(bench.fitted(plants[0]), bench.drive)[0])
    criterion = separation(machines, keys) if rivals else precision(machines, asked)
    plan = best_run(criterion, limits, bench.loop.h, search, report, keep_going)
    report("safety", 0.0)
    r, safety = made_safe(bench, _with_one_each(plants, rivals), plan.r, limits, check)
    promises = promised(bench, plants[: 1 + PROMISED_PLANTS], r, promise, report)
    if all(one.after is None for one in promises):
        raise NotIdentifiable(
            f"{model.card}: no parameter is identifiable from a run within the limits"
            f" ({bench.controller} hardly moves the machine within them); widen the limits, or"
            " give another --design"
        )
    seen = evaluated(machines[:1], r)
    per = len(asked) if not rivals else 1
    return Experiment(
        card=model.card,
        motion=model.rig.motion,
        command_unit=model.rig.command_unit,
        criterion="T" if rivals else "D",
        parameters=asked,
        limits=limits,
        h=bench.loop.law.h,
        controller=bench.controller,
        segments=plan.segments,
        promise=promises,
        separation=_apart(seen[1][0], keys) if seen and rivals else (),
        safety=safety,
        efficiency=float(np.exp((plan.joined - plan.bound) / per)),
        chaotic=seen[1][0].chaotic if seen else 1.0,
        tried=plan.tried,
        seed=wanted.seed,
        remarks=tuple(_remarks(model, safety.scale)),
        versions=versions(),
        r=moved_reference(bench.loop.servo, r, bench.loop.h)[
            :: max(1, round(bench.loop.law.h / bench.loop.h))  # where the controller samples
        ],
        runs=tuple(bench.run(one, r) for one in plants[: 1 + SHOWN_PLANTS]),
    )


def _rivals(model: Model, wanted: Wanted) -> tuple[Acting, ...]:
    """The rivals as the model has them, else at a size that matters."""
    limits, plant = limits_of(model, wanted), in_loop(model)
    own = {one.key: one for one in plant.effects}
    return tuple(
        own.get(key) or sought(known_effect(key, model.library), plant, limits.stroke)
        for key in wanted.rivals
    )


def _with_one_each(plants: Sequence[Plant], rivals: Sequence[Acting]) -> tuple[Plant, ...]:
    """The plants, each with one of the rivals in turn."""
    if not rivals:
        return tuple(plants)
    turns = itertools.cycle(rivals)
    return tuple(replace(one, effects=(*one.effects, next(turns))) for one in plants)


def _apart(information: Information, keys: Sequence[str]) -> tuple[Separation, ...]:
    """How far the run discriminates each pair, the hardest first."""
    matrix = information.matrix
    found = [
        Separation(*pair.names, float(np.sqrt(discriminated(matrix, pair.one, pair.others))))
        for pair in pairs_of(information, keys)
    ]
    return tuple(sorted(found, key=lambda one: one.deviations))


def _remarks(model: Model, scale: float) -> list[str]:
    out = list(model.read)
    if left_out := effects_left_out(model):
        out.append(left_out)
    if model.assumed:
        names = ", ".join(model.assumed)
        out.append(f"{names}: not identifiable; tried within a third of the assumed values")
    if bands := lost_bands(model):
        out.append(
            f"{', '.join(bands)}: the logs show no band; a usual one is assumed, and what is"
            " promised of it holds if the machine has one"
        )
    if not model.fit.adequate:
        out.append(
            "the model leaves more than noise of its logs: the prediction holds for a machine"
            " like the model; run 'workbench trace' for what is missing"
        )
    if scale < 1.0:
        out.append(f"made smaller, to {scale:.0%}, so that no drawn machine exceeds a limit")
    return out


SAFETY_PASSES = 8  # in which a reference is made smaller until no limit is exceeded
SMALLER_SCALE = 0.93  # in each
SLOWER_RUN = 0.7  # of its speed, that a run is given after one that is not safe


def promised(
    bench: Bench, plants: Sequence[Plant], r: Array, rng: np.random.Generator, report: Progress
) -> tuple[Promised, ...]:
    """Half the 95 % intervals that a fit of the run is to give, the median over these plants.

    Each plant runs with the sensors' noise, and its log is fitted as any other is.
    """
    found: list[Mapping[str, Estimate]] = []
    for i, plant in enumerate(plants):
        report("what it promises", i / len(plants))
        sensors, force = rng.spawn(2)
        try:
            log = bench.log(bench.run(plant, r, sensors), rng=force)
            drive = None if bench.model.rig.kind == "motor" else bench.drive
            own = bench.fitted(plant)
            fit = fit_plant([log], force, rig=bench.model.rig, drive=drive, prior=own)
        except UserError:
            continue
        found.append(fit.estimates)
    plant = bench.fitted(plants[0])
    names = names_of(plant, bench.drive)
    model, out = bench.model, []
    of_effects = ((f"{key}.{n}", e) for key, own in model.effects.items() for n, e in own.items())
    known = {**model.friction, **(model.actuator or {}), **dict(of_effects)}
    for name, value in zip(names, values_of(plant, names).tolist(), strict=True):
        now = known[name]
        relative = [
            half / abs(one[name].value or 1.0)
            for one in found
            if name in one and (half := half_width(one[name])) is not None
        ]
        identified_share = len(relative) / len(plants)
        after = abs(value) * float(np.median(relative)) if identified_share >= 0.5 else None
        out.append(Promised(name, now.unit, value, half_width(now), after, identified_share))
    return tuple(out)


def made_safe(
    bench: Bench, plants: Sequence[Plant], r: Array, limits: MotionLimits, rng: np.random.Generator
) -> tuple[Array, Safety]:
    """The reference, made smaller about home until none of these plants exceeds a limit.

    Raises BadModel where none of them can be followed, NotIdentifiable where one exceeds a limit
    however small the reference: a feed-forward asks for the more force, the smoother a path it is.
    """
    seeds, scale, smaller = rng.spawn(len(plants)), 1.0, r
    for again in range(1 + SAFETY_PASSES):
        if again:
            scale *= SMALLER_SCALE
            smaller = limits.home + scale * (r - limits.home)
        found: list[Peaks] = []  # of the plants that can be followed
        for plant, own in zip(plants, seeds, strict=True):
            with suppress(UserError):
                found.append(peaks(bench.run(plant, smaller, own)))
        exceeding = len(plants) - sum(not one.exceeded(limits) for one in found)
        if exceeding == 0:
            break
    if not found:
        raise BadModel("none of the drawn machines can be simulated in this loop; check the model")
    worst = reduce(Peaks.or_more, found)
    if exceeding:
        raise NotIdentifiable(
            f"{bench.model.card}: no run that {bench.controller} keeps within the limits:"
            f" {exceeding} of {len(plants)} machines drawn from what the model leaves open exceed"
            f" one{_beyond(worst, limits, bench.model.display)}, also with the reference at"
            f" {scale:.0%}; give --speed {SLOWER_RUN * limits.speed:.2g} or less, or wider limits"
        )
    return smaller, Safety(len(plants), worst, exceeding, scale)


def _beyond(worst: Peaks, limits: MotionLimits, units: Display) -> str:
    """Force and speed beyond their limits, in brackets; "" where it is another limit."""
    said = [
        f"{name} {reached:.3g} of {limit:.3g} {unit}"
        for name, reached, limit, unit in (
            ("force", worst.force, limits.force, units.force),
            ("speed", worst.speed, limits.speed, units.velocity),
        )
        if reached > limit
    ]
    return f" ({', '.join(said)})" if said else ""
