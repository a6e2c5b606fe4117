"""A command that is asked to end clears up what it has begun, and says so in one line."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from workbench.registry.queue import Queue
from workbench.registry.store import Registry

LONG = 120.0  # s; a wait that a loaded machine does not reach


def ended(
    here: Path, arguments: Sequence[str], begun: Callable[[], bool], number: signal.Signals
) -> subprocess.CompletedProcess[str]:
    """A command in `here` that is sent the signal once it has begun."""
    command = [sys.executable, "-m", "workbench", *arguments]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=here, stdout=pipe, stderr=pipe, text=True) as running:
        try:
            end = time.monotonic() + LONG
            while not begun():
                assert running.poll() is None and time.monotonic() < end
                time.sleep(0.02)
            running.send_signal(number)
            out, err = running.communicate(timeout=LONG)
        finally:
            running.kill()
    return subprocess.CompletedProcess(command, running.returncode, out, err)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log whose fit takes some seconds."""
    folder = tmp_path_factory.mktemp("log")
    command = [sys.executable, "-m", "workbench", "simulate", "paper_table1", "--out", "sim"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "sim" / "paper_table1.csv"


@pytest.mark.slow
@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_nothing_is_left_of_a_result(
    tmp_path: Path, log: Path, number: signal.Signals, status: int
) -> None:
    arguments = ["identify", str(log), "--card", "paper_table1", "--out", "new/model"]
    done = ended(tmp_path, arguments, lambda: any(tmp_path.glob("new/.*.part")), number)
    assert (done.returncode, done.stderr) == (status, "terminated\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_pass_gives_its_machine_back(tmp_path: Path, log: Path) -> None:
    home = tmp_path / "machines" / "a"
    (home / "logs").mkdir(parents=True)
    (home / "logs" / "1.csv").symlink_to(log)
    text = (Path(__file__).parents[2] / "datasets" / "paper_table1" / "card.toml").read_text()
    (home / "card.toml").write_text(text, encoding="utf-8")
    where = str(tmp_path / "r.db")
    Registry(where).database.close()

    def begun() -> bool:
        with Registry(where) as registry:
            return any(count for _, count in Queue(registry.database).waiting("a"))

    arguments = ["reidentify", "machines", "--registry", where, "--settle", "0", "--first"]
    done = ended(tmp_path, arguments, begun, signal.SIGTERM)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (143, "terminated")
    with Registry(where) as registry:
        queue = Queue(registry.database)
        assert [count for _, count in queue.waiting("a")] == [1]
        again = queue.claim("a", owner="w", lease=timedelta(seconds=1), now=datetime.now(UTC))
        assert again is not None
