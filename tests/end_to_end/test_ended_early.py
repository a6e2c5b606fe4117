"""`workbench trace` ended by its budget, by Ctrl-C, and by a second Ctrl-C."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.course import Course
from workbench.documents.result_files import read_model
from workbench.logs.sources import card_path

FILES = {"trace.json", "model.json", "report.html"}
# Ctrl-C, once or twice, at the fiftieth ask: nothing here hangs on how fast the machine is, nor on
# how many asks its last digits make of the way from there to the end.
DRIVER = """
import itertools, os, signal, sys, time
from workbench.cli import main
from workbench.course import Course
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where tests run in background
asks, usual = itertools.count(), Course.keep_going
def keep_going(self):
    for _ in range({times} if next(asks) == 50 else 0):
        os.kill(os.getpid(), signal.SIGINT)
        while not self.stopped:  # the main thread has yet to see it; two at once would be one
            time.sleep(0.001)
    return usual(self)
Course.keep_going = keep_going
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of the demo's machine, of 10 s, and its card."""
    folder = tmp_path_factory.mktemp("shop")
    text = card_path("demo").read_text(encoding="utf-8").replace("60.0", "10.0")
    (folder / "card.toml").write_text(text, encoding="utf-8")
    assert main(["simulate", str(folder / "card.toml"), "--out", str(folder / "logs")]) == 0
    return folder


def arguments(shop: Path, out: Path) -> list[str]:
    log, card = str(shop / "logs" / "demo.csv"), str(shop / "card.toml")
    return ["trace", log, "--card", card, "--out", str(out), "--json"]


def interrupted(shop: Path, here: Path, times: int) -> subprocess.CompletedProcess[str]:
    driver = [sys.executable, "-c", DRIVER.format(times=times)]
    command = [*driver, *arguments(shop, Path("out"))]
    return subprocess.run(command, cwd=here, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.parametrize("asks", [0, 5, 60, 700])
def test_a_budget_gives_whole_files_that_say_so(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch, asks: int,
) -> None:  # fmt: skip
    count = 0

    def keep_going(_course: Course) -> bool:
        nonlocal count
        count += 1
        return count <= asks

    monkeypatch.setattr(Course, "keep_going", keep_going)
    capsys.readouterr()
    assert main(arguments(shop, tmp_path / "out")) == 0
    shown = capsys.readouterr()
    found = json.loads(shown.out)
    assert found["not_tried"] and found["verdict"] not in ("none", "drift")
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES
    written = json.loads((tmp_path / "out" / "trace.json").read_text(encoding="utf-8"))
    assert written.items() <= found.items() and written["not_tried"] == found["not_tried"]
    assert read_model(tmp_path / "out" / "model.json").friction
    assert "Ended early" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_budget_that_is_over_at_once_is_one_too(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments(shop, tmp_path / "out"), "--budget", "1e-6"]) == 0
    assert json.loads(capsys.readouterr().out)["not_tried"]
    assert main([*arguments(shop, tmp_path / "none"), "--budget", "0"]) == 2
    assert "--budget" in capsys.readouterr().err


@pytest.mark.slow
def test_ctrl_c_ends_with_the_best_so_far(shop: Path, tmp_path: Path) -> None:
    done = interrupted(shop, tmp_path, 1)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["not_tried"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES


@pytest.mark.slow
def test_a_second_one_aborts_and_leaves_nothing(shop: Path, tmp_path: Path) -> None:
    done = interrupted(shop, tmp_path, 2)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.splitlines()[-1] == "interrupted"
    assert list(tmp_path.iterdir()) == []
