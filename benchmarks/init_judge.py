"""Whether a proposed card reads a file as it was: its signals in SI beside the true ones."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.init_cases import Case
from design.first_card.proposal import Proposal
from identification.arrays import Array
from identification.errors import UserError
from identification.log import Log
from workbench.cards.card import load_card
from workbench.logs.runs import read_log
from workbench.steps.first_card.written import written

SLOPE = 5e-3  # of one, that half the slope may be off


def wrong_lines(found: Proposal, case: Case) -> dict[str, str]:
    """What is wrong with the card, by signal or key; empty where it is right."""
    wrong = {}
    if found.kind not in case.kinds:
        wrong["kind"] = f"{found.kind} for {case.kinds[0]}"
    if (found.motion == "rotary") != case.rotary:
        wrong["motion"] = found.motion
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "card.toml"
        path.write_text(written(found), "utf-8")
        try:
            log = read_log(case.path, load_card(path))
        except UserError as error:
            return {**wrong, "card": str(error)[:160]}
    return wrong | _signals(log, found, case)


def _signals(log: Log, found: Proposal, case: Case) -> dict[str, str]:
    """Signals that are not the true ones, for the sign of the axis that fits better."""
    wanted = [name for name in case.truth if name in ("t", "y", "r", "u")]
    drives = ("p_p", "p_n") if found.kind == "electro-pneumatic" else ("F",)
    wanted += [name for name in drives if name in case.truth]
    guesses = [_against(log, found, case, wanted, axis) for axis in (1.0, -1.0)]
    return min(guesses, key=len)


def _against(
    log: Log, found: Proposal, case: Case, wanted: list[str], axis: float
) -> dict[str, str]:
    swapped: Mapping[str, str] = {} if axis > 0 else {"p_p": "p_n", "p_n": "p_p"}
    out = {}
    for name in wanted:
        key = swapped.get(name, name)
        shown = "F_logged" if name == "F" and "F_logged" in log else key
        if found.signal(key) is None or shown not in log:
            out[name] = "not found"
            continue
        sign = axis if name in ("y", "r", "F", "u") else 1.0
        why = _differs(log, sign * log[shown], case, name)
        if why:
            one = found.signal(key)
            out[name] = f"{why} ({one.shown if one else ''} as {one.unit if one else ''})"
    return out


def _differs(log: Log, x: Array, case: Case, name: str) -> str:
    """How a signal is not the true one, empty where it is."""
    t, truth = case.truth["t"], case.truth[name]
    if name == "t":
        ratio = log.duration / (t[-1] - t[0])
        return "" if abs(ratio - 1.0) < 0.02 else f"{ratio:.3g} times"
    at = np.interp((log["t"] - log["t"][0]) / log.duration, (t - t[0]) / (t[-1] - t[0]), truth)
    if np.std(at) == 0.0 or np.std(x) == 0.0:
        return "is constant"
    like = float(np.corrcoef(at, x)[0, 1])
    if like < case.alike:
        return f"{like:.2f} alike"
    ratio = float(np.std(x) / np.std(at))
    free = name in case.up_to_factor or (name == "u" and case.rotary)
    return "" if free or abs(ratio - 1.0) < 2 * SLOPE else f"{ratio:.4g} times"
