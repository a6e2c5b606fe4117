"""A signal ends a block wherever it arrives, and does not disturb the clearing up."""

import os
import signal
import sys
import time

import pytest

from workbench.termination import RAISED_AGAIN_AFTER, Terminated, raised_on_a_signal

LONG = 20 * RAISED_AGAIN_AFTER


def wait(duration: float) -> None:
    end = time.monotonic() + duration
    while time.monotonic() < end:
        time.sleep(0.001)


class Finalized:
    """The signal arrives while the object is removed, where Python drops what is raised."""

    def __del__(self) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        wait(0.01)


def test_an_exception_that_python_drops_is_raised_again(monkeypatch: pytest.MonkeyPatch) -> None:
    dropped: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda args: dropped.append(args.exc_value))
    with pytest.raises(Terminated) as raised, raised_on_a_signal():
        Finalized()
        wait(LONG)
        pytest.fail("the signal was lost")
    assert raised.value.number == signal.SIGTERM
    assert [type(one) for one in dropped] == [Terminated]


def test_clearing_up_is_not_disturbed() -> None:
    cleared = []
    with pytest.raises(Terminated) as raised, raised_on_a_signal():
        try:
            os.kill(os.getpid(), signal.SIGHUP)
            wait(LONG)
        finally:
            try:
                raise OSError
            except OSError:
                os.kill(os.getpid(), signal.SIGTERM)
                wait(LONG)
                cleared.append("all")
    assert cleared == ["all"] and raised.value.number == signal.SIGHUP


def test_nothing_is_left_behind() -> None:
    kept = signal.getsignal(signal.SIGALRM)
    with pytest.raises(Terminated), raised_on_a_signal():
        os.kill(os.getpid(), signal.SIGTERM)
        wait(LONG)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert signal.getsignal(signal.SIGALRM) is kept
