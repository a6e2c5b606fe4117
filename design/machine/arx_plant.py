"""The ARX plant of a model: a linear one between its input and the position."""

from dataclasses import dataclass
from typing import Literal

from identification.errors import BadModel


@dataclass(frozen=True)
class ArxTests:
    """P-values of the residual tests at 99 %: white errors, errors free of the input."""

    whiteness_p: float
    cross_p: float | None
    lag_step: int


@dataclass(frozen=True)
class ArxPlant:
    """A(z^-1) y = B(z^-1) input + offset; y in m, `input` "F" [N] or "u" [V], period h [s].

    B ascends in z^-1 with `nk` zeros first; sd_a, sd_b belong to a1.. and b1... The errors are
    root mean squares on held-out samples [m]: one step ahead, and simulated freely
    (None: it runs away), the latter also relative to the deviation of y.
    """

    na: int
    nb: int
    nk: int
    A: tuple[float, ...]
    B: tuple[float, ...]
    h: float
    input: Literal["F", "u"]
    offset: float
    sd_a: tuple[float, ...]
    sd_b: tuple[float, ...]
    one_step_rms: float
    simulation_rms: float | None
    simulation_relative: float | None
    tests: ArxTests | None

    def __post_init__(self) -> None:
        if len(self.A) != self.na + 1 or self.A[0] != 1.0:
            raise BadModel(f"[plant] A has {len(self.A)} values from {self.A[:1]}; 1 and na needed")
        if not self.h > 0:
            raise BadModel(f"[plant] h = {self.h:g} s, must be > 0")
