"""Closed loop of the paper's figure 5 (PID) against the same algorithm in C, one run for all.

Run: python benchmarks/closed_loop.py [samples]. Needs gcc. Times of this process's thread, the
fastest of interleaved rounds, in ns a sample and plant; outputs are allocated before.
"""

import ctypes
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise, loop_costs, prepared_loop, simulate_loop
from design.loop_kernels import RECORDS, loop_kernel, loops_kernel
from design.pid import pid_to_rst
from identification.arrays import Array, IntArray
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Plant
from identification.simulation.karnopp_step import COLUMNS, MODES, mode_table

TABLE_1 = Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.04, -0.04, 20.6, -23.0)
ACTUATOR = Actuator(19530.0, 10405.0)
H = 1e-3
LIMIT = 5.0
CONTROLLER = pid_to_rst(1754.0, 0.072, 0.018, 0.2, H)
CASCADE = Cascade(CONTROLLER, ForcePI(0.02, 0.05), LIMIT)
MANY = 64
ROUNDS = 12


def library(folder: Path) -> ctypes.CDLL:
    """benchmarks/closed_loop.c, compiled into `folder`."""
    source, target = Path(__file__).with_suffix(".c"), folder / "closed_loop.so"
    # Without these two, gcc keeps branches for comparisons that could trap, and vectorises nothing.
    options = [
        "-O3",
        "-march=native",
        "-fno-trapping-math",
        "-fno-math-errno",
        "-mprefer-vector-width=512",
        "-shared",
        "-fPIC",
    ]
    subprocess.run(["gcc", *options, str(source), "-o", str(target), "-lm"], check=True)
    return ctypes.CDLL(str(target))


def pointer(a: Array | IntArray) -> ctypes.c_void_p:
    """Address of a contiguous array."""
    return a.ctypes.data_as(ctypes.c_void_p)


def tables_of(p: Array) -> Array:
    """Step tables (plants, MODES, COLUMNS), which C takes ready-made."""
    tables = np.zeros((len(p), MODES, COLUMNS))
    for row, table in zip(p, tables, strict=True):
        mode_table(tuple(row), H, table)
    return tables


def fastest(calls: dict[str, tuple[Callable[[], object], int]]) -> dict[str, float]:
    """Fastest time of each call [ns] divided by its count, the calls taking turns."""
    found = dict.fromkeys(calls, np.inf)
    for call, _ in calls.values():
        call()
    for _ in range(ROUNDS):
        for name, (call, count) in calls.items():
            start = time.thread_time_ns()
            call()
            found[name] = min(found[name], (time.thread_time_ns() - start) / count)
    return found


def main(n: int) -> None:
    """Print the table."""
    t = H * np.arange(n)
    reference = np.where((t // 5.0) % 2 == 1, 0.1, 0.0)
    noise = LoopNoise.draw(n, 1e-5, 1e-2, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    spread = 1.0 + 0.1 * rng.uniform(-1.0, 1.0, (MANY, 9))
    one = Plant(TABLE_1, ACTUATOR)
    many = [Plant(Karnopp.from_array(TABLE_1.array * row), ACTUATOR) for row in spread]
    loop, p_1 = prepared_loop([one], CASCADE, reference, H, noise)
    _, p = prepared_loop(many, CASCADE, reference, H, noise)
    n_y, n_f = (np.ascontiguousarray(a[:, 0]) for a in (loop.noise.y, loop.noise.F))
    settings = np.array([H, *loop.R, *loop.S[1:], *loop.pi, LIMIT])
    tables_1, tables = tables_of(p_1), tables_of(p)
    out, out_c = np.zeros((4, n)), np.zeros((4, n))
    modes, modes_c = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    costs, costs_c, y_euler = np.zeros((2, MANY)), np.zeros((2, MANY)), np.zeros(n)
    traces, weights = np.zeros((RECORDS, 0, MANY)), np.ones(n)
    head = (loop.feed, loop.R, loop.S)
    blocks = (loop.noise.y[np.newaxis], loop.noise.F[np.newaxis])
    size = ctypes.c_size_t(n)
    with tempfile.TemporaryDirectory() as folder:
        c = library(Path(folder))
        signals = [pointer(a) for a in (loop.feed, n_y, n_f)]
        given = [pointer(p_1), pointer(tables_1), pointer(settings)]
        given_many = [pointer(p), pointer(tables), pointer(settings), pointer(loop.reference)]
        results = [pointer(out_c), pointer(modes_c)]
        start = (0.0, 0.0, 0.0)

        def ours_one() -> None:
            x = loop.x.copy()
            loop_kernel(p_1, H, 1, *head, x, loop.pi, LIMIT, n_y, n_f, start, out, modes)

        def ours_many() -> None:
            parts = (loop.reference, loop.feed, loop.R, loop.S, loop.x, loop.pi, LIMIT)
            loops_kernel(p, H, False, *parts, *blocks, start, weights, traces, costs)

        found = fastest(
            {
                "1 plant, C": (lambda: c.loop_one(*given, *signals, size, *results), n),
                "1 plant, ours": (ours_one, n),
                "1 plant, simulate_loop": (
                    lambda: simulate_loop(one, CASCADE, reference, H, noise=noise),
                    n,
                ),
                "1 plant, C, 10 Euler sub-steps": (
                    lambda: c.loop_euler(given[0], given[2], *signals, size, 10, pointer(y_euler)),
                    n,
                ),
                "64 plants, C": (
                    lambda: c.loop_many(
                        *given_many, *signals, size, ctypes.c_size_t(MANY), pointer(costs_c)
                    ),
                    n * MANY,
                ),
                "64 plants, ours": (ours_many, n * MANY),
                "64 plants, loop_costs": (
                    lambda: loop_costs(many, CASCADE, reference, H, noise=noise),
                    n * MANY,
                ),
            }
        )
    print(f"closed loop, PID, {n} samples of {H * 1e3:g} ms, table 1 plant")
    print(f"largest difference to C: position {np.abs(out - out_c)[0].max():.1e} m, ", end="")
    print(f"squared errors {np.max(np.abs(costs / costs_c - 1.0)):.1e} relative")
    print(f"Euler, 10 sub-steps: {np.abs(out[0] - y_euler).max():.1e} m from the exact run")
    print(f"{'':34}{'ns':>8}{'x C':>8}")
    for name, taken in found.items():
        print(f"{name:34}{taken:8.2f}{taken / found[name.split(',')[0] + ', C']:8.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40_000)
