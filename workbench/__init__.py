"""The shell: commands, cards, log files, reports; and the commands as functions of Python:

    import workbench as wb
    model = wb.identify("run1.csv", "card.toml")    # or wb.identify(df, rig="motor")
    print(wb.validate(model, wb.design(model)))

See workbench/interface/calls.py. What they need is imported when one of them is first named.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from design.tune import Goals as Goals
    from identification.drift.drift_test import DriftSettings as DriftSettings
    from identification.errors import NotIdentifiable as NotIdentifiable
    from identification.errors import UserError as UserError
    from workbench.interface.calls import axis_test as axis_test
    from workbench.interface.calls import design as design
    from workbench.interface.calls import drift as drift
    from workbench.interface.calls import experiment as experiment
    from workbench.interface.calls import identify as identify
    from workbench.interface.calls import load_model as load_model
    from workbench.interface.calls import predict as predict
    from workbench.interface.calls import read_logs as read_logs
    from workbench.interface.calls import response as response
    from workbench.interface.calls import robust_design as robust_design
    from workbench.interface.calls import simulate as simulate
    from workbench.interface.calls import trace as trace
    from workbench.interface.calls import validate as validate
    from workbench.interface.effects import check_effects as check_effects
    from workbench.interface.effects import effects as effects
    from workbench.steps.experiment.planned import Wanted as Wanted
    from workbench.steps.identify import Options as Options
    from workbench.steps.loop_figures import Limits as Limits
    from workbench.steps.robust.robust import RobustAsked as RobustAsked

_CALLS = "workbench.interface.calls"
_HOMES = {
    **{name: _CALLS for name in ("identify", "trace", "design", "validate", "predict", "drift")},
    **{name: _CALLS for name in ("simulate", "experiment", "load_model", "read_logs")},
    **{name: _CALLS for name in ("response", "robust_design", "axis_test")},
    **{name: "workbench.interface.effects" for name in ("effects", "check_effects")},
    "Goals": "design.tune",
    "DriftSettings": "identification.drift.drift_test",
    "NotIdentifiable": "identification.errors",
    "UserError": "identification.errors",
    "Wanted": "workbench.steps.experiment.planned",
    "Options": "workbench.steps.identify",
    "Limits": "workbench.steps.loop_figures",
    "RobustAsked": "workbench.steps.robust.robust",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    found = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
