"""Figures 11 to 22 and the printed sums: the rig of section 3.3, before and after its drift.

The compensators are built on what is identified from simulated logs of the rig, not on the tables.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.loop import LoopNoise
from design.servo import Compensation, simulate_servo
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import NAMES, Karnopp
from identification.model.plant import Actuator
from identification.signals.excitation import RandomSteps, reference_signal
from studies.paper.measures import Case, compare
from studies.paper.settings import (
    NOISE_F,
    NOISE_Y,
    SetUp,
    friction_of,
    rig,
    rig_pd,
    rig_pid,
    rig_rst,
    steps,
)

EXPERIMENT = 60.0  # s
STEP_LEVEL, STEP_DWELL = 0.05, 2.0  # of its random steps [m], [s]
STIFFER = 4.0  # the rig's PD times this moves the machine enough to tell its parameters


@dataclass(frozen=True)
class IdentifiedRig:
    """The rig identified from one simulated log, and the true values beside."""

    fit: KarnoppFit
    truth: Karnopp

    @property
    def friction(self) -> Karnopp:
        """The nine, estimated."""
        return Karnopp(**{name: _value(self.fit, name) for name in NAMES})

    @property
    def actuator(self) -> Actuator:
        """k1 and k2, estimated."""
        return Actuator(_value(self.fit, "k1"), _value(self.fit, "k2"))

    @property
    def errors(self) -> dict[str, float]:
        """Relative error of each of the nine."""
        return {n: getattr(self.friction, n) / getattr(self.truth, n) - 1.0 for n in NAMES}


@dataclass(frozen=True)
class RigFigures:
    """What was identified before and after the drift, and every run by name.

    before: figures 11 to 13, table 2's plant, PD, steps. drifted: by controller ("PD", "PID",
    "RST") and compensator ("none", "old", "new", "new, no F_stick"), table 3's plant.
    """

    set_up: SetUp
    stepped: SetUp
    old: IdentifiedRig
    new: IdentifiedRig
    before: dict[str, Case]
    drifted: dict[str, dict[str, Case]]

    def ratio(self, controller: str, compensator: str) -> float:
        """Squared error relative to that without compensation."""
        cases = self.drifted[controller]
        return cases[compensator].figures.squared_error / cases["none"].figures.squared_error


def identify_rig(set_up: SetUp, truth: Karnopp, seed: int) -> IdentifiedRig:
    """One experiment of 60 s on the rig with this friction, and the fit of its log."""
    rng = np.random.default_rng(seed)
    t = set_up.h * np.arange(round(EXPERIMENT / set_up.h), dtype=np.float64)
    reference = reference_signal(RandomSteps(STEP_LEVEL, STEP_DWELL), t, rng)
    pd = rig_pd()
    stiff = replace(pd, R=STIFFER * pd.R, T=STIFFER * pd.T)
    noise = LoopNoise.draw(len(t), NOISE_Y, NOISE_F, rng)
    run = simulate_servo(set_up.plant(truth), set_up.servo(stiff), reference, set_up.h, noise=noise)
    signals = {"t": run.t, "y": run.y_measured, "F": run.F_measured, "u": run.u}
    fit = fit_plant([Log("rig", signals)], np.random.default_rng(seed), rig=Rig("force"))
    return IdentifiedRig(fit, truth)


def rig_figures(seeds: Sequence[int], log_seed: int) -> RigFigures:
    """Everything of section 3.3, with one experiment before the drift and one after it."""
    set_up = rig()
    stepped = set_up.along(steps(set_up.h, 0.05, 10.0, 4))
    old, new = (identify_rig(set_up, friction_of(k), log_seed) for k in (2, 3))
    first = set_up.compensation(old.friction)
    second = set_up.compensation(new.friction)
    without = replace(first, compensator=replace(first.compensator, inner="none"))
    bare = replace(second, compensator=replace(second.compensator, stick=False))
    pd = {"none": None, "no zero-velocity": without, "eq. (4)": first}
    after: dict[str, Compensation | None] = {
        "none": None, "old": first, "new": second, "new, no F_stick": bare
    }  # fmt: skip
    laws = {"PD": rig_pd(), "PID": rig_pid(), "RST": rig_rst()}
    return RigFigures(
        set_up=set_up,
        stepped=stepped,
        old=old,
        new=new,
        before=compare(
            stepped,
            friction_of(2),
            {name: set_up.servo(rig_pd(), one) for name, one in pd.items()},
            seeds,
        ),
        drifted={
            name: compare(
                set_up,
                friction_of(3),
                {key: set_up.servo(law, one) for key, one in after.items()},
                seeds,
            )
            for name, law in laws.items()
        },
    )


def _value(fit: KarnoppFit, name: str) -> float:
    value = fit.estimates[name].value
    if value is None:
        raise LookupError(f"the simulated experiment does not tell {name}")
    return value
