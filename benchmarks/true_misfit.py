"""Misfit of the true parameters on the machines of `drives`: 1 where noise is all that they leave.

    python benchmarks/true_misfit.py [--first 100] [--machines 12]
        [--families motor pneumatic force]

What is far from 1 lies in how logs are recorded (rates, clocks, noise), not in any fit. One line a
machine: the share of the command's step that was reported and the true one, the clock's jitter, and
the misfit of the run in windows. Exit status 0 in any case.
"""

import argparse

from benchmarks.drives_rig import FAMILIES, make
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.windowed_run.run_errors import misfit
from identification.model.estimates import Drive
from identification.model.plant import Actuator, Motor, Plant

DRIVES: dict[str, Drive] = {"motor": "command", "pneumatic": "command", "force": "force"}


def line(family: str, seed: int) -> str:
    """What the true parameters leave of the machine's log."""
    made = make(family, (), seed, 0.2)
    one, (first, second, _) = made.machine, made.machine.actuator
    actuators: dict[str, Actuator | Motor | None] = {
        "motor": Motor(first), "pneumatic": Actuator(first, second), "force": None,
    }  # fmt: skip
    recorded = recorded_logs([made.train], one.rig, DRIVES[family])
    left = misfit(Plant(one.nine, actuators[family]), recorded.logs, recorded.drive)
    periods = one.how.loop_rate / one.how.log_rate
    true = 0.0 if family == "force" else (periods - 1.0) / (2.0 * periods)
    jitter = 1e6 * recorded.logs[0].noise.jitter
    return (
        f"{family:10} {seed:5} share {recorded.share:.3f} ({true:.3f}) jitter {jitter:5.1f} us"
        f" misfit {left:7.2f} | {one.words}"
    )


def main() -> None:
    """Prints a line a machine."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--machines", type=int, default=12)
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    asked = parser.parse_args()
    for family in asked.families:
        for seed in range(asked.first, asked.first + asked.machines):
            print(line(family, seed), flush=True)


if __name__ == "__main__":
    main()
