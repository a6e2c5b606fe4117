"""The process that traces: it is given logs, the rig and the keys taken out, and nothing else.

`python -m benchmarks.blind_child SEALED` reads folders from standard input, a line each, and
answers each with a line once `result.json` lies in it. SEALED is the folder of the truths: opening
or listing anything in it raises PermissionError here, whatever asks for it.
"""

import hashlib
import json
import sys
import time
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind_baselines import baselines
from identification.effects._library import Library, built_in
from identification.errors import UserError
from identification.log import Log, Rig
from identification.tracing.result import Errors, Trace
from identification.tracing.trace import trace

SEED = 0  # of the tracer's own draws, the same in every run
ROOT = Path(__file__).resolve().parent.parent
GUARDED = frozenset({"open", "os.listdir", "os.scandir", "os.chdir", "os.rename", "os.link"})


def seal(folder: Path) -> None:
    """From here on this process cannot open what lies in the folder."""
    inside = str(folder.resolve())

    def guard(event: str, args: tuple[Any, ...]) -> None:
        if event not in GUARDED or not args or not isinstance(args[0], str | bytes | Path):
            return
        asked = args[0].decode() if isinstance(args[0], bytes) else str(args[0])
        if asked.startswith(inside) or str(Path(asked).absolute()).startswith(inside):
            raise PermissionError(f"{asked}: the truth is not for the tracer")

    sys.addaudithook(guard)


def library_of(request: dict[str, Any]) -> Library:
    """The built-in effects without those taken out, or only those asked for."""
    only, removed = request["only"], set(request["removed"])
    return {k: e for k, e in built_in().items() if k not in removed and (not only or k in only)}


def errors(one: Errors) -> dict[str, float | None]:
    """Errors by name."""
    return asdict(one)


def summary(found: Trace) -> dict[str, Any]:
    """What the benchmark keeps of a trace."""
    return {
        "verdict": found.verdict,
        "effects": [
            {
                "key": one.effect.key,
                "params": {k: e.value for k, e in one.params.items()},
                "sd": {k: e.sd for k, e in one.params.items()},
                "explained": one.explained,
                "p_value": one.p_value,
                "probability": one.probability,
            }
            for one in found.effects
        ],
        "rivals": [{"key": one.key, "why_not": one.why_not} for one in found.rivals],
        "unknown": asdict(found.unknown),
        "drift": [one.name for one in found.drift],
        "before": {k: errors(e) for k, e in found.before.items()},
        "after": {k: errors(e) for k, e in found.after.items()},
        "noise_force": found.noise_force,
        "noise_actuator": found.noise_actuator,
        "missing": found.missing,
        "evidence": found.evidence,
        "gained": None if found.missing_force is None else found.missing_force.gained,
        "parameters": {k: e.value for k, e in found.parameters_after.items()},
        "next_experiment": found.next_experiment,
        "remarks": list(found.remarks),
    }


def read_log(folder: Path, name: str) -> Log:
    """A log that the parent wrote."""
    with np.load(folder / f"{name}.npz") as stored:
        return Log(name, {key: stored[key] for key in stored.files})


def fingerprint() -> str:
    """Of the tracer's sources, as this process has just imported them."""
    files = sorted((ROOT / "identification").rglob("*.py"))
    return hashlib.sha256(b"".join(one.read_bytes() for one in files)).hexdigest()[:8]


CODE = fingerprint()


def answer(folder: Path) -> dict[str, Any]:
    """The trace of the logs in a folder, and how long it took."""
    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    train, test = read_log(folder, "train"), read_log(folder, "test")
    rig, library = Rig(**request["rig"]), library_of(request)
    out: dict[str, Any] = {"code": CODE}
    begin = time.perf_counter()
    try:
        out["trace"] = summary(trace([train], [test], rig, library, np.random.default_rng(SEED)))
    except UserError as error:
        out["trace"] = {"verdict": "refused", "error": f"{type(error).__name__}: {error}"}
    except Exception:
        out["trace"] = {"verdict": "fault", "error": traceback.format_exc()}
    out["seconds"] = time.perf_counter() - begin
    if request["baselines"]:
        out["baselines"] = baselines(train, test, library)
    return out


def main() -> None:
    """Answers until standard input ends."""
    seal(Path(sys.argv[1]))
    say = sys.stdout
    sys.stdout = sys.stderr  # nothing but answers on it
    for line in sys.stdin:
        folder = Path(line.strip())
        text = json.dumps(answer(folder))
        (folder / "result.json").write_text(text, encoding="utf-8")
        print("done", file=say, flush=True)


if __name__ == "__main__" and len(sys.argv) == 2:
    main()
