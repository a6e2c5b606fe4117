"""The shell: commands, cards, log files, reports; and the commands as functions of Python:

    import workbench as wb
    model = wb.identify("run1.csv", "card.toml")    # or wb.identify(df, rig="motor")
    print(wb.validate(model, wb.design(model)))

See workbench/interface/. What they need is imported when one of them is first named.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from design.asked import Limits as Limits
    from design.asked import Options as Options
    from design.asked import RobustAsked as RobustAsked
    from design.asked import Wanted as Wanted
    from design.tune import Goals as Goals
    from identification.drift.drift_test import DriftSettings as DriftSettings
    from identification.errors import NotIdentifiable as NotIdentifiable
    from identification.errors import UserError as UserError
    from workbench.interface.effects import check_effects as check_effects
    from workbench.interface.effects import effects as effects
    from workbench.interface.logs import axis_test as axis_test
    from workbench.interface.logs import drift as drift
    from workbench.interface.logs import predict as predict
    from workbench.interface.logs import read_logs as read_logs
    from workbench.interface.logs import response as response
    from workbench.interface.logs import simulate as simulate
    from workbench.interface.loops import design as design
    from workbench.interface.loops import experiment as experiment
    from workbench.interface.loops import robust_design as robust_design
    from workbench.interface.loops import validate as validate
    from workbench.interface.models import identify as identify
    from workbench.interface.models import load_model as load_model
    from workbench.interface.models import trace as trace

_HOMES = {
    "design.asked": "Limits Options RobustAsked Wanted",
    "design.tune": "Goals",
    "identification.drift.drift_test": "DriftSettings",
    "identification.errors": "NotIdentifiable UserError",
    "workbench.interface.effects": "check_effects effects",
    "workbench.interface.logs": "axis_test drift predict read_logs response simulate",
    "workbench.interface.loops": "design experiment robust_design validate",
    "workbench.interface.models": "identify load_model trace",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    found = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME_OF})
