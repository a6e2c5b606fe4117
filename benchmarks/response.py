"""Frequency responses from logs in closed loop, of machines with friction, beside the truth.

    python benchmarks/response.py [--first 100] [--machines 20] [--rigid 20] [--seconds 60]
        [--friction identified|rough|left] [--models FOLDER]

Every seed draws a machine with a load behind a spring and one without (`response_rig`, a simulator
of its own), and 60 s at 2 kHz of moves, in two of three with a small multisine on the reference,
noise on position and force, an encoder on some. `response` is asked for the plant, as its command
does it; friction: by a model identified from the first 10 s of the log, by the true
parameters each off by 3 % (one sigma, viscous friction 10 %), or left in.
Reported are: of the points whose coherence is above 0.8, how many lie within 1 dB and 5 degrees of
the truth (with friction left in too), and how many within the 95 % bands; resonances and
anti-resonances that the points reach, how many are found within 2 %, and within their 95 %
interval; those that are invented; processor seconds. --models: where the identified models are kept
from run to run. Seeds below 100 served to choose, and 100 to 106 for the least that a swinging load
has to explain.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import workbench as wb
from benchmarks.response_rig import Machine, machine, record
from design.machine.model import FitSummary, LogEntry, Model
from design.measured.response import Responded
from identification.frequency.estimate import Response
from identification.frequency.modes import Peak
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import UNITS
from identification.thresholds import COHERENCE_SURE

NEAR_DB, NEAR_DEG, NEAR_PEAK = 1.0, 5.0, 0.02
IDENTIFIED_FROM = 10.0  # s at the begin of the log
RIG = {"kind": "motor", "force_per_command": "1 N/V"}
SIGNALS = {"t": "t", "r": "r", "y": "y", "u": ("u", "V")}


@dataclass(frozen=True)
class Judged:
    """Points that count, those near the truth, those within the band; peaks within reach, found,
    those within their interval, invented; processor seconds of the response and of the
    identification; highest sure frequency [Hz]; points and those near with friction left in."""

    points: int
    near: int
    inside: int
    reached: int
    found: int
    summed_up: int
    invented: int
    seconds: float
    identified: float
    top: float
    points_left: int
    near_left: int


def identified(frame: pd.DataFrame, file: Path | None) -> Model | None:
    """The model of the log's first seconds, from its file where there is one; None where there is
    none to be had, as the command has it then."""
    if file is not None and file.exists():
        return wb.load_model(file)
    try:
        found = wb.identify(frame[frame["t"] < IDENTIFIED_FROM], rig=RIG, signals=SIGNALS)
    except wb.NotIdentifiable as error:
        print(f"      not identified: {error}"[:120], flush=True)
        return None
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(found.to_json(), encoding="utf-8")
    return found.model


def judged(one: Machine, seed: int, seconds: float, friction: str, folder: Path | None) -> Judged:
    """A machine's log, its response, and how far that is from the truth."""
    rec = record(one, seed, seconds)
    frame = pd.DataFrame({"t": rec.h * np.arange(len(rec.r)), "r": rec.r, "y": rec.y, "u": rec.u})
    begun = time.process_time()
    kind = "one" if one.m_2 == 0.0 else "two"
    file = None if folder is None else folder / f"{kind}-{seed}.json"
    match friction:
        case "left":
            model = None
        case "rough":
            model = rough(one, seed)
        case _:
            model = identified(frame, file)
    middle = time.process_time()
    found = wb.response(
        frame, rig=RIG, signals=SIGNALS, model=model, friction_left_in=model is None
    ).found
    ended = time.process_time()
    points, near, inside = of_points(found.found.position, one)
    by_position = -1.0 / (2.0 * np.pi * found.found.f) ** 2
    points_left, near_left, _ = of_points(found.found.with_friction.times(by_position), one)
    reached, hit, reported_right, invented = of_peaks(found, one)
    sure = found.found.body.sure
    top = float(np.max(found.found.f[sure], initial=0.0))
    return Judged(
        points, near, inside, reached, hit, reported_right, invented,
        ended - middle, middle - begun, top, points_left, near_left,
    )  # fmt: skip


def rough(one: Machine, seed: int) -> Model:
    """A model of one mass by the machine's own numbers, each off by some percent."""
    rng = np.random.default_rng([seed, 5])
    own = {"m": one.mass, "F_cp": one.F_cp, "F_cn": one.F_cn, "F_vp": one.F_vp, "F_vn": one.F_vn,
           "dv_p": 1e-4, "dv_n": -1e-4, "F_sp": one.F_s, "F_sn": -one.F_s}  # fmt: skip
    off = {name: 0.1 if name in ("F_vp", "F_vn") else 0.03 for name in own}
    friction = {
        name: Estimate(value * (1.0 + off[name] * rng.standard_normal()), UNITS[name])
        for name, value in own.items()
    }
    entry = LogEntry("run", "0" * 64, 1, (0.0, 0.0, 0.0), (-0.1, 0.1), 1.0, 1.0, 5e-4, 0.0, None,
                     1.0)  # fmt: skip
    summary = FitSummary("command", 0.0, one.noise_y, one.noise_F, 1.0, True, 1, None, None, ())
    return Model(
        card="machine", rig=Rig("motor", force_per_command=1.0), friction=friction,
        actuator={"k_a": Estimate(1.0, "N/V")}, plant=None, plant_reason="none was fitted",
        fit=summary, log=(entry,), versions={},
    )  # fmt: skip


def of_points(plant: Response, one: Machine) -> tuple[int, int, int]:
    """Points of a coherence above 0.8: all, near the truth, within the band."""
    sure = plant.sure
    off = plant.H[sure] / one.truth(plant.f[sure])
    near = (np.abs(20.0 * np.log10(np.abs(off))) < NEAR_DB) & (
        np.abs(np.degrees(np.angle(off))) < NEAR_DEG
    )
    half = plant.half_band[sure]
    inside = np.abs(np.abs(off) - 1.0) < half
    return int(sure.sum()), int(near.sum()), int(inside.sum())


def of_peaks(found: Responded, one: Machine) -> tuple[int, int, int, int]:
    """Peaks of the machine that the seen points have on both sides, found within 2 %, within their
    interval, invented."""
    body = found.found.body
    seen = body.f[body.seen]
    true = {"resonance": one.resonance, "anti-resonance": one.anti_resonance}
    reached = hit = inside = 0
    left = list(found.peaks)
    for kind, f in true.items():
        if f is None:
            continue
        around = (
            np.count_nonzero((seen > 0.9 * f) & (seen < f)),
            np.count_nonzero((seen > f) & (seen < 1.1 * f)),
        )
        reached += int(min(around) >= 3)
        near = [p for p in left if p.kind == kind and abs(p.frequency.value / f - 1.0) < NEAR_PEAK]
        hit += int(bool(near) and min(around) >= 3)
        inside += any(
            abs(p.frequency.value - f) < 1.96 * p.frequency.sd for p in near if min(around) >= 3
        )
        for p in near[:1]:
            left.remove(p)
    return reached, hit, inside, len([p for p in left if not _near_one(p, one)])


def _near_one(peak: Peak, one: Machine) -> bool:
    """Whether a peak is one of the machine's, if reported badly (10 %)."""
    true = {"resonance": one.resonance, "anti-resonance": one.anti_resonance}[peak.kind]
    return true is not None and abs(peak.frequency.value / true - 1.0) < 0.1


def summed_up(name: str, every: Sequence[Judged]) -> str:
    """What all machines add up to, in a line."""
    keys = ("points", "near", "inside", "reached", "found", "reported", "invented", "points_left",
            "near_left")  # fmt: skip
    total = {key: sum(getattr(one, key) for one in every) for key in keys}
    shares = [one.near / one.points for one in every if one.points]
    points = max(total["points"], 1)
    seconds = [one.seconds for one in every]
    return (
        f"{name}: {len(every)} machines, {points} points above {COHERENCE_SURE}:"
        f" {total['near'] / points:.1%} within {NEAR_DB:g} dB and {NEAR_DEG:g} deg"
        f" (worst machine {min(shares, default=0.0):.1%}; with friction left in"
        f" {total['near_left'] / max(total['points_left'], 1):.1%} of {total['points_left']}),"
        f" {total['inside'] / points:.1%} within the band; peaks in reach"
        f" {total['reached']}, found within 2 % {total['found']}, within their interval"
        f" {total['summed_up']}, invented {total['invented']}; {np.median(seconds):.2f} s"
        f" each (at most {max(seconds):.2f})"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--machines", type=int, default=20)
    parser.add_argument("--rigid", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--friction", choices=("identified", "rough", "left"), default="identified")
    parser.add_argument("--models", type=Path)
    asked = parser.parse_args()
    for compliant, count in ((True, asked.machines), (False, asked.rigid)):
        every = []
        for seed in range(asked.first, asked.first + count):
            one = machine(seed, compliant)
            every.append(judged(one, seed, asked.seconds, asked.friction, asked.models))
            j = every[-1]
            print(
                f"{seed:5d} {'two masses' if compliant else 'one mass':10s} {j.points:5d} points to"
                f" {j.top:5.0f} Hz, near {j.near / max(j.points, 1):6.1%}, inside"
                f" {j.inside / max(j.points, 1):6.1%}, peaks {j.found}/{j.reached},"
                f" invented {j.invented}, {j.identified:.1f} + {j.seconds:.2f} s",
                flush=True,
            )
        if every:
            print(summed_up("two masses" if compliant else "one mass", every), flush=True)


if __name__ == "__main__":
    main()
