"""Clean rotary machines behind coarse encoders and slow logs: do the intervals hold the truth?

    python benchmarks/encoders.py [--first 0] [--seeds 6] [--kinds motor held late]
        [--rates 200 1000]

A body with Coulomb, viscous and breakaway friction under a PID loop of 1 kHz, by trapezoidal steps
of 2 us written apart from the kernels of the fit; its sensors have no noise but the encoder's
counts (500 to 65536 a turn), and 0.01 N m of a measured torque. Logged are the command of a motor
("motor"), or the torque, as it acts from its row on ("zoh") or did until then ("late"), which is
half a period to either side of where a line through its samples has it. Seeds 1 to 6 served to
choose the constants of `identification.estimation.converged_fit`; those from 11 on judge.
"""

import argparse
import time
from collections.abc import Iterator

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled
from identification.errors import UserError
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.signals.clean import prepare

LOOP, STEPS, SECONDS = 1e-3, 500, 30.0  # s, steps in a period, s
TORQUE_NOISE, LIMIT, BANDWIDTH = 0.01, 5.0, 2.0 * np.pi * 6.0
WAVES = ((1.0, 0.23), (0.5, 0.71), (0.2, 1.7), (0.05, 4.1))  # rad, Hz
COUNTS, RATES = (500, 2000, 8000, 65536), (200.0, 1000.0)  # a turn, Hz
KINDS = ("motor", "zoh", "late")
SLIDING, STICK = ("m", "F_cp", "F_cn", "F_vp", "F_vn"), ("F_sp", "F_sn")


@compiled
def run(p: Array, r: Array, count: float) -> Array:
    """Position shown, command and torque of the period before (3, n) along a reference r (n,)."""
    m, f_cp, f_cn, f_vp, f_vn, stick = p
    y, v, speed, total, given = r[0], 0.0, 0.0, 0.0, 0.0
    seen, dt, out = count * np.round(y / count), LOOP / STEPS, np.zeros((3, len(r)))
    for i in range(len(r)):
        before, seen = seen, count * np.round(y / count)
        speed += 0.3 * ((seen - before) / LOOP - speed)
        total += 0.2 * m * BANDWIDTH**3 * LOOP * (r[i] - seen)
        total = min(max(total, -LIMIT), LIMIT)
        u = m * BANDWIDTH**2 * (r[i] - seen) - 1.4 * m * BANDWIDTH * speed + total
        u = min(max(u, -LIMIT), LIMIT)
        out[0, i], out[1, i], out[2, i] = seen, u, given
        given = u
        for _ in range(STEPS):
            way = np.sign(v) if v != 0.0 else np.sign(u)
            level = f_cp if way > 0.0 else f_cn
            if v == 0.0 and abs(u) <= stick * level:
                continue
            after = v + dt * (u - way * level - (f_vp if way > 0.0 else f_vn) * v) / m
            after = 0.0 if after * v < 0.0 else after
            y += 0.5 * dt * (v + after)
            v = after
    return out


def logged(kind: str, counts: int, rate: float, seed: int) -> tuple[Log, Rig, dict[str, float]]:
    """One log, its rig, and what is true of it."""
    rng = np.random.default_rng(seed)
    m = 0.02 * np.exp(rng.uniform(-0.5, 0.5))
    f_c, f_v = 0.4 * np.exp(rng.uniform(-0.4, 0.4, 2)), 0.03 * np.exp(rng.uniform(-0.4, 0.4, 2))
    stick, phases = rng.uniform(1.1, 1.5), rng.uniform(0.0, 2.0 * np.pi, len(WAVES))
    t = LOOP * np.arange(round(SECONDS / LOOP))
    zoh = np.where(t % 10.0 > 7.0, 10.0 * (t // 10.0) + 7.0, t)  # a rest of 3 s in 10
    r = np.zeros(len(t))
    for (size, rate_of), phase in zip(WAVES, phases, strict=True):
        r += size * np.sin(2.0 * np.pi * rate_of * zoh + phase)
    y, u, before = run(np.array([m, *f_c, *f_v, stick]), r, 2.0 * np.pi / counts)
    every = round(1.0 / rate / LOOP)
    signals = {"t": t[::every], "y": y[::every]}
    if kind == "motor":
        signals |= {"u": u[::every], "F": u[::every]}
        rig = Rig("motor", force_per_command=1.0, motion="rotary")
    else:
        F = (before if kind == "late" else u)[::every]
        signals["F"] = F + TORQUE_NOISE * rng.standard_normal(len(F))
        rig = Rig("force", motion="rotary")
    true = dict(zip(SLIDING, (float(m), *f_c.tolist(), *f_v.tolist()), strict=True))
    true |= {"F_sp": stick * true["F_cp"], "F_sn": -stick * true["F_cn"]}
    return Log(f"{kind} {counts}", signals), rig, true


def judged(fit: KarnoppFit, true: dict[str, float]) -> Iterator[tuple[str, float, bool]]:
    """Of each parameter with an interval: name, relative error, whether the interval holds it."""
    for name, value in true.items():
        one = fit.estimates[name]
        if one.value is not None and one.low is not None and one.high is not None:
            yield name, one.value / value - 1.0, one.low <= value <= one.high


def main() -> int:
    """Run the benchmark; exit status 0 in any case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--rates", nargs="+", type=float, default=list(RATES), help="Hz")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.seeds)
    print("log              reported  F_c, F_v off by [%]  sliding in 95 %  stick in 95 %  refused")
    for kind in asked.kinds:
        for counts in COUNTS:
            for rate in asked.rates:
                found, refused, began = list[tuple[str, float, bool]](), 0, time.perf_counter()
                for seed in seeds:
                    log, rig, true = logged(kind, counts, rate, seed)
                    try:
                        runs = prepare(log, rig).runs
                        fit = fit_plant(runs, np.random.default_rng(seed), rig=rig)
                    except UserError:
                        refused += 1
                        continue
                    found += judged(fit, true)
                each = (time.perf_counter() - began) / len(seeds)
                line = row(f"{kind} {counts} {rate:g} Hz", found, refused, len(seeds))
                print(f"{line}   {each:.1f} s", flush=True)
    return 0


def row(name: str, found: list[tuple[str, float, bool]], refused: int, seeds: int) -> str:
    """A line of the table."""
    slides = [one for one in found if one[0] in SLIDING]
    off = [100.0 * abs(error) for key, error, _ in slides if key != "m"]
    sticks = [zoh for key, _, zoh in found if key in STICK]
    return (
        f"{name:20s} {len(slides):2d}/{5 * seeds}  "
        f"{np.median(off) if off else np.nan:8.3f}             "
        f"{sum(zoh for *_, zoh in slides):3d}/{len(slides):<3d}          "
        f"{sum(sticks):3d}/{len(sticks):<3d}        {refused}"
    )


if __name__ == "__main__":
    raise SystemExit(main())
