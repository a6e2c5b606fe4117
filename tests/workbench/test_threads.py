"""Linear algebra works on one thread, unless the user says otherwise."""

import os
import subprocess
import sys

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from workbench.course import working
from workbench.threads import one_thread, one_thread_by_default

ASKED = (
    "import sys; from workbench.cli import main; main(['effects', 'list']); import scipy.linalg;"
    " from threadpoolctl import threadpool_info;"
    " sys.exit(max(one['num_threads'] for one in threadpool_info() if one['user_api'] == 'blas'))"
)


def threads() -> set[int]:
    assert np.linalg.solve(np.eye(2), np.ones(2)).sum() == 2.0  # a library is loaded
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.mark.slow
@pytest.mark.skipif(os.cpu_count() == 1, reason="one core has one thread anyhow")
@pytest.mark.parametrize(("set_by_user", "expected"), [({}, 1), ({"OPENBLAS_NUM_THREADS": "2"}, 2)])
def test_a_command_has_one_thread_unless_asked(set_by_user: dict[str, str], expected: int) -> None:
    bare = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    command = [sys.executable, "-c", ASKED]
    done = subprocess.run(command, env={**bare, **set_by_user}, capture_output=True, check=False)
    assert done.returncode == expected, done.stderr


def test_python_has_one_within_a_call_and_its_own_after() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with one_thread():
            assert threads() == {1}
        with working("working"):
            assert threads() == {1}
        assert threads() == before


@pytest.mark.slow
def test_what_is_set_stays() -> None:
    environment = {"MKL_NUM_THREADS": "4"}
    one_thread_by_default(environment)
    assert environment["MKL_NUM_THREADS"] == "4" and environment["OPENBLAS_NUM_THREADS"] == "1"
