"""Lines and tables of `drives`."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from identification.model.karnopp import NAMES

Found = Mapping[str, Any]
NORMAL = 1.959964  # of a 95 % interval


def wilson(hits: int, count: int) -> str:
    """A share with its 95 % interval after Wilson, in percent."""
    if not count:
        return "-"
    z2, share = NORMAL**2, hits / count
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = NORMAL * np.sqrt(share * (1 - share) / count + z2 / (4 * count**2)) / (1 + z2 / count)
    low, high = max(middle - half, 0.0), min(middle + half, 1.0)
    return f"{100 * share:.0f} % [{100 * low:.0f}, {100 * high:.0f}] ({hits}/{count})"


def errors(found: Found) -> dict[str, float]:
    """Error over half the interval, by parameter, where both are reported and the truth exists."""
    out = {}
    for key, one in found.get("fit", {}).get("nine", {}).items():
        true = found["truth"][key]
        if true is not None and one["value"] is not None and one["low"] is not None:
            half = one["high"] - one["value"] if true > one["value"] else one["value"] - one["low"]
            out[key] = float((one["value"] - true) / max(half, 1e-12 * abs(true)))
    return out


def trouble(found: Found, *where: str) -> str:
    """What kept a case from its answer, "" where nothing did."""
    if "failed" in found:
        return str(found["failed"]).replace("\n", " ")[-90:]
    for part in where:
        said = found.get(part, {})
        for kind in ("refused", "fault"):
            if kind in said:
                return f"{part} {kind}: " + str(said[kind]).strip().replace("\n", " ")[-80:]
    return ""


def right(found: Found) -> bool:
    """Whether the trace says what an engineer would want."""
    said = found.get("trace", {})
    if found["part"] == "strange":
        return said.get("verdict") == "unknown" and not said["effects"]
    wanted = "effect" if found["keys"] else "none"
    return said.get("verdict") == wanted and set(said["effects"]) == set(found["keys"])


def ratio(found: Found) -> float:
    """Held-out error of the force after the trace over that of noise."""
    said = found.get("trace", {})
    after, noise = said.get("after", {}).get("force_rms"), said.get("noise_force")
    return float(after / noise) if after is not None and noise else float("nan")


def of_truth(found: Found) -> float:
    """The same over that of the true structure."""
    other = (found.get("true_structure") or {}).get("after", {}).get("force_rms")
    after = found.get("trace", {}).get("after", {}).get("force_rms")
    return float(after / other) if after is not None and other else float("nan")


def line(found: Found) -> str:
    """One machine in one line."""
    head = f"{found['part']:8}{found['family']:10}{effects_of(found):20}{found['seed']:5d} "
    out = [trouble(found, "fit", "trace")]
    if "nine" in found.get("fit", {}):
        z = errors(found)
        fit = found["fit"]
        of_effect = " ".join(f"{key}:{z[key]:+.2f}" if key in z else f"{key}:-" for key in NAMES)
        out.append(
            f"{of_effect} chi2 {fit['chi_square']:.3g} {fit['drive']} {fit['seconds']:.0f} s"
        )
    if "verdict" in found.get("trace", {}):
        said = found["trace"]
        keys = ", ".join([*said["effects"], *(f"[{one}]" for one in said["depends_on"])]) or "-"
        out.append(
            f"{said['verdict']} {keys} F/noise {ratio(found):.2f}"
            + (f" F/true {of_truth(found):.2f}" if found.get("true_structure") else "")
            + f" {said['seconds']:.0f} s{'' if right(found) else ' X'}"
        )
    return head + " | ".join([*filter(None, out), found.get("words", "")])


def grouped(founds: Iterable[Found], key: Callable[[Found], str]) -> dict[str, list[Found]]:
    """Cases by a name."""
    out: dict[str, list[Found]] = {}
    for one in founds:
        out.setdefault(key(one), []).append(one)
    return out


def coverage(founds: Sequence[Found], title: str) -> None:
    """Table of the nine: share of the intervals that hold the truth, rms of the error."""
    every = [errors(one) for one in founds]
    print(f"\n{title}: {len(founds)} logs, {sum(map(bool, every))} identified")
    print(f"{'':6}{'in 95 %':>26}{'rms z':>8}{'median |z|':>12}{'half %':>9}{'error %':>9}")
    pooled: list[float] = []
    for key in NAMES:
        z = NORMAL * np.array([one[key] for one in every if key in one])
        if not len(z):
            print(f"{key:6}{'of_effect by no log':>26}")
            continue
        pooled.extend(z)
        of_effect = [one for one, e in zip(founds, every, strict=True) if key in e]
        sizes = [abs(one["truth"][key]) for one in of_effect]
        ours = [one["fit"]["nine"][key] for one in of_effect]
        half = [0.5 * (x["high"] - x["low"]) / s for x, s in zip(ours, sizes, strict=True)]
        off = [abs(abs(x["value"]) - s) / s for x, s in zip(ours, sizes, strict=True)]
        inside = int(np.sum(np.abs(z) <= NORMAL))
        print(f"{key:6}{wilson(inside, len(z)):>26}{np.sqrt(np.mean(z**2)):8.2f}"
              f"{np.median(np.abs(z)):12.2f}{100 * np.median(half):9.3f}"
              f"{100 * np.median(off):9.3f}")  # fmt: skip
    z = np.array(pooled)
    if len(z):
        print(f"{'all':6}{wilson(int(np.sum(np.abs(z) <= NORMAL)), len(z)):>26}"
              f"{np.sqrt(np.mean(z**2)):8.2f}{np.median(np.abs(z)):12.2f}")  # fmt: skip


def verdicts(founds: Sequence[Found], title: str) -> None:
    """Table of the trace by effect: right, named first, verdicts, held-out error, time."""
    print(f"\n{title}: {len(founds)} machines")
    print(
        f"{'':22}{'right':>24}{'named first':>24}{'named at all':>24}  F/noise  F/true  s  verdicts"
    )
    rows = grouped(founds, effects_of)
    for name, some in [*rows.items(), ("all", list(founds))]:
        said = [one.get("trace", {}) for one in some]
        words = grouped(said, lambda one: str(one.get("verdict", "no answer")))
        named = [[*one.get("effects", [])] for one in said]
        keys = [one["keys"] for one in some]
        first = sum(bool(n) and n[0] in k for n, k in zip(named, keys, strict=True))
        contained = sum(bool(k) and set(k) <= set(n) for n, k in zip(named, keys, strict=True))
        off, over = [ratio(one) for one in some], [of_truth(one) for one in some]
        took = [one["seconds"] for one in said if "seconds" in one]
        counts = ", ".join(f"{len(v)} {k}" for k, v in words.items())
        print(f"{name:22}{wilson(sum(map(right, some)), len(some)):>24}"
              f"{wilson(first, len(some)):>24}{wilson(contained, len(some)):>24}"
              f"{median(off):9.2f}{median(over):8.2f}{median(took):5.0f}  {counts}")  # fmt: skip


def median(values: Sequence[float]) -> float:
    """Of the finite values, NaN without one."""
    finite = [one for one in values if np.isfinite(one)]
    return float(np.median(finite)) if finite else float("nan")


def family_of(found: Found) -> str:
    """Family of a case's machine."""
    return str(found["family"])


def effects_of(found: Found) -> str:
    """Effects of a case, as its line shows them."""
    return "+".join(found["effects"])


def print_report(founds: Sequence[Found]) -> None:
    """Tables of every part that was run."""
    for part, some in grouped(founds, lambda one: str(one["part"])).items():
        if part in ("clean", "lacking"):
            rows = grouped(some, family_of if part == "clean" else effects_of)
            for name, few in rows.items():
                coverage(few, f"{part}, {name}")
            coverage(some, f"{part}, all")
        if part != "lacking":
            verdicts(some, part)
