"""What an effect is: one declaration that simulation, regression, trace and reports all read.

A kernel is a plain function of floats

    value(t, y, v, F, u, d, z, c, f, s, p) -> float

t [s] since the log's start, y [m], v [m/s] of the body, F applied force [N], u command [V];
d direction: +1 or -1 (0 at rest, in `evolve`), of u where the effect acts on the command; z the
effect's own state; c Coulomb level and f whole friction of the nine parameters in direction d [N],
positive (at rest both are the stick limit); s the signals of `signals` in their order, p the
parameters in the order of `params`.
Rotary rigs use rad, N m and kg m^2 in the same places.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from identification.arrays import Array
from identification.effects._places import PLACES, Acts, Place
from identification.errors import BadModel

Kernel = Callable[..., float]
# A number and numbers, as the kernels' eleven arguments are annotated.
R = float
Rs = Sequence[float]
Role = Literal["period", "place", "width", "known", "bend"]
MAX_PARAMS = 8
MAX_SIGNALS = 4
AT_REST = ("at_rest_p", "at_rest_n")  # parameters that sliding does not identify


@dataclass(frozen=True)
class Param:
    """One parameter: unit, bounds, a typical value, and whether the effect is linear in it.

    `default` is what a recipe may leave out. Bounds in SI. role: what it is along the stroke, where
    a search has to know: a length over which it repeats, a place, the width of a place, known from
    the machine's geometry and not sought, or how a scale of the position bends.
    """

    name: str
    unit: str
    low: float
    high: float
    typical: float
    meaning: str
    linear: bool = False
    default: float | None = None
    role: Role | None = None

    @property
    def optional(self) -> bool:
        """Whether it is part of a law's shape that stays at its default unless the logs call for
        another value."""
        return self.default is not None and not self.linear and self.name not in AT_REST

    @property
    def spare(self) -> bool:
        """Whether it is a size that an effect may do without."""
        return self.linear and self.default == 0.0

    def at_default(self, value: float) -> bool:
        """Whether it is such a part, and at its default."""
        return self.optional and value == self.default


@dataclass(frozen=True)
class Effect:
    """One physical effect that the Karnopp model lacks.

    equation: of `value`, as text that a computer-algebra package reads, in the kernel's symbols
    and the names of `params` and `signals`. evolve: the state after dt, `evolve(dt, t, ..., p)`;
    initial: the state at the start, as `value` (0 where None). signals: names of the log's signals
    that it uses, of which those in `needs` must be there (others read as 0). depends_on: signals
    with which its contribution varies, at once or by its state ("rest", "reversal": by what the
    motion before has left). state_unit: unit of z, which may be any. Raises BadModel where the
    declaration contradicts itself.
    """

    key: str
    meaning: str
    equation: str
    source: str
    acts: Acts
    params: tuple[Param, ...]
    value: Kernel
    depends_on: tuple[str, ...]
    evolve: Kernel | None = None
    initial: Kernel | None = None
    signals: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    state_unit: str | None = None

    def __post_init__(self) -> None:
        problem = None
        if not self.key.isidentifier():
            problem = "its key must be a word of letters, digits and underscores"
        elif self.acts not in PLACES:
            problem = f"acts = {self.acts!r}, must be one of {', '.join(PLACES)}"
        elif len(self.params) > MAX_PARAMS or len(self.signals) > MAX_SIGNALS:
            problem = f"at most {MAX_PARAMS} parameters and {MAX_SIGNALS} signals"
        elif not set(self.needs) <= set(self.signals):
            problem = f"needs {self.needs} must be among its signals {self.signals}"
        for p in self.params:
            values = [p.typical] if p.default is None else [p.typical, p.default]
            if not all(p.low <= value <= p.high for value in values):
                problem = f"{p.name}: typical and default must lie in [{p.low:g}, {p.high:g}]"
        if problem:
            raise BadModel(f"effect {self.key!r}: {problem}")

    @property
    def place(self) -> Place:
        """What it means to act where it acts."""
        return PLACES[self.acts]

    @property
    def load_dependent(self) -> bool:
        """Whether it is friction that depends on the applied force."""
        return self.place.rubs and "F" in self.depends_on

    def named(self, role: Role) -> str | None:
        """Name of the parameter in this role, None where it has none."""
        return next((p.name for p in self.params if p.role == role), None)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(p.name for p in self.params)

    @property
    def linear(self) -> tuple[str, ...]:
        """Names of the parameters in which `value` is linear."""
        return tuple(p.name for p in self.params if p.linear)

    @cached_property
    def pointers(self) -> tuple[Any, Any, Any]:
        """Compiled `value`, `evolve` and `initial`, None where there is none; cached on disk."""
        from identification.compiled import kernel_pointer  # numba takes half a second to import

        parts = ((self.value, False), (self.evolve, True), (self.initial, False))
        return tuple(k and kernel_pointer(k, self.key, step) for k, step in parts)  # type: ignore[return-value]

    @property
    def addresses(self) -> tuple[int, int, int]:
        """Addresses of the compiled kernels, 0 where there is none."""
        value, evolve, initial = (int(k.address) if k else 0 for k in self.pointers)
        return value, evolve, initial

    def acting(self, values: Mapping[str, float]) -> "Acting":
        """The effect with these parameters; raises BadModel where one is unknown or missing."""
        return Acting(self, tuple(self._one(p, values) for p in self._known(values)))

    def _known(self, values: Mapping[str, float]) -> tuple[Param, ...]:
        for name in values:
            if name not in self.names:
                raise BadModel(
                    f"effect {self.key!r} has no parameter {name!r}; it has {', '.join(self.names)}"
                )
        return self.params

    def _one(self, p: Param, values: Mapping[str, float]) -> float:
        value = values.get(p.name, p.default)
        if value is None:
            raise BadModel(f"effect {self.key!r} lacks {p.name} [{p.unit}]: {p.meaning}")
        if not (np.isfinite(value) and p.low <= value <= p.high):
            raise BadModel(
                f"effect {self.key!r}: {p.name} = {value:g} {p.unit}, must lie in"
                f" [{p.low:g}, {p.high:g}]"
            )
        return float(value)


@dataclass(frozen=True)
class Acting:
    """An effect with its parameters, in the order of `effect.params`."""

    effect: Effect
    p: tuple[float, ...]

    @property
    def key(self) -> str:
        """The effect's key."""
        return self.effect.key

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return dict(zip(self.effect.names, self.p, strict=True))

    @property
    def array(self) -> Array:
        """Parameters as the kernels take them, (MAX_PARAMS,)."""
        return np.pad(np.array(self.p, dtype=np.float64), (0, MAX_PARAMS - len(self.p)))


def asymmetry() -> Param:
    """Relative difference of the two directions; the effect's size is times (1 + asymmetry d)."""
    return Param(
        "asymmetry", "1", -1.0, 1.0, 0.0, "how much more in positive direction", default=0.0
    )


def at_rest() -> tuple[Param, Param]:
    """Shares of friction added while sliding that are added to either stick limit too.

    1 adds the same; the ratio of stick limit to Coulomb level scales both alike.
    """
    return _share_at_rest(AT_REST[0], "positive"), _share_at_rest(AT_REST[1], "negative")


def _share_at_rest(name: str, way: str) -> Param:
    return Param(name, "1", 0.0, 5.0, 1.0, f"share that adds to the {way} stick limit", default=1.0)
