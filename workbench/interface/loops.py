"""Results of `design`, `validate` and `experiment`: controllers, and what a simulated loop does."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from identification.errors import BadModel
from workbench.documents.design import Design
from workbench.documents.model import Model
from workbench.interface.result import Result
from workbench.report.experiment import experiment_view
from workbench.report.reports import design_view, validation_view
from workbench.report.robust import robust_view
from workbench.report.view import View
from workbench.steps.experiment.planned import Experiment
from workbench.steps.loop_figures import Traces
from workbench.steps.robust.robust import ROBUST, Robust
from workbench.steps.validate import Validation

if TYPE_CHECKING:
    import pandas as pd

    from design.schedule import Over


class ControlLoop(NamedTuple):
    """Transfer functions in z, objects of python-control: F_ref = forward r - feedback y."""

    plant: Any
    feedback: Any
    forward: Any


@dataclass(frozen=True, repr=False)
class DesignResult(Result):
    """What `design` made for a model: an RST and a PID with their margins, and the compensator."""

    _command = "design"
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

    def scheduled(self, over: "Over") -> "DesignResult":
        """The same with a gain schedule of its PID and P-PI over "place", "load" or "direction", as
        `workbench design --schedule`.

        Raises BadModel where the model's friction does not change over it.
        """
        from workbench.steps.schedule import scheduled

        return DesignResult(scheduled(self.model, self.design, over), self.model)

    def _made(self) -> View:
        return design_view(self.design, self.model.rotary)


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

    def _made(self) -> View:
        return robust_view(self.found, self.model.rotary)


@dataclass(frozen=True, repr=False)
class ValidateResult(Result):
    """What `validate` saw of a design in the simulated loop."""

    _command = "validate"
    found: Validation
    traces: Mapping[tuple[str, str], Traces]
    rotary: bool = False

    @property
    def passed(self) -> bool:
        """Whether the tested controller keeps every limit on every plant."""
        return self.found.passed

    def _made(self) -> View:
        return validation_view(self.found, self.traces, self.rotary)


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

    def _made(self) -> View:
        return experiment_view(self.found)
