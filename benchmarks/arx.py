"""ARX(3,2,3) on 1e7 samples against passes over the data in C and against lstsq.

Run: python benchmarks/arx.py [samples]. Needs gcc. All times are of this one run: the medians, the
medians of the ratio to the C pass that accumulates the covariance, and the ratio of the fastest.
"""

import ctypes
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from identification.arrays import Array
from identification.arx.model import arx_of_factor, factor_of, fit_arx
from identification.arx.qr_factor import Order

ORDER = Order(3, 2, 3)
RST_A = [1.0, -2.142, 1.688, -0.5459]
RST_B = [0.0, 0.0, 0.0, 0.0001782, 0.0001322]
H = 0.01
LSTSQ_PART = 10
ROUNDS = 15
PASS = "C, covariance"
OURS = "fit_arx"
EXACT = "fit_arx, exact products"
LSTSQ = f"numpy lstsq (n/{LSTSQ_PART}, scaled)"


def rst_log(n: int) -> tuple[Array, Array]:
    """The paper's RST model under random input, equation error 1e-5 m."""
    rng = np.random.default_rng(1)
    u = rng.standard_normal(n)
    y = lfilter([1.0], RST_A, lfilter(RST_B, [1.0], u) + 1e-5 * rng.standard_normal(n))
    return u, np.asarray(y)


def c_passes(folder: Path) -> ctypes.CDLL:
    """benchmarks/arx.c, compiled into `folder`."""
    source = Path(__file__).with_suffix(".c")
    target = folder / "arx.so"
    options = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]
    subprocess.run(["gcc", *options, str(source), "-o", str(target)], check=True)
    library = ctypes.CDLL(str(target))
    library.read_pass.restype = ctypes.c_double
    return library


def lstsq(u: Array, y: Array) -> Array:
    """The estimate by numpy on the full regressor."""
    lag, n = ORDER.lag, len(y)
    columns = [-y[lag - i : n - i] for i in range(1, ORDER.na + 1)]
    columns += [u[lag - k : n - k] for k in range(ORDER.nk, ORDER.nk + ORDER.nb)]
    return np.asarray(np.linalg.lstsq(np.column_stack(columns), y[lag:], rcond=None)[0])


def ours(u: Array, y: Array) -> Array:
    """The estimate by fit_arx."""
    model = fit_arx((u, y), ORDER.na, ORDER.nb, ORDER.nk, H)
    return np.concatenate([model.A[1:], model.B[ORDER.nk :]])


def exact(u: Array, y: Array) -> Array:
    """The same by exact products, as for ill-conditioned logs."""
    model = arx_of_factor(factor_of([(u, y)], ORDER), ORDER, H)
    return np.concatenate([model.A[1:], model.B[ORDER.nk :]])


def peak_beyond_data(method: str, n: int) -> float:
    """Peak memory beyond the data [MB], in a process of its own."""
    command = [sys.executable, __file__, "--memory", method, str(n)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def measure_memory(method: str, n: int) -> None:
    """Print the rise of this process's peak memory [MB] over one estimate."""
    run = {"ours": ours, "exact": exact, "lstsq": lstsq}[method]
    rng = np.random.default_rng(1)
    run(rng.standard_normal(1000), rng.standard_normal(1000))
    u, y = np.empty(n), np.empty(n)
    rng.standard_normal(out=u)
    rng.standard_normal(out=y)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    run(u, y)
    print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)


def times(calls: dict[str, Callable[[], object]]) -> dict[str, Array]:
    """Times of each call [ms], shape (ROUNDS,), the calls taking turns."""
    found = {name: np.zeros(ROUNDS) for name in calls}
    for call in calls.values():
        call()
    for i in range(ROUNDS):
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            found[name][i] = 1e3 * (time.perf_counter() - start)
    return found


def main(n: int) -> None:
    """Print the table."""
    part = n // LSTSQ_PART
    # Before the data are made: a child's peak starts at its parent's.
    memory = {
        OURS: peak_beyond_data("ours", n),
        EXACT: peak_beyond_data("exact", n),
        LSTSQ: peak_beyond_data("lstsq", part) * LSTSQ_PART,
    }
    u, y = rst_log(n)
    out = np.zeros(21)
    pointers = [a.ctypes.data_as(ctypes.c_void_p) for a in (y, u, out)]
    size = ctypes.c_size_t(n)
    with tempfile.TemporaryDirectory() as folder:
        library = c_passes(Path(folder))
        found = times(
            {
                "C, memory read": lambda: library.read_pass(*pointers[:2], size),
                PASS: lambda: library.covariance_pass(*pointers[:2], size, pointers[2]),
                OURS: lambda: ours(u, y),
                EXACT: lambda: exact(u, y),
            }
        )
    start = time.perf_counter()
    reference = lstsq(u[:part], y[:part])
    found[LSTSQ] = np.full(ROUNDS, 1e3 * (time.perf_counter() - start) * LSTSQ_PART)
    difference = np.max(np.abs(ours(u[:part], y[:part]) / reference - 1.0))
    print(f"ARX(3,2,3), {n} samples; largest difference to lstsq {difference:.1e} relative")
    print(f"{'':30}{'ms':>9}{'x C':>9}{'fastest':>9}{'MB beyond data':>17}")
    for name, taken in found.items():
        ratio = float(np.median(taken / found[PASS]))
        fastest = float(np.min(taken) / np.min(found[PASS]))
        extra = f"{memory[name]:17.1f}" if name in memory else ""
        print(f"{name:30}{np.median(taken):9.1f}{ratio:9.2f}{fastest:9.2f}{extra}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--memory"]:
        measure_memory(sys.argv[2], int(sys.argv[3]))
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000)
