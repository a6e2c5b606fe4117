"""One thread for linear algebra: of matrices as small as ours, more wait longer than they work.

On two cores that do other things besides, `identify` took 1.4 times, `design` 1.6 times as long
with two threads of OpenBLAS as with one, and small least squares by the thousand ten times.
"""

from collections.abc import Iterator, MutableMapping
from contextlib import contextmanager

LIBRARIES = ("OPENBLAS", "MKL", "BLIS")


def one_thread_by_default(environment: MutableMapping[str, str]) -> None:
    """Sets what the libraries read once they are loaded, where the user has not set it."""
    for library in LIBRARIES:
        environment.setdefault(f"{library}_NUM_THREADS", "1")


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread within the block, also of libraries that are loaded already."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield
