"""A page an effect, out of its declaration, with a picture of a machine with and without it."""

from collections.abc import Collection, Iterator
from pathlib import Path

import sympy  # type: ignore[import-untyped]

from docs._ext.effect_pictures import draw
from identification.effect_contract.declaration import STATE_NAMES
from identification.effects._base import Effect, Param
from identification.effects._library import built_in

GREEK = ("tau", "mu", "sigma", "delta")
HEAD = """# Effects

What `workbench trace` knows to look for, and what a recipe or a model may hold. Each page is made
of the effect's own declaration. Its picture is the rig of [the paper's](../../glossary.md) table 2
in simulation, driven by the same command with the effect and without it. An effect of your own is
one file: [Contributing](../../contributing.md#one-effect-one-file) says how.

| effect | is | acts on | shows with |
|---|---|---|---|
"""
SIGNALS = {
    "y": "position", "v": "speed", "F": "force", "u": "command", "t": "time", "p_p": "pressure p_p",
    "p_n": "pressure p_n", "rest": "how long the body has been at rest",
    "reversal": "the way since the motion reversed",
}  # fmt: skip
MUST = {
    "y": "a motion over the stroke, so that place can be distinguished from speed",
    "v": "sliding at many speeds, slow ones too",
    "F": "forces that vary apart from speed: acceleration, braking, a load",
    "u": "the command itself, and changes of its sign",
    "t": "minutes rather than seconds, from a cold start",
    "p_p": "pressure levels that differ, within a log or from log to log",
    "p_n": "pressure levels that differ, within a log or from log to log",
    "rest": "rests of different length, each ended by a breakaway",
    "reversal": "many reversals, with small motions between them",
}
ACTS = {
    "slip": "sliding friction", "stiction": "the stick limits",
    "friction": "friction, sliding and at rest",
    "bristle": "sticking, which it replaces", "force": "the body, as a force",
    "actuator": "the actuator's force", "command": "the command", "delay": "the command",
    "sensor": "the position transducer",
}  # fmt: skip


def pages(pictures: Path, keys: Collection[str] | None = None) -> Iterator[tuple[str, str]]:
    """Names and texts of the pages; their pictures are written to that folder.

    keys: of the effects that get a page, by default all.
    """
    library = built_in()
    pictures.mkdir(parents=True, exist_ok=True)
    rows = []
    for key, effect in library.items():
        on = ", ".join(SIGNALS[one] for one in effect.depends_on) or "every sample"
        rows.append(f"| [{key}]({key}.md) | {effect.meaning} | {ACTS[effect.acts]} | {on} |")
        if keys is None or key in keys:
            draw(effect, pictures / f"{key}.svg")
            yield f"effects/{key}.md", _page(effect)
    below = ["", "", "```{toctree}", ":hidden:", "", *library, "```", ""]
    yield "effects/index.md", HEAD + "\n".join(rows) + "\n".join(below)


def _page(effect: Effect) -> str:
    rows = [
        f"| `{p.name}` | {p.unit} | {p.meaning} | {p.low:g} to {p.high:g} | {p.typical:g} "
        f"| {'–' if p.default is None else f'{p.default:g}'} |"
        for p in effect.params
    ]
    must = [f"- {MUST[one]}" for one in effect.depends_on] or ["- nothing but sliding both ways"]
    must += [f"- the signal `{one}`" for one in effect.needs]
    recipe = [f"[recipe.effects.{effect.key}]"]
    recipe += [f"{p.name} = {_written(p)}" for p in effect.params if p.default is None]
    return f"""# {effect.key}

{effect.meaning[:1].upper()}{effect.meaning[1:]}.

$$
{latex(effect)}
$$

It gives the {effect.place.gives}. It acts on {ACTS[effect.acts]}. In words of the code:
`{effect.equation}`.

![The same machine with {effect.key} and without it]({effect.key}.svg)

| parameter | unit | is | bounds | typical | unless given |
|---|---|---|---|---|---|
{chr(10).join(rows)}

**What a log must show.** For `trace` to tell it from its rivals:

{chr(10).join(must)}

**Source.** {effect.source}

**In a recipe**, to simulate it:

```toml
{chr(10).join(recipe)}
```
"""


def _written(p: Param) -> str:
    """The typical value as a card writes it, with its unit where that is a fixed one."""
    if p.unit == "1" or "**n" in p.unit:
        return f"{p.typical:g}"
    return f'"{p.typical:g} {p.unit.replace("**", "^")}"'


def latex(effect: Effect) -> str:
    """The effect's equation as a formula."""
    names = (*STATE_NAMES, *effect.signals, *effect.names)
    symbols = {name: sympy.Symbol(name, real=True) for name in names}
    found = sympy.parse_expr(effect.equation, local_dict=symbols, evaluate=False)
    words = {symbols[name]: _upright(name) for name in names if len(name.partition("_")[0]) > 1}
    text = str(sympy.latex(found, symbol_names=words))
    return text.replace(r"\text{for}\: ", r"\quad\text{for } ")


def _upright(name: str) -> str:
    """A name of more than one letter as a formula has it."""
    base, _, below = name.partition("_")
    word = f"\\{base}" if base in GREEK else rf"\mathrm{{{base}}}"
    return rf"{word}_{{{below.replace('_', ' ')}}}\," if below else rf"{word}\,"
