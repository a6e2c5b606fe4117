"""A command's options said where its function takes them, as the defaults of its parameters.

    @options.command(epilog="Example: workbench drawn run1.csv")
    def command(logs: tuple[str, ...] = argument("LOG...", required=True),
                seed: int = option("Of the machines drawn.", type=click.IntRange(min=0), default=0)
    ) -> None: ...

What an annotation says is not said again: a `Path` is one, a tuple may be given several times, a
`bool` is a flag, a `Literal` a choice; a dataclass stands for the options that its fields say, with
`option` or, where it is also made elsewhere, with `asked`; of one that knows of no options,
`options_of` says them. Name and order of the options are those of the parameters.
"""

import inspect
import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

import click

Decorator = Callable[[Any], Any]


@dataclass(frozen=True, eq=False)
class _Said:
    """A parameter as it was said: an option's own names, or none; what click gets of it.

    last: whether it stands behind the options of every command.
    """

    names: tuple[str, ...]
    how: Mapping[str, Any]
    is_argument: bool
    last: bool = False

    def decorator(self, name: str, annotation: object) -> Decorator:
        """What click makes of the parameter of that name and annotation."""
        how = {**_by_annotation(annotation, self.is_argument), **self.how}
        if self.is_argument:
            return click.argument(name, **how)
        names = self.names or (f"--{name.replace('_', '-')}",)
        return click.option(*names, name, **how)


def option(said: str, *names: str, last: bool = False, **how: Any) -> Any:
    """An option with this help; names: where it is not called as its parameter; last: it stands
    behind the options of every command; how: as click has it. A default is shown."""
    shown = {"show_default": True} if how.get("default", ()) != () else {}
    return _Said(names, {"help": said or None, **shown, **how}, is_argument=False, last=last)


def asked(default: object, said: str, *names: str, **how: Any) -> Any:
    """A field of a dataclass with its default, and the option that says it, as `option` has it."""
    how |= {} if default is None else {"default": default}
    return field(default=default, metadata={"said": option(said, *names, **how)})


@dataclass(frozen=True, eq=False)
class _Group:
    """A parameter that is a dataclass: what each of its fields that is an option was said as."""

    options: Mapping[str, Any]


def options_of(kind: Any, **how: Any) -> Any:
    """A dataclass whose fields say default and meaning, as `design.asked` has them, with the option
    of each that `how` names: as click has it, `names` where it is not called as the field, or the
    options of a dataclass within."""
    options = dict[str, Any]()
    for one in fields(kind):
        own = how.get(one.name)
        if isinstance(own, Mapping):
            given: dict[str, Any] = {key: value for key, value in own.items() if key != "names"}
            given |= {} if one.default is None else {"default": one.default}
            own = option(one.metadata["meaning"], *own.get("names", ()), **given)
        options[one.name] = own
    return _Group(options)


def argument(metavar: str | None = None, **how: Any) -> Any:
    """An argument, shown as `metavar`; how: as click has it."""
    return _Said((), {"metavar": metavar, **how}, is_argument=True)


def by_signature(function: Callable[..., Any], shared: Decorator) -> Callable[..., Any]:
    """The function with the options and arguments that its parameters' defaults say, and the
    options that every command shares."""
    parameters = inspect.signature(function).parameters.values()
    groups = {one.name: one.annotation for one in parameters if is_dataclass(one.annotation)}

    @wraps(function)
    def command(**given: Any) -> Any:
        own = {name: _made(group, given) for name, group in groups.items()}
        return function(**own, **given)

    said = [each for p in parameters for each in _options(p.name, p.annotation, p.default)]
    said.sort(key=lambda one: one[1].last)
    decorators = [one.decorator(name, kind) for name, one, kind in said]
    decorators.insert(len(said) - sum(one.last for _, one, _ in said), shared)
    for decorator in reversed(decorators):
        command = decorator(command)
    return command


def _options(name: str, kind: Any, default: object) -> Iterator[tuple[str, _Said, object]]:
    """Name, option and annotation of a parameter, or of each field of its dataclass."""
    if is_dataclass(kind):
        own = default.options if isinstance(default, _Group) else {}
        for one in fields(kind):
            said = own.get(one.name, one.metadata.get("said", one.default))
            yield from _options(one.name, one.type, said)
    elif isinstance(default, _Said):
        yield name, default, kind


def _made(group: Any, given: dict[str, Any]) -> Any:
    """A dataclass of what is given, which its fields then have; others have their defaults."""
    own = dict[str, Any]()
    for one in fields(group):
        if is_dataclass(one.type):
            own[one.name] = _made(one.type, given)
        elif one.name in given:
            own[one.name] = given.pop(one.name)
    return group(**own)


def _by_annotation(annotation: object, is_argument: bool) -> dict[str, Any]:
    """What click need not be given, since the annotation says it."""
    how: dict[str, Any] = {}
    of = get_args(annotation)
    if get_origin(annotation) is tuple and of[-1] is Ellipsis:
        how |= {"nargs": -1} if is_argument else {"multiple": True}
        annotation = of[0]
    elif get_origin(annotation) in (Union, types.UnionType):
        how |= {"required": False} if is_argument else {}
        annotation = next(one for one in of if one is not types.NoneType)
    if annotation is Path:
        how["type"] = click.Path(path_type=Path)
    elif annotation is bool:
        how["is_flag"] = True
    elif get_origin(annotation) is Literal:
        how["type"] = click.Choice(get_args(annotation))
    return how
