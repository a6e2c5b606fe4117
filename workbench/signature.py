"""A command's options said where its function takes them, as the defaults of its parameters.

    @click.command(cls=StatusCommand)
    @by_signature
    def command(logs: tuple[str, ...] = argument("LOG...", required=True),
                seed: int = option("Of the machines drawn.", type=click.IntRange(min=0), default=0)
    ) -> None: ...

What an annotation says is not said again: a `Path` is one, a tuple may be given several times, a
`bool` is a flag, a `Literal` a choice. Name and order of the options are those of the parameters.
"""

import inspect
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import click

Command = TypeVar("Command", bound=Callable[..., Any])
Values = TypeVar("Values")
Decorator = Callable[[Any], Any]


@dataclass(frozen=True, eq=False)
class _Said:
    """A parameter as it was said: an option's own names, or none; what click gets of it.

    beside: options that come after it and that no function takes.
    """

    names: tuple[str, ...]
    how: Mapping[str, Any]
    is_argument: bool
    beside: tuple[Decorator, ...] = ()

    def decorators(self, name: str, annotation: object) -> tuple[Decorator, ...]:
        """What click makes of the parameter of that name and annotation."""
        how = {**_by_annotation(annotation, self.is_argument), **self.how}
        if self.is_argument:
            return (click.argument(name, **how),)
        names = self.names or (f"--{name.replace('_', '-')}",)
        return (click.option(*names, name, **how), *self.beside)


def option(said: str, *names: str, beside: tuple[Decorator, ...] = (), **how: Any) -> Any:
    """An option with this help; names: where it is not called as its parameter; how: as click has
    it. A default is shown."""
    shown = {"show_default": True} if "default" in how else {}
    return _Said(names, {"help": said or None, **shown, **how}, is_argument=False, beside=beside)


def argument(metavar: str | None = None, **how: Any) -> Any:
    """An argument, shown as `metavar`; how: as click has it."""
    return _Said((), {"metavar": metavar, **how}, is_argument=True)


def by_signature(command: Command) -> Command:
    """The function with the options and arguments that its parameters' defaults say."""
    for name, one in reversed([*inspect.signature(command).parameters.items()]):
        if isinstance(one.default, _Said):
            command = decorated(command, name, one.default, one.annotation)
    return command


def by_fields(values: type[Values]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The same of the fields of a class, of which the function takes one as its first argument."""

    def with_fields(function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def command(**given: Any) -> Any:
            own = values(**{name: given.pop(name) for name in values.__annotations__})
            return function(own, **given)

        for name, annotation in reversed([*values.__annotations__.items()]):
            command = decorated(command, name, getattr(values, name), annotation)
        return command

    return with_fields


def decorated(command: Command, name: str, said: Any, annotation: object) -> Command:
    """The function with one more option or argument, before those that it has."""
    for decorator in reversed(said.decorators(name, annotation)):
        command = decorator(command)
    return command


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
