"""Build the wheel, install it in an empty environment outside the tree, and run it there.

There a shipped recipe is simulated and its log identified, as a new user would: that loads every
dependency, compiles the kernels and needs the cards and the report's templates.
"""

import json
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("workbench", "identification", "design")
RECIPE = "paper_table1"
PROBE = f"""
import importlib, pathlib, sys
for name in {PACKAGES!r}:
    file = pathlib.Path(importlib.import_module(name).__file__).resolve()
    if not file.is_relative_to(pathlib.Path(sys.prefix).resolve()):
        sys.exit(f"{{name}} comes from {{file}}, not from the wheel")
cards = pathlib.Path(importlib.import_module("workbench").__file__).parent / "_datasets"
print("\\n".join(sorted(path.parent.name for path in cards.glob("*/card.toml"))))
"""


def run(*arguments: str | Path, cwd: Path) -> str:
    """What the command prints; ends this check, showing it, where the command fails."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    done = subprocess.run(arguments, cwd=cwd, env=clean, capture_output=True, text=True)
    if done.returncode:
        command = " ".join(map(str, arguments))
        sys.exit(f"wheel check: {command}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def build_wheel(into: Path) -> Path:
    """Path of the wheel built from this tree."""
    build = (sys.executable, "-m", "build", "--wheel", "--no-isolation")
    run(*build, "--outdir", into, ROOT, cwd=into)
    (wheel,) = into.glob("*.whl")
    return wheel


def check_install(wheel: Path, into: Path) -> list[str]:
    """Names of the cards that the installed wheel holds; ends the check at the first fault."""
    venv.create(into / "env", with_pip=True)
    python = into / "env" / "bin" / "python"
    pip = (python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet")
    run(*pip, "--constraint", ROOT / "constraints.txt", wheel, cwd=into)
    shown = run(python.parent / "workbench", "--help", cwd=into)
    if "identify" not in shown:
        sys.exit(f"wheel check: workbench --help names no command 'identify':\n{shown}")
    check_chain(python.parent / "workbench", into)
    return run(python, "-c", PROBE, cwd=into).split()


def check_chain(workbench: Path, into: Path) -> None:
    """Simulate a shipped recipe and identify its log; ends the check where a file is missing."""
    run(workbench, "simulate", RECIPE, "--out", into / "log", cwd=into)
    log, model = into / "log" / f"{RECIPE}.csv", into / "model"
    need(log, into / "log" / "truth.json")
    run(workbench, "identify", log, "--card", RECIPE, "--out", model, cwd=into)
    need(model / "model.json", model / "report.html")
    found = json.loads((model / "model.json").read_text(encoding="utf-8"))
    if found["friction"]["m"]["value"] is None:
        sys.exit(f"wheel check: identify {RECIPE} finds no mass: {found['friction']['m']}")
    report = (model / "report.html").read_text(encoding="utf-8")
    if '<figure class="chart"' not in report or "uPlot" not in report:
        sys.exit("wheel check: report.html holds no chart, or not what draws it")


def need(*files: Path) -> None:
    """End the check where one of the files is missing or empty."""
    for file in files:
        if not file.is_file() or not file.stat().st_size:
            sys.exit(f"wheel check: {file.name} was not written to {file.parent.name}/")


def main() -> None:
    """Build, install, compare the cards with those of the tree."""
    with tempfile.TemporaryDirectory(prefix="wheel-check-") as folder:
        wheel = build_wheel(Path(folder))
        found = check_install(wheel, Path(folder))
    expected = sorted(path.parent.name for path in ROOT.glob("datasets/*/card.toml"))
    if found != expected:
        sys.exit(f"wheel check: cards {found} in the wheel, {expected} in datasets/")
    print(f"{wheel.name}: installs and runs in an empty environment; {len(found)} cards")


if __name__ == "__main__":
    main()
