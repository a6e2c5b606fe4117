"""P-PI cascades from log to gains to simulation, against the controller that the machine has.

    python benchmarks/p_pi.py [--first 100] [--machines 10] [--families motor force] [--out FOLDER]

Machines of `drives` with a motor or a force that is logged, under their own P-PI or PID loop, which
the card names. The log is identified, `design --structure p-pi` makes the cascade, and recommends
it or to keep the present controller, by simulation on the identified model. Then both move the true
machine, in `drives`' own simulator, along a reference that no log has seen: trapezoids, S-curves,
sweeps or multisines other than the log's. An answer is right where the design says "keep it" (or no
controller keeps its goals), or where the cascade is better on the truth: root mean square error
below 0.95 of the present one, the largest error not above 1.1 of it, and the largest force below
0.95 of what the drive gives, or not above 1.2 of the present one.
Seeds below 100 served to choose.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

import workbench as wb
from benchmarks.drives_rig import Machine, machine, simulated
from benchmarks.p_pi_rig import Ride, by_present, by_program, reference_of
from design.closed_loop.driven_loop import driven_loop
from identification.errors import BadSpecification, NotIdentifiable
from workbench.report.design_tables import cascade_lines

BETTER, NOT_WORSE, NOT_HARDER, WITHIN_LIMIT = 0.95, 1.1, 1.2, 0.95
LONGEST = 40.0  # s of the log


def card_of(one: Machine) -> str:
    """The machine's card, with the loop that it has."""
    m, w, per = one.nine.m, one.bandwidth, one.actuator[0]
    unit = 1.0 / per if one.family == "motor" else 1.0
    if one.cascade:
        loop = f'kind = "P-PI"\nk_v = {w / 5.0}\nk_p = {m * w * unit}\nT_i = {6.0 / w}\nv_ff = 1.0'
    else:
        loop = f'kind = "PID"\nk_R = {m * w * w / 4.0 * unit}\nT_i = {10.0 / w}\nT_d = {4.0 / w}'
    output = "command" if one.family == "motor" else "force"
    rig = f'kind = "{one.family}"'
    if one.family == "motor":
        rig += f"\nforce_per_command = {per}\ncontrol_limit_v = {one.limit}"
    signals = "u = { column = 'u', unit = 'V' }" if one.family == "motor" else (
        "F = { column = 'F', unit = 'N' }"
    )  # fmt: skip
    return f"""[card]
name = "{one.family}"
source = "simulated"
[rig]
{rig}
[signals]
t = {{ column = "t", unit = "s" }}
y = {{ column = "y", unit = "m" }}
{signals}
[controller]
{loop}
eps = {0.1 / w}
output = "{output}"
period_s = {1.0 / one.how.loop_rate}
"""


def judged(family: str, seed: int, folder: Path | None) -> bool:
    """Whether the answer for a machine is right."""
    one = machine(family, seed)
    begun = time.process_time()
    log, _ = simulated(one, seed, "train", {})
    names = ("t", "y", "u" if family == "motor" else "F")
    frame = pd.DataFrame({name: np.asarray(log[name]) for name in names})
    frame = frame[frame["t"] <= LONGEST]
    with tempfile.TemporaryDirectory() as place:
        card = Path(place) / "card.toml"
        card.write_text(card_of(one), encoding="utf-8")
        kept = None if folder is None else folder / f"{family}-{seed}.json"
        try:
            if kept is not None and kept.exists():
                model = wb.load_model(kept)
            else:
                found = wb.identify(frame, card)
                model = found.model
                if kept is not None:
                    kept.parent.mkdir(parents=True, exist_ok=True)
                    kept.write_text(found.to_json(), encoding="utf-8")
            made = wb.design(model, structures=["p-pi"]).design
        except (NotIdentifiable, BadSpecification) as error:
            print(f"{family} {seed}: leave it ({str(error)[:150]})", flush=True)
            return True
    advised = made.recommendation
    assert advised is not None and made.p_pi is not None
    leave = made.recommended == "none" or advised.keep_present
    loop = driven_loop(model, made, made.p_pi)
    r, noise = reference_of(one, seed, "test", one.paths[1])
    before = by_present(one, r, noise)
    after = by_program(one, loop, r, noise, 1.0 if family == "motor" else 1.0 / one.actuator[0])
    better = is_better(before, after, one.actuator[0] * one.limit)
    right = leave or better
    kind = "P-PI" if one.cascade else "PID "
    answer = f"{'leave it' if leave else 'take it '} {'right' if right else 'WRONG'}"
    errors = [(1e6 * ride.rms, 1e6 * ride.worst, 1e6 * ride.standing) for ride in (before, after)]
    said = "; ".join(
        f"{name} {a:.1f} -> {b:.1f} um"
        for name, a, b in zip(("rms", "worst", "at rest"), *errors, strict=True)
    )
    print(
        f"{family:5s} {seed} {kind} {answer}: error on the truth {said}; force {before.peak:.0f} ->"
        f" {after.peak:.0f} N; {time.process_time() - begun:.0f} s",
        flush=True,
    )
    print("    " + "; ".join([*cascade_lines(made), advised.why[:300]]), flush=True)
    return right


def is_better(before: Ride, after: Ride, most: float) -> bool:
    """Whether a run is clearly better, and in nothing clearly worse; most: of the drive [N]."""
    return (
        after.rms < BETTER * before.rms
        and after.worst < NOT_WORSE * before.worst
        and after.peak < max(NOT_HARDER * before.peak, WITHIN_LIMIT * most)
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--machines", type=int, default=10, help="seeds a family")
    parser.add_argument(
        "--families", nargs="+", choices=("motor", "force"), default=["motor", "force"]
    )
    parser.add_argument("--models", type=Path, help="where identified models are kept")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.machines)
    right = [judged(family, seed, asked.models) for family in asked.families for seed in seeds]
    print(f"{sum(right)} of {len(right)} right")


if __name__ == "__main__":
    main()
