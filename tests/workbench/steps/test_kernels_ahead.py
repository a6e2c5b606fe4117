"""The kernels of a fit are compiled by another process where they are not yet, and only there."""

import subprocess

import pytest

from workbench.steps import kernels_ahead
from workbench.steps.kernels_ahead import are_compiled, compile_fits, fits_compiled_ahead


def test_a_few_samples_leave_the_kernels_in_the_cache() -> None:
    compile_fits()
    assert are_compiled()


def test_no_process_is_started_for_what_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refused)
    monkeypatch.setattr(kernels_ahead, "are_compiled", lambda: True)
    with fits_compiled_ahead():
        pass


def test_the_process_ends_with_the_block(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[subprocess.Popen[bytes]] = []
    begin = subprocess.Popen

    def kept(*arguments: object, **options: object) -> subprocess.Popen[bytes]:
        started.append(begin(*arguments, **options))  # type: ignore[call-overload]
        return started[0]

    monkeypatch.setattr(subprocess, "Popen", kept)
    monkeypatch.setattr(kernels_ahead, "are_compiled", lambda: False)
    with pytest.raises(ZeroDivisionError), fits_compiled_ahead():
        raise ZeroDivisionError
    assert started[0].poll() is not None
