"""HTML from this folder's templates; symbols in words: on hover, and in a legend at the end."""

import re
from functools import cache
from typing import TYPE_CHECKING, Any

from workbench.output import templates

if TYPE_CHECKING:
    from jinja2 import Environment

SYMBOLS = {
    "m": "mass in motion (rotary: moment of inertia)",
    "F_cp": "Coulomb friction, moving towards +",
    "F_cn": "Coulomb friction, moving towards −",
    "F_vp": "viscous friction, moving towards +: force per speed",
    "F_vn": "viscous friction, moving towards −: force per speed",
    "dv_p": "upper limit of the stick band: slower than this the body counts as stuck",
    "dv_n": "lower limit of the stick band",
    "F_sp": "breakaway force towards +: what it takes to leave rest",
    "F_sn": "breakaway force towards −",
    "k1": "actuator gain: how fast the force grows per command",
    "k2": "how fast the force falls per speed",
    "k_a": "motor constant: force per command",
    "F_e": "force that the actuator applies",
    "F_ref": "force that the position controller asks for",
    "N_c": "divisor of the stick band inside which the compensator acts on the position error",
    "e_T": "position error at which the compensator pushes with the whole breakaway force",
    "w_n": "natural frequency of the closed loop's dominant poles",
    "zeta": "damping of the closed loop's dominant poles",
    "S_yp": "output sensitivity: from a disturbance to the position",
    "S_up": "input sensitivity: from measurement noise to the controller's output",
    "k_R": "gain of the PID",
    "T_i": "integral time",
    "T_d": "derivative time",
    "eps": "time constant of the derivative's filter",
    "k_i": "gain of the force loop; behind a valve, of the error's integral",
    "ARX": "linear model: the next output from past outputs and inputs",
    "RST": "polynomial controller S u = T r − R y, by pole placement",
    "PID": "proportional, integral and derivative controller",
    "rms": "root mean square",
    "chi-square": "square of what the model leaves over that of the noise; 1: noise alone",
}
# A name of one letter is a symbol only where it stands alone in a cell.
_SYMBOL_NAMES = "|".join(
    re.escape(name) for name in sorted(SYMBOLS, key=len, reverse=True) if name != "m"
)
_SYMBOL = re.compile(rf"(?<![\w/.\-])({_SYMBOL_NAMES})(?![\w/]|\.\w)")
_ALONE = re.compile(r">m</td>|>m</th>|>m</abbr>")


def explained(html: str) -> str:
    """Escaped text in which each symbol carries its meaning, shown on hover."""
    if html.strip() == "m":
        return _abbreviated("m")
    return _SYMBOL.sub(lambda found: _abbreviated(found[1]), html)


def _abbreviated(name: str) -> str:
    return f'<abbr title="{SYMBOLS[name]}">{name}</abbr>'


def used_symbols(html: str) -> list[tuple[str, str]]:
    """The symbols in a page's HTML and what they mean, in the order of the table above."""
    visible = re.sub(r"<script.*?</script>", "", html, flags=re.DOTALL)
    used = {*_SYMBOL.findall(visible), *(["m"] if _ALONE.search(visible) else [])}
    return [(name, meaning) for name, meaning in SYMBOLS.items() if name in used]


def render(template: str, **values: Any) -> str:
    """The template `<template>.html.j2` filled in; values are escaped unless marked safe."""
    return _environment().get_template(f"{template}.html.j2").render(**values)


def safe(html: str) -> Any:
    """HTML of our own making, not to be escaped."""
    from markupsafe import Markup

    return Markup(html)


def with_symbols(text: str) -> Any:
    """The text escaped, its symbols with their meaning, what stands in `...` as a command."""
    from markupsafe import escape

    return safe(re.sub(r"`([^`]+)`", r"<code>\1</code>", explained(str(escape(text)))))


@cache
def _environment() -> "Environment":
    environment = templates("workbench.report")
    environment.filters["symbols"] = with_symbols
    return environment
