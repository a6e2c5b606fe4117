"""`design`, `validate` and `experiment`, as the commands of these names: controllers, and what a
simulated loop does."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from design.asked import Limits, RobustAsked, Wanted
from design.closed_loop.loop_figures import Traces
from design.controllers.design import design as design_of_model
from design.controllers.design import effort_limit
from design.controllers.schedule import scheduled
from design.controllers.validate import Validation
from design.controllers.validate import validate as validate_design
from design.experiment.plan import EXPERIMENT_STAGES
from design.experiment.plan import experiment as plan_experiment
from design.experiment.planned import Experiment, rivals_of
from design.machine.design import Design
from design.machine.model import Model
from design.machine.readable import Display
from design.robust.robust import ROBUST, ROBUST_STAGES, Robust
from design.robust.robust import robust_design as robust_of_model
from identification.errors import BadModel
from workbench.course import running, working
from workbench.documents.result_files import read_design
from workbench.documents.rivals import read_rivals
from workbench.interface.inputs import PathLike
from workbench.interface.models import ModelLike, Result, TraceResult, model_of

if TYPE_CHECKING:
    from typing import Literal

    import pandas as pd

    from design.machine.design import Structure
    from design.schedule import Over
    from design.tune import Asked, Goals


class ControlLoop(NamedTuple):
    """Transfer functions in z, objects of python-control: F_ref = forward r - feedback y."""

    plant: Any
    feedback: Any
    forward: Any


@dataclass(frozen=True, repr=False)
class DesignResult(Result):
    """What `design` made for a model: an RST and a PID with their margins, and the compensator."""

    _command = "design"
    _shown = ("design",)
    design: Design
    model: Model

    @property
    def recommended(self) -> str:
        """ "rst", "pid", "p-pi", or "none" where no controller keeps every goal."""
        return self.design.recommended

    def to_control(self, name: str | None = None) -> ControlLoop:
        """Plant and controller as transfer functions of python-control, for loops and Bode plots.

        name: "rst", "pid" or "p-pi", by default the recommended. Raises BadModel where there is
        none of that name.
        """
        from design.convert import controller_to_control, to_control

        wanted = name or self.design.recommended
        there = self.design.controllers
        if wanted not in there:
            raise BadModel(f"no controller {wanted!r}; name one that is there ({', '.join(there)})")
        plant = self.design.plant
        feedback, forward = controller_to_control(there[wanted].rst)
        return ControlLoop(to_control(plant.A, plant.B, plant.h), feedback, forward)

    def scheduled(
        self, over: "Over", asked: "Asked | None" = None, goals: "Goals | None" = None
    ) -> "DesignResult":
        """The same with a gain schedule of its PID and P-PI over "place", "load" or "direction", as
        `workbench design --schedule`; asked, goals: poles and margins at each point.

        Raises BadModel where the model's friction does not change over it.
        """
        with working("designing"):
            found = scheduled(self.model, self.design, over, asked, goals)
        return DesignResult(found, self.model)


@dataclass(frozen=True, repr=False)
class RobustResult(Result):
    """A design chosen over the machines drawn from a model, and what it promises of them."""

    _command = "design"
    found: Robust
    model: Model

    @property
    def design(self) -> DesignResult:
        """The design itself, as `validate` and `export` take it."""
        return DesignResult(self.found.design, self.model)

    @property
    def passed(self) -> bool:
        """Whether each limit is kept with the probability asked for."""
        return self.found.passed

    @property
    def frame(self) -> "pd.DataFrame":
        """Every measure of the robust loop on every machine drawn, a row a machine."""
        import pandas as pd

        return pd.DataFrame(dict(self.found.promises[ROBUST].found.values))


@dataclass(frozen=True, repr=False)
class ValidateResult(Result):
    """What `validate` saw of a design in the simulated loop."""

    _command = "validate"
    _shown = ("found", "traces", "display")
    found: Validation
    traces: Mapping[tuple[str, str], Traces]
    display: Display

    @property
    def passed(self) -> bool:
        """Whether the tested controller keeps every limit on every plant."""
        return self.found.passed


@dataclass(frozen=True, repr=False)
class ExperimentResult(Result):
    """The run to make next, and what it promises."""

    _command = "experiment"
    found: Experiment

    @property
    def frame(self) -> "pd.DataFrame":
        """The reference: t [s] and r, a row a sample of the controller."""
        import pandas as pd

        r = self.found.r
        return pd.DataFrame({"t": self.found.h * np.arange(len(r)), "r": r})


DesignLike: TypeAlias = DesignResult | Design | PathLike


def design(
    model: ModelLike, *, poles: tuple[float, float] | None = None,
    auxiliary: Sequence[complex] | None = None, integrator: bool = True,
    source: "Literal['physical', 'arx'] | None" = None, period: float | None = None,
    goals: "Goals | None" = None, structures: "Sequence[Structure] | None" = None,
) -> DesignResult:  # fmt: skip
    """PID and RST for a model by pole placement, and P-PI cascades, as `workbench design`.

    poles: w_n [rad/s] and damping of the dominant pair, auxiliary: the others, values of z; both
    searched where not given. source: the plant to design on; period: of the position loop [s];
    goals: margins to keep, by default those of the command; structures: of "rst", "pid", "p-pi".
    Raises BadSpecification where the poles cannot be placed, NotIdentifiable where the model
    carries no design.
    """
    from design.tune import Asked
    from design.tune import Goals as DesignGoals

    known = model_of(model)
    asked = Asked(poles, None if auxiliary is None else tuple(auxiliary), integrator)
    wanted = goals or DesignGoals(effort=effort_limit(known))
    with working("designing"):
        found = design_of_model(
            known, asked, goals=wanted, source=source, period=period, structures=structures
        )
    return DesignResult(found, known)


def robust_design(
    model: ModelLike, wanted: RobustAsked | None = None, *,
    poles: tuple[float, float] | None = None, auxiliary: Sequence[complex] | None = None,
    integrator: bool = True, source: "Literal['physical', 'arx'] | None" = None,
    period: float | None = None,
) -> RobustResult:  # fmt: skip
    """The design that does best over the machines that a model's errors allow, as `workbench design
    --robust`.

    wanted: machines drawn, limits, on what share of the machines each has to hold; the others as
    `design` has them. Raises BadSpecification where no loop can be placed,
    NotIdentifiable where the mass is not known.
    """
    from design.tune import Asked

    known = model_of(model)
    asked = Asked(poles, None if auxiliary is None else tuple(auxiliary), integrator)
    with running("robust design", ROBUST_STAGES, math.inf) as course:
        found = robust_of_model(
            known, wanted or RobustAsked(), asked, where=(source, period), report=course.report
        )
    return RobustResult(found, known)


def validate(
    model: ModelLike, design: DesignLike, *, plant: ModelLike | None = None,
    limits: Limits | None = None, seed: int = 0,
) -> ValidateResult:  # fmt: skip
    """A design on its model in the simulated loop, as `workbench validate`.

    plant: another machine on which it has to work too; limits: what the tested controller keeps.
    """
    known, made = model_of(model), _design(design)
    other = None if plant is None else model_of(plant)
    with working("simulating the loop"):
        rng = np.random.default_rng(seed)
        found, traces = validate_design(known, made, rng, plant=other, limits=limits)
    return ValidateResult(found, traces, known.display)


def experiment(
    model: ModelLike, *, design: DesignLike | None = None, wanted: Wanted | None = None,
    rivals: "TraceResult | PathLike | None" = None, budget: float = 30.0,
) -> ExperimentResult:  # fmt: skip
    """The run to make next on a machine, as `workbench experiment`.

    design: whose controller moves the machine, by default the model's present one; wanted:
    parameters, limits, seed, keys of effects that are to be discriminated; rivals: a trace that
    leaves such effects open. budget [s]: end the search after so long. Raises NotIdentifiable where
    no run within the limits identifies anything.
    """
    known = model_of(model)
    asked = wanted or Wanted()
    if isinstance(rivals, TraceResult):
        asked = replace(asked, rivals=rivals_of(rivals.document, known, known.library))
    elif rivals is not None:
        asked = replace(asked, rivals=read_rivals(Path(rivals), known, known.library))
    made = None if design is None else _design(design)
    with running("experiment", EXPERIMENT_STAGES, budget) as course:
        found = plan_experiment(known, asked, made, course.report, course.keep_going)
    return ExperimentResult(found)


def _design(given: DesignLike) -> Design:
    made = read_design(Path(given)) if isinstance(given, str | os.PathLike) else given
    found = made.design if isinstance(made, DesignResult) else made
    if not isinstance(found, Design):
        raise BadModel(f"{type(given).__name__} found, a design needed: its path, or a design's")
    return found
