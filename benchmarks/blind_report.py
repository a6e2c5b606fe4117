"""The tables of the blind benchmark from its file of JSON lines."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta

from benchmarks.blind_effects import right_signals

Line = dict[str, Any]
LEVEL = 0.95
AT_NOISE = 1.1  # held-out force error over the noise
# What an answer can be, right ones first; the columns of the confusion table.
ANSWERS = ("right", "and more", "alike", "unknown", "wrong", "drift", "none", "refused")


def clopper_pearson(k: int, n: int, level: float = LEVEL) -> tuple[float, float]:
    """Exact interval of a share k/n."""
    if n == 0:
        return 0.0, 1.0
    tail = 0.5 * (1.0 - level)
    low = float(beta.ppf(tail, k, n - k + 1)) if k else 0.0
    high = float(beta.ppf(1.0 - tail, k + 1, n - k)) if k < n else 1.0
    return low, high


def share(k: int, n: int) -> str:
    """k of n with the exact interval."""
    low, high = clopper_pearson(k, n)
    whole = f"{100 * k / n:.0f} %" if n else "-"
    return f"{k}/{n} = {whole} [{100 * low:.1f}, {100 * high:.1f}]"


def read(file: Path) -> list[Line]:
    """Lines of a results file."""
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


def named(line: Line) -> list[str]:
    """Effects that the tracer added."""
    return [one["key"] for one in line["trace"].get("effects", ())]


def true_keys(line: Line) -> set[str]:
    """Effects that were hidden in the log."""
    return set(line["truth"]["effects"])


def judged(line: Line) -> str:
    """Which of ANSWERS the answer of a run with effects is."""
    true, found, verdict = true_keys(line), set(named(line)), line["trace"]["verdict"]
    if verdict in ("refused", "fault"):
        return "refused"
    if found == true and verdict in ("effect", "unknown"):
        return "right" if verdict == "effect" else "and more"
    if found > true and verdict != "inseparable":
        return "and more"
    if verdict == "inseparable":
        rivals = {one["key"] for one in line["trace"]["rivals"] if "as much" in one["why_not"]}
        return "alike" if true <= found | rivals else "wrong"
    if found:
        return "wrong"
    return str(verdict) if verdict in ("unknown", "drift") else "none"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """A table of text."""
    text = [[str(x) for x in row] for row in (head, *rows)]
    width = [max(len(row[i]) for row in text) for i in range(len(head))]
    for row in text:
        print("  ".join(x.ljust(w) for x, w in zip(row, width, strict=True)).rstrip())


def confusion(lines: Sequence[Line]) -> None:
    """True effect x answer; wrong names with their counts."""
    rows = []
    for key in sorted({k for line in lines for k in true_keys(line)}):
        own = [line for line in lines if true_keys(line) == {key}]
        counts = Counter(map(judged, own))
        wrong = Counter(k for line in own for k in named(line) if k != key)
        said = ", ".join(f"{k} {n}" for k, n in wrong.most_common())
        rows.append([key, len(own), *(counts[a] or "." for a in ANSWERS), said])
    counts = Counter(map(judged, lines))
    rows.append(["all", len(lines), *(counts[a] or "." for a in ANSWERS), ""])
    table(["true effect", "n", *ANSWERS, "named beside or instead"], rows)


def power(lines: Sequence[Line]) -> None:
    """Share named right, and share in which anything was noticed, against strength."""
    strengths = sorted({line["truth"]["strength"] for line in lines})
    rows = []
    for key in [*sorted({k for line in lines for k in true_keys(line)}), "all"]:
        row: list[object] = [key]
        for s in strengths:
            own = [
                line for line in lines
                if line["truth"]["strength"] == s and key in {*true_keys(line), "all"}
            ]  # fmt: skip
            right = sum(judged(line) == "right" for line in own)
            seen = sum(judged(line) not in ("none", "refused") for line in own)
            row.append(f"{right}/{seen}/{len(own)}")
        rows.append(row)
    table(["right/noticed/runs at strength", *(f"{s:g}" for s in strengths)], rows)


def by_group(lines: Sequence[Line], of: Callable[[Line], str], title: str) -> None:
    """Share named right by a property of the run."""
    rows = []
    for name in sorted({of(line) for line in lines}):
        own = [line for line in lines if of(line) == name]
        counts = Counter(map(judged, own))
        rows.append([name, len(own), *(counts[a] or "." for a in ANSWERS)])
    table([title, "n", *ANSWERS], rows)


def by_machine(lines: Sequence[Line]) -> None:
    """Answers by machine."""
    by_group(lines, lambda one: str(one["truth"]["machine"]), "machine")


def by_pair(lines: Sequence[Line]) -> None:
    """Answers by the pair of effects."""
    by_group(lines, lambda one: " + ".join(sorted(true_keys(one))), "pair")


def clean(lines: Sequence[Line]) -> None:
    """False positives of the clean runs."""
    for title, bad in (
        ("effect named", lambda one: bool(named(one))),
        ("unknown", lambda one: one["trace"]["verdict"] == "unknown"),
        ("drift", lambda one: one["trace"]["verdict"] == "drift"),
        ("refused or fault", lambda one: one["trace"]["verdict"] in ("refused", "fault")),
        ("anything but none", lambda one: one["trace"]["verdict"] != "none"),
    ):
        print(f"  {title:20s} {share(sum(map(bad, lines)), len(lines))}")
    for line in lines:
        if line["trace"]["verdict"] != "none":
            print(f"    {line['case']}: {line['trace']['verdict']} {', '.join(named(line))}")


def removed(lines: Sequence[Line]) -> None:
    """Runs whose effect the library lacked: reported as unknown, and by the right signal.

    nothing named: unknown, and no effect named beside it; mimicked: what was named instead brings
    the held-out force error down to the noise.
    """
    rows = []
    for key in [*sorted({k for line in lines for k in true_keys(line)}), "all"]:
        own = [line for line in lines if key in {*true_keys(line), "all"}]
        unknown = [line for line in own if line["trace"]["verdict"] == "unknown"]
        right = sum(map(right_signal, unknown))
        verdicts = Counter(line["trace"]["verdict"] for line in own)
        verdicts.pop("unknown", None)
        wrong = Counter(k for line in own for k in named(line))
        said = ", ".join(f"{k} {n}" for k, n in (verdicts + wrong).most_common())
        alone = sum(not named(line) for line in unknown)
        rows.append([key, len(own), len(unknown), right, alone, sum(map(mimicked, own)), said])
    table(["taken out", "n", "unknown", "right signal", "nothing named", "mimicked", "else"], rows)


def mimicked(line: Line) -> bool:
    """Whether other effects explain the log as well as the one taken out would."""
    left = ratio(line, force(line["trace"], "after"))
    return bool(named(line)) and left is not None and left < AT_NOISE


def right_signal(line: Line) -> bool:
    """Whether the first signals named are among those that the hidden effect depends on."""
    depends = tuple(x for xs in line["truth"]["depends_on"].values() for x in xs)
    return bool(right_signals(depends) & set(line["trace"]["unknown"]["depends_on"]))


def force(found: Mapping[str, Any] | None, when: str) -> float | None:
    """Held-out force error [N] of a trace, before or after."""
    if found is None or when not in found:
        return None
    value = found[when]["test"]["force_rms"]
    return None if value is None else float(value)


def held_out(lines: Sequence[Line]) -> None:
    """Median held-out force error over the noise: before, after, with the true structure."""
    rows = []
    for key in [*sorted({k for line in lines for k in true_keys(line)}), "all"]:
        own = [line for line in lines if key in {*true_keys(line), "all"}]
        columns = (
            [ratio(line, force(line["trace"], "before")) for line in own],
            [ratio(line, force(line["trace"], "after")) for line in own],
            [ratio(line, force(line.get("true_structure"), "after")) for line in own],
        )
        rows.append([key, len(own), *(median(x) for x in columns)])
    table(["held-out force error / noise", "n", "before", "after", "true structure"], rows)


def missing(lines: Sequence[Line]) -> None:
    """Latent force on the held-out log as a share of the Coulomb level, before and after, and what
    the effects gain of its likelihood: by what the tracer should have said and did say."""
    rows = []
    kinds = dict.fromkeys((line["mode"], judged(line)) for line in lines)
    for mode, said in sorted(kinds):
        own = [x for x in lines if (x["mode"], judged(x)) == (mode, said)]
        known = [x["trace"] for x in own if x["trace"].get("missing") is not None]
        before, after = (median([100 * one["missing"][i] for one in known]) for i in (0, 1))
        gains = [one["gained"] for one in known if one["effects"]]
        least = f"{min(gains):.0f} to {max(gains):.0f}" if gains else "-"
        rows.append([mode, said, len(own), before, after, least])
    table(["force missing", "said", "n", "before %", "after %", "gained [nats]"], rows)


def ratio(line: Line, value: float | None) -> float | None:
    """A force error over what the sensors alone leave."""
    noise = line["trace"].get("noise_force")
    return value / noise if value is not None and noise else None


def median(values: Sequence[float | None]) -> str:
    """Median of those that there are."""
    known = [x for x in values if x is not None]
    return f"{np.median(known):.3g}" if known else "-"


def parameters(lines: Sequence[Line]) -> None:
    """Errors of the effect's largest parameter where it was named right."""
    rows = []
    for key in sorted({k for line in lines for k in true_keys(line)}):
        off: dict[str, list[float]] = {}
        for line in lines:
            for one in line["trace"].get("effects", ()):
                true = line["truth"]["effects"].get(one["key"], {}) if one["key"] == key else {}
                for name, value in true.items():
                    found = one["params"][name]  # None: the logs say nothing of it
                    if value and found is not None:
                        off.setdefault(name, []).append(abs(found / value - 1))
        said = ", ".join(f"{k} {100 * np.median(v):.2g} %" for k, v in off.items())
        if said:
            rows.append([key, len(next(iter(off.values()))), said])
    table(["named right", "n", "median error of its parameters that are not 0"], rows)


def baseline_tables(lines: Sequence[Line]) -> None:
    """The same logs by other methods: names, false positives, held-out error."""
    rows = [baseline_row(lines, method) for method in lines[0]["baselines"]]
    rows.append(this_tracer(lines))
    table(
        ["method", "alone right", "first right", "false on clean", "before [N]", "after [N]"], rows
    )


def baseline_row(lines: Sequence[Line], method: str) -> list[str]:
    """One other method; its errors are at samples and not in windows as the tracer's."""
    own = [(line, line["baselines"][method]) for line in lines]
    if all("skipped" in found for _, found in own):
        return [method, own[0][1]["skipped"], "", "", "", ""]
    some = [(line, found) for line, found in own if line["mode"] == "single"]
    none = [found for line, found in own if line["mode"] == "clean"]
    errors = [median([found.get(k) for _, found in some]) for k in ("before", "after")]
    if not any("named" in found for _, found in own):
        return [method, "names none", "", "", *errors]
    names = [(found["named"], [*true_keys(line)]) for line, found in some]
    alone = sum(said == true for said, true in names)
    first = sum(said[:1] == true for said, true in names)
    false = share(sum(bool(found["named"]) for found in none), len(none))
    return [method, f"{alone}/{len(some)}", f"{first}/{len(some)}", false, *errors]


def this_tracer(lines: Sequence[Line]) -> list[str]:
    """The tracer's own row among the other methods."""
    some, none = of_mode(lines, "single"), of_mode(lines, "clean")
    right = sum(judged(x) == "right" for x in some)
    first = sum(named(x)[:1] == [*true_keys(x)] for x in some)
    false = share(sum(bool(named(x)) for x in none), len(none))
    errors = (median([force(x["trace"], k) for x in some]) for k in ("before", "after"))
    return ["this tracer", f"{right}/{len(some)}", f"{first}/{len(some)}", false, *errors]


def seconds(lines: Sequence[Line]) -> None:
    """Time of a trace."""
    own = np.array([line["seconds"] for line in lines])
    print(f"time of a trace: median {np.median(own):.1f} s, 95 % {np.quantile(own, 0.95):.1f} s,"
          f" max {np.max(own):.1f} s over {len(own)} runs")  # fmt: skip


def of_mode(lines: Sequence[Line], mode: str) -> list[Line]:
    """Runs of a mode."""
    return [line for line in lines if line["mode"] == mode]


def print_report(file: Path) -> None:
    """Every table that the file has runs for."""
    every = read(file)
    lines = [line for line in every if "failed" not in line]
    print(f"\n{file}: {len(lines)} runs, {len(every) - len(lines)} not simulated; tracer"
          f" {', '.join(sorted({line.get('code', '?') for line in lines}))}\n")  # fmt: skip
    sections: list[tuple[str, list[Line], Sequence[Callable[[list[Line]], None]]]] = [
        ("Clean runs", of_mode(lines, "clean"), [clean]),
        (
            "One effect",
            of_mode(lines, "single"),
            [confusion, power, by_machine, parameters, held_out],
        ),
        ("Two effects", of_mode(lines, "two"), [by_pair, held_out]),
        ("Effect taken out of the library", of_mode(lines, "removed"), [removed]),
        ("Friction drifted between train and test", of_mode(lines, "drift"), [drift]),
        ("Force that the model lacks", lines, [missing]),
        ("Other methods, same logs", [x for x in lines if x.get("baselines")], [baseline_tables]),
    ]
    for title, own, parts in sections:
        if own:
            print(f"## {title}\n")
            for part in parts:
                part(own)
                print()
    if lines:
        seconds(lines)


def drift(lines: Sequence[Line]) -> None:
    """Verdicts where the friction changed between the logs."""
    counts = Counter(line["trace"]["verdict"] for line in lines)
    print(f"  drift {share(counts['drift'], len(lines))}; {dict(counts)}")
