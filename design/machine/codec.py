"""Numbers in SI and other values as results write them, and read back, by what stands in the
annotation of a field:

    h: Annotated[float, InUnit("s", above_0=True)]
    gains: Annotated[PIDGains | None, numbers(PIDGains, {"k_R": "stiffness", "T_i": "s"})]

Pydantic does both. What is written in another unit is converted; what is refused is so at its
place. What hangs on more than the value itself, an `Around` holds.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, get_args

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, TypeAdapter
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import PydanticCustomError, core_schema

from design.machine.nearest import nearest
from design.machine.plain import as_number
from design.machine.readable import Conversion, Display, converted, in_unit, no_conversion
from identification.effects._library import Library
from identification.errors import BadModel, BadSpecification
from identification.log import Motion
from identification.model.estimates import Estimate
from identification.model.plant import actuator_units

UNKNOWN_KEY = "unexpected_keyword_argument"  # as pydantic calls it
OF_OURS = "refused"  # type of an error of ours, whose text has PLACEHOLDER for where it is
PLACEHOLDER = "\0"
Output = Literal["command", "force"]
NO_LIMIT = "the card gives no control_limit"


class Around(NamedTuple):
    """What the written form of a value hangs on: the machine's units, its command, None where that
    is not known, and what its laws give.

    in_full: a parameter is written with all keys, also those that say nothing. library: the effects
    that a file may name. conversion: of the units of a file that is read.
    """

    units: Display
    command: "Command | None" = None
    output: Output = "command"
    in_full: bool = False
    library: Library | None = None
    conversion: Conversion = no_conversion

    @property
    def motion(self) -> Motion:
        """How the machine moves."""
        return self.units.motion

    @property
    def actuator(self) -> Mapping[str, str]:
        """Units of k1, k2 and k_a."""
        return actuator_units(self.motion, self.units.command)

    @property
    def limit(self) -> float | None:
        return self.command.limit if self.command else None


def entry(one: Estimate, around: Around) -> dict[str, Any]:
    """A parameter as a result carries it."""
    return asdict(one) if around.in_full else as_number(one)


# A parameter in the unit that it has.
Parameter = Annotated[Estimate, PlainSerializer(lambda one, info: entry(one, info.context))]


def around_in(table: object, motion: str, other: object, command: str) -> Around:
    """What the numbers hang on in a file of which nothing is checked yet: its motion stands in the
    one table by that key, the unit of its command in the other."""
    own, beside = (one if isinstance(one, Mapping) else {} for one in (table, other))
    unit = beside.get(command)
    moves: Motion = "rotary" if own.get(motion) == "rotary" else "linear"
    if not isinstance(unit, str):
        return Around(Display(moves))
    return Around(Display(moves, unit), Command(unit, None, None))


def written(value: Any, around: Around) -> Any:
    """The value as a result holds it, as plain values."""
    kind: Any = type(value)
    return _written_as(kind).dump_python(value, by_alias=True, context=around, warnings=False)


@cache
def _written_as(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


@dataclass(frozen=True)
class InUnit:
    """A number, or an estimate, is written with this unit, or that of a quantity of the machine.

    above_0: it has to be; why_none: the reason with which None is written, None where no number is;
    for_readers: the file has it for its reader alone, it is not looked at.
    """

    unit: str
    above_0: bool = False
    why_none: str | None = None
    for_readers: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        kinds = (source, *get_args(source))
        optional = type(None) in kinds and self.why_none is None
        form = Parameter | None if optional else Parameter
        whole = Estimate in kinds

        def read(found: Estimate | None, info: Any) -> Any:
            if found is None or self.for_readers:
                return found and found.value
            unit, conversion = info.context.units.named(self.unit), info.context.conversion
            with at_its_place():
                if whole:
                    return in_unit(found, unit, f"[{PLACEHOLDER}]", conversion)
                if found.value is None and self.why_none is not None:
                    if not found.reason:
                        raise BadModel(f"[{PLACEHOLDER}] is null; it needs a 'reason'")
                    return None
                of_kind = positive if self.above_0 else number
                return of_kind(found, unit, PLACEHOLDER, conversion)

        def write(value: Any, info: Any) -> Any:
            if whole or (value is None and self.why_none is None):
                return value
            reason = self.why_none if value is None else None
            return Estimate(value, info.context.units.named(self.unit), reason=reason)

        return _schema(handler, form, read, write)


@dataclass(frozen=True)
class Command:
    """What the drive takes: its unit, and the limit of its size in that unit, None for none.

    force_per_command: a motor's k_a [N per unit], 1 where the drive takes a force, None where an
    actuator stands between.
    """

    unit: str
    limit: Annotated[float | None, InUnit("command", above_0=True, why_none=NO_LIMIT)]
    force_per_command: Annotated[float | None, InUnit("force_per_command")]


@dataclass(frozen=True)
class Through:
    """A value is written as one of the class `form`, or None as null, and made of it again.

    read: of the form and pydantic's information, which has what is around the value as its context;
    write: of the value and what is around it, by default as it is.
    """

    form: Any
    read: Callable[[Any, Any], Any]
    write: Callable[[Any, Around], Any] = lambda value, _around: value

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        def read(found: Any, info: Any) -> Any:
            with at_its_place():
                return None if found is None else self.read(found, info)

        def write(value: Any, info: Any) -> Any:
            return None if value is None else self.write(value, info.context)

        optional = type(None) in get_args(source)
        return _schema(handler, self.form | None if optional else self.form, read, write)


def in_units(
    found: Mapping[str, Estimate], units: Mapping[str, str], conversion: Conversion
) -> dict[str, Estimate]:
    """Parameters in their units; those of other names are left to who knows them."""
    return {
        name: in_unit(one, units.get(name, one.unit), f"[{PLACEHOLDER}.{name}]", conversion)
        for name, one in found.items()
    }


def pairs(raw: object, ours: object, where: str = "") -> Iterator[tuple[str, Estimate, Estimate]]:
    """Every parameter of a file as it is written and in our units, with its place."""
    if not (isinstance(raw, Mapping) and isinstance(ours, Mapping)):
        return
    if "value" in ours and "unit" in ours:
        yield where, Estimate(**raw), Estimate(**ours)
        return
    for key, one in raw.items():
        yield from pairs(one, ours.get(key), f"{where}.{key}" if where else key)


def said_of(found: Iterable[tuple[str, Estimate, Estimate]]) -> tuple[str, ...]:
    """A line for each parameter that is written in another unit than ours."""
    lines = (converted(one, ours, f"[{where}]") for where, one, ours in found)
    return tuple(line for line in lines if line)


def _schema(handler: Any, form: Any, read: Any, write: Any) -> core_schema.CoreSchema:
    own = handler.generate_schema(form)
    out = core_schema.plain_serializer_function_ser_schema(write, info_arg=True, return_schema=own)
    return core_schema.with_info_after_validator_function(read, own, serialization=out)


def numbers(
    make: Callable[..., Any], units: Mapping[str, str], *,
    derived: tuple[str, ...] = (), above_0: bool = False,
) -> Through:  # fmt: skip
    """A value of so many numbers is written as these by name, each with its unit.

    derived: names of numbers that a file may have beside them, for its reader alone.
    """

    def write(value: Any, around: Around) -> dict[str, Estimate]:
        own = dict(zip(units, value, strict=True)) if isinstance(value, tuple) else vars(value)
        return {
            name: Estimate(own[name], unit) for name, unit in around.units.by_name(units).items()
        }

    def read(found: Mapping[str, Estimate | None], info: Any) -> Any:
        own = {name: one for name, one in found.items() if name not in derived}
        wanted = info.context.units.by_name(units)
        return make(**numbers_of(own, wanted, PLACEHOLDER, info.context, above_0=above_0))

    return Through(Mapping[str, Parameter | None], read, write)


def numbers_of(
    found: Mapping[str, Estimate | None], units: Mapping[str, str], where: str, around: Around, *,
    above_0: bool = False,
) -> dict[str, float]:  # fmt: skip
    """The numbers of these names; raises BadModel where one is missing or is not known."""
    for name in found:
        if name not in units:
            raise BadModel(f"[{where}] unknown key {name!r}{nearest(name, units)}")
    out, read = {}, positive if above_0 else number
    for name, unit in units.items():
        one = found.get(name)
        if one is None:
            raise BadModel(f"[{where}] has no {name!r}; add it, or run the command again")
        out[name] = read(one, unit, f"{where}.{name}", around.conversion)
    return out


@contextmanager
def at_its_place() -> Iterator[None]:
    """What is refused within, as an error of which pydantic knows the place."""
    try:
        yield
    except (BadModel, BadSpecification) as error:
        raise PydanticCustomError(OF_OURS, "{said}", {"said": str(error)}) from None


def no_key(_value: object) -> object:
    """Refuses a key that is no part of the file."""
    raise PydanticCustomError(UNKNOWN_KEY, "no key of a file")


# Of a field that is no part of the file.
UNWRITTEN: tuple[Any, ...] = (
    Field(exclude=True),
    SkipJsonSchema(),  # type: ignore[type-arg]  # generic for type checkers alone
)
NOT_WRITTEN: tuple[Any, ...] = (BeforeValidator(no_key), *UNWRITTEN)


def number(found: Estimate, unit: str, where: str, conversion: Conversion) -> float:
    """A chosen value in `unit`; raises BadModel where there is none, or in another kind of unit."""
    value = in_unit(found, unit, f"[{where}]", conversion).value
    if value is None:
        raise BadModel(f"[{where}] is null; a number in {unit!r} needed")
    return value


def positive(found: Estimate, unit: str, where: str, conversion: Conversion) -> float:
    """As `number`, above 0."""
    value = number(found, unit, where, conversion)
    if not (value > 0 and np.isfinite(value)):
        raise BadModel(f"[{where}] {value:g} {unit}: must be > 0")
    return value
