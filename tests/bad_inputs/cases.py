"""Bad inputs of all kinds, drawn from a seed: each a command line with the files that it needs.

A family is a generator of cases without end or a list; `cases` takes turns between them.
"""

import json
import os
import re
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain, count, islice
from pathlib import Path
from typing import Any

import numpy as np

from tests.bad_inputs.shop import CARDS, FORMATS, Shop
from tests.workbench.log_files import write_csv, write_parquet

Make = Callable[[Shop, Path], list[str]]
NUMBERS = (
    *("0", "-1", "1e-12", "1e-300", "5e-324", "1e6", "1e15", "1e300", "1e308", "1e309", "-1e308"),
    *("nan", "inf", "-inf", "x", "", "9" * 400, "9" * 5000, "1_0", "0x10", "1,5", "\u0663", "1e-6"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, "", "x", [], {}, [[]], 0, -1, 1, 0.5, 1e-12, 1e-300, 5e-324, 1e6, 1e15, 1e300),
    *(1e308, -1e308, 10**400, "x" * 5000, [0.0] * 1000, "\x1b[31m", "m", "m**9**9**9**9"),
)
UNITS = (
    *("m", "mm", "Pa", "bar", "kPa", "MPa", "N", "kN", "s", "ms", "min", "year", "V", "kg", "K"),
    *("degC", "rad", "deg", "1", "", "furlong", "m**9**9**9**9", "1e9999 m", "(" * 5000 + "m"),
    *("m" * 100_000, "10 cubed cubed cubed", "ym", "lightyear", "dBm", "m/s", "%", "lb", "\\u0000"),
)
NAMES = (
    *("a" * 300, "a" * 5000, "/".join(["a" * 200] * 30), "-", "--", "-x", "--json", "[red]a[/red]"),
    *(
        "\x1b[31m",
        "a\nb",
        "a\tb",
        "\udcff\udcfe",
        "~",
        "..",
        ".",
        "/",
        "",
        " ",
        "'; DROP TABLE",
        "%s",
    ),
    *(
        "{0}",
        "http://127.0.0.1:1/a",
        "file:///etc/passwd",
        "con",
        "\u202e",
        "/dev/stdin",
        "/proc/1/x",
    ),
)


@dataclass(frozen=True)
class Case:
    """A bad input by name; `make` writes its files into a folder and returns the arguments."""

    name: str
    make: Make


Family = Iterator[Case]


def cases(number: int, seed: int) -> list[Case]:
    """So many cases, in turn from every family."""
    streams = np.random.SeedSequence(seed).spawn(len(FAMILIES))
    open_ones = [
        family(np.random.default_rng(s)) for family, s in zip(FAMILIES, streams, strict=True)
    ]
    out: list[Case] = []
    while len(out) < number and open_ones:
        for one in list(open_ones):
            found = list(islice(one, 1))
            out.extend(found)
            if not found:
                open_ones.remove(one)
    return out[:number]


def _reading(rng: np.random.Generator, shop: Shop, log: str, card: str) -> list[str]:
    """A command that reads a log: mostly the one that takes no time."""
    model = shop.result("model")
    return {
        0: ["identify", log, "--card", card],
        1: ["trace", log, "--card", card],
        2: ["drift", model, log, "--card", card],
        3: ["response", log, "--card", card, "--model", model],
    }.get(int(rng.integers(0, 10)), ["predict", model, log, "--card", card])


# Logs: bytes


def damaged_bytes(rng: np.random.Generator) -> Family:
    """A file cut off, with flipped bytes, doubled, or filled with something else."""
    for number in count():
        form = FORMATS[number % len(FORMATS)]
        how = ("cut", "flipped", "flipped", "doubled", "zeros", "noise")[int(rng.integers(0, 6))]

        def make(
            shop: Shop, folder: Path, form: str = form, how: str = how, number: int = number
        ) -> list[str]:
            own = np.random.default_rng(number)
            content = bytearray((shop.folder / form).read_bytes())
            place = int(own.integers(0, len(content)))
            match how:
                case "cut":
                    del content[place:]
                case "flipped":
                    for at in own.integers(0, min(len(content), 4000), 1 + number % 5):
                        content[int(at)] ^= 1 << int(own.integers(0, 8))
                case "doubled":
                    content = content * 2
                case "zeros":
                    content[place : place + 2000] = bytes(2000)
                case _:
                    content[place : place + 500] = own.bytes(500)
            (folder / form).write_bytes(content)
            return ["predict", shop.result("model"), str(folder / form), "--card", shop.card()]

        yield Case(f"bytes {form} {how} {number}", make)


def odd_texts(rng: np.random.Generator) -> Family:
    """A CSV whose text is none, or not that of a table."""
    _ = rng
    edits: dict[str, Callable[[str], str]] = {
        "no header": lambda text: text.partition("\n")[2],
        "header alone": lambda text: text.partition("\n")[0],
        "column twice": lambda text: text.replace("t,r,y", "t,y,y", 1),
        "huge field": lambda text: text.replace("\n", f"\n{'9' * 1_000_000}", 1),
        "huge word": lambda text: text.replace("\n0.0,", f"\n{'x' * 1_000_000},", 1),
        "a word": lambda text: text.replace("\n0.02,", "\nOFF,", 1),
        "open quote": lambda text: text.replace(",", ',"', 7),
        "commas": lambda _text: "," * 100_000,
        "many columns": lambda text: ",".join(f"c{k}" for k in range(50_000)) + "\n" + text,
        "long line": lambda text: text.replace("\n", ","),
        "tabs and semicolons": lambda text: text.replace(",", ";", 900).replace(",", "\t", 900),
        "decimal commas": lambda text: text.replace(".", ","),
        "blank lines": lambda text: text.replace("\n", "\n\n\n"),
        "comments": lambda text: text.replace("\n", "\n# x\n"),
        "carriage returns": lambda text: text.replace("\n", "\r"),
        "nul": lambda text: text.replace("0", "\0", 3),
        "utf-16": lambda text: "\ufeff" + "\0".join(text),
        "hex": lambda text: text.replace("\n0.0", "\n0x0", 5),
        "upper": lambda text: text.upper(),
        "html": lambda _text: "<html><body>404</body></html>\n" * 200,
        "json": lambda text: json.dumps({"rows": text}),
        "brackets": lambda _text: "[" * 200_000,
        "empty rows": lambda text: re.sub(r"\n[^\n]+", "\n,,,,", text),
        "infinities": lambda text: text.replace("e-0", "e999"),
        "latin-1": lambda text: text.replace("y", "\xff", 1),
    }
    for how, edit in edits.items():

        def make(shop: Shop, folder: Path, edit: Callable[[str], str] = edit) -> list[str]:
            text = edit(Path(shop.log()).read_text("utf-8"))
            (folder / "a.csv").write_bytes(text.encode("latin-1", "replace"))
            return ["predict", shop.result("model"), str(folder / "a.csv"), "--card", shop.card()]

        yield Case(f"text {how}", make)


# Logs: values


def odd_signals(rng: np.random.Generator) -> Family:
    """One signal that a broken sensor, a wrong unit or a slip of the hand would make."""
    faults: dict[str, Callable[[Any], Any]] = {
        "constant": lambda x: np.full_like(x, x[7]),
        "zero": np.zeros_like,
        "nan": lambda x: np.full_like(x, np.nan),
        "a nan": lambda x: np.where(np.arange(len(x)) == 500, np.nan, x),
        "nans": lambda x: np.where((np.arange(len(x)) % 500) < 20, np.nan, x),
        "inf": lambda x: np.where(np.arange(len(x)) == 500, np.inf, x),
        "spike": lambda x: np.where(np.arange(len(x)) == 500, 1e9, x),
        "spikes": lambda x: np.where(np.arange(len(x)) % 97 == 5, 1e3 * np.max(np.abs(x)), x),
        "reversed": lambda x: x[::-1],
        "negative": lambda x: -x,
        "shifted": lambda x: x + 1e12,
        "stairs": lambda x: np.round(x / np.ptp(x) * 4) * np.ptp(x) / 4,
        "two values": lambda x: np.where(x > np.mean(x), 1.0, 0.0),
        "noise": lambda x: np.random.default_rng(1).standard_normal(len(x)),
        "held": lambda x: np.repeat(x[::100], 100)[: len(x)],
        "stuck": lambda x: np.where(np.arange(len(x)) > 1500, x[1500], x),
        "growing": lambda x: x * np.exp(np.linspace(0, 60, len(x))),
        **{
            f"times {by:g}": partial(np.multiply, by)
            for by in (1e-300, 1e-30, 1e-10, 1e-5, 1e-3, 0.1, 10.0, 1e3, 1e5, 1e10, 1e28, 1e150)
        },
    }
    pairs = [(rig, how) for rig in CARDS for how in faults]
    for place in rng.permutation(len(pairs) * 6):
        rig, how = pairs[place % len(pairs)]

        def make(
            shop: Shop, folder: Path, rig: str = rig, how: str = how, place: int = int(place)
        ) -> list[str]:
            columns = shop.columns(rig)
            name = list(columns)[place // len(pairs) % len(columns)]
            with np.errstate(all="ignore"):
                columns[name] = faults[how](columns[name])
            write_csv(folder / f"{name}.csv", columns)
            own = np.random.default_rng(place)
            if place % 3 == 0:
                return ["identify", str(folder / f"{name}.csv"), "--card", shop.card(rig)]
            return _reading(own, shop, str(folder / f"{name}.csv"), shop.card(rig))

        yield Case(f"signal {rig} {how} {place}", make)


def odd_clocks(rng: np.random.Generator) -> Family:
    """A time that repeats, goes back, jumps, or has an absurd period."""
    faults: dict[str, Callable[[Any], Any]] = {
        "back": lambda t: np.where(np.arange(len(t)) == 900, t[100], t),
        "twice": lambda t: np.where(np.arange(len(t)) == 900, t[899], t),
        "gap": lambda t: t + np.where(np.arange(len(t)) > 1500, 1e6, 0.0),
        "gaps": lambda t: t + np.floor(np.arange(len(t)) / 90) * 5.0,
        "jitter": lambda t: t + 9e-4 * np.random.default_rng(2).uniform(size=len(t)),
        "rounded": lambda t: np.round(t, 2),
        "unix": lambda t: t + 1.7e9,
        "far": lambda t: t + 1e17,
        "square": lambda t: t**2,
        "logarithm": lambda t: np.log(t + 1e-9),
        **{
            f"times {by:g}": partial(np.multiply, by) for by in (1e-300, 1e-9, 1e-3, 1e3, 1e9, 1e29)
        },
    }
    for place, (how, fault) in enumerate([*faults.items()] * 3):

        def make(
            shop: Shop, folder: Path, fault: Callable[[Any], Any] = fault, place: int = place
        ) -> list[str]:
            columns = shop.columns()
            columns["t"] = fault(columns["t"])
            write_parquet(folder / "t.parquet", columns)
            if place < len(faults):
                return ["identify", str(folder / "t.parquet"), "--card", shop.card()]
            return _reading(rng, shop, str(folder / "t.parquet"), shop.card())

        yield Case(f"clock {how} {place}", make)


def odd_shapes(rng: np.random.Generator) -> Family:
    """Tables of wrong types and lengths, in the formats that have types."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    n = 400
    columns: dict[str, Any] = {
        "dates": pa.array(np.arange(n).astype("datetime64[ms]")),
        "texts": pa.array([str(k) for k in range(n)]),
        "nothing": pa.nulls(n),
        "truths": pa.array([k % 2 == 0 for k in range(n)]),
        "lists": pa.array([[k, k] for k in range(n)]),
        "structs": pa.array([{"a": k} for k in range(n)]),
        "big integers": pa.array([2**62 + k for k in range(n)]),
        "bytes": pa.array([bytes([k % 256]) for k in range(n)]),
        "halves": pa.array(np.arange(n, dtype=np.float16)),
        "no rows": pa.array([], pa.float64()),
        "many rows": None,
    }
    _ = rng
    for how, column in columns.items():

        def make(shop: Shop, folder: Path, column: Any = column) -> list[str]:
            path = str(folder / "a.parquet")
            if column is None:  # a few bytes that say a hundred million rows
                short = pa.array(np.zeros(1_000_000))
                schema = pa.schema([(name, pa.float64()) for name in shop.columns()])
                with pq.ParquetWriter(path, schema) as writer:
                    table = pa.table([short] * len(schema.names), schema=schema)
                    for _part in range(100):
                        writer.write_table(table)
            else:
                rows = len(column)
                others = {k: pa.array(v[:rows]) for k, v in shop.columns().items()}
                pq.write_table(pa.table({**others, "y": column}), path)
            return ["predict", shop.result("model"), path, "--card", shop.card()]

        yield Case(f"type {how}", make)


# Cards and recipes


def _edited(text: str, line: int, value: str) -> str:
    """The card with what stands behind the first "=" of one of its lines replaced."""
    lines = text.splitlines()
    at = [k for k, one in enumerate(lines) if "=" in one]
    key = lines[at[line % len(at)]].partition("=")[0]
    lines[at[line % len(at)]] = f"{key}= {value}"
    return "\n".join(lines) + "\n"


def card_values(rng: np.random.Generator) -> Family:
    """A card with one key of a wrong type, sign, size or name."""
    written = ["true", '"x"', "[]", "{}", "[[1]]", "1979-05-27", '""', "''", "{a = {b = 1}}"]
    written += [text for text in NUMBERS if text not in ("", "x")]
    written += ['"a"\nunknown = 1', "1\n[card]", '{ column = "y", unit = "m", gain = 1e300 }']
    for number in count():
        rig = list(CARDS)[number % len(CARDS)]
        line, value = int(rng.integers(0, 60)), written[int(rng.integers(0, len(written)))]

        def make(
            shop: Shop,
            folder: Path,
            rig: str = rig,
            line: int = line,
            value: str = value,
            number: int = number,
        ) -> list[str]:
            card = folder / "card.toml"
            card.write_text(_edited(CARDS[rig], line, value), "utf-8")
            if number % 2 == 0:
                return ["simulate", str(card)]
            return _reading(np.random.default_rng(number), shop, shop.log(rig), str(card))

        yield Case(f"card {rig} line {line} = {value[:20]!r} {number}", make)


def card_units(rng: np.random.Generator) -> Family:
    """A signal declared in another unit, or in none at all."""
    for number in count():
        rig = list(CARDS)[int(rng.integers(0, len(CARDS)))]
        unit = UNITS[int(rng.integers(0, len(UNITS)))]
        names = re.findall(r"^(\w+) = \{ column", CARDS[rig], re.MULTILINE)
        name = names[int(rng.integers(0, len(names)))]

        def make(
            shop: Shop,
            folder: Path,
            rig: str = rig,
            unit: str = unit,
            name: str = name,
            number: int = number,
        ) -> list[str]:
            text = re.sub(
                rf'^({name} = .*unit = )"[^"]*"',
                lambda found: f'{found[1]}"{unit}"',
                CARDS[rig],
                flags=re.MULTILINE,
            )
            (folder / "card.toml").write_text(text, "utf-8")
            card = str(folder / "card.toml")
            if number % 4 == 0:
                return ["identify", shop.log(rig), "--card", card]
            return _reading(np.random.default_rng(number), shop, shop.log(rig), card)

        yield Case(f"unit {rig} {name} {unit[:20]!r} {number}", make)


def card_bytes(rng: np.random.Generator) -> Family:
    """Files that are no cards, some made to break the reader."""
    _ = rng
    deep = 20_000
    contents: dict[str, bytes] = {
        "empty": b"",
        "brackets": b"a = " + b"[" * deep,
        "tables": b"a = " + b"{ a = " * deep,
        "dotted": b".".join([b"a"] * 10_000) + b" = 1",
        "dotted quotes": b".".join([b'"a"'] * 10_000) + b" = 1",
        "dotted table": b"[" + b".".join([b"a"] * 10_000) + b"]",
        "dotted inside": b"a = { " + b" . ".join([b"a"] * 10_000) + b" = 1 }",
        "digits": b"a = " + b"9" * 5000,
        "hex digits": b"a = 0x" + b"f" * 100_000,
        "exponent": b"a = 1e" + b"9" * 5000,
        "large": b"# x\n" * 500_000,
        "long line": b"a = '" + b"x" * 900_000 + b"'",
        "many tables": b"".join(b"[a%d]\n" % k for k in range(60_000)),
        "many keys": b"".join(b"a%d = 1\n" % k for k in range(60_000)),
        "array of tables": b"[[a]]\n" * 100_000,
        "open quote": b'a = """' + b"x\n" * 10_000,
        "latin-1": CARDS["force"].encode().replace(b"force", b"f\xf6rce", 1),
        "utf-16": CARDS["force"].encode("utf-16"),
        "nul": CARDS["force"].encode().replace(b"force", b"\0", 1),
        "json": b'{"card": {"name": "x"}}',
        "date": b"a = 9999-99-99",
        "crossed": b"[card]\nname = 'x'\n[card.name]\nx = 1",
        "quotes": b'"' * 300_000,
        "escapes": b'a = "' + b"\\U0010ffff" * 20_000 + b'"',
        "notes": CARDS["force"].encode() + b"[[files]]\nname = 'x'\n" * 30_000,
    }
    for how, content in contents.items():

        def make(shop: Shop, folder: Path, content: bytes = content) -> list[str]:
            (folder / "card.toml").write_bytes(content)
            card = str(folder / "card.toml")
            return ["predict", shop.result("model"), shop.log(), "--card", card]

        yield Case(f"card of {how}", make)


# Models, designs, states


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all entries of a JSON value, inner ones too."""
    if path:
        yield path
    inside: list[tuple[Any, Any]] = []
    if isinstance(value, dict):
        inside = list(value.items())
    elif isinstance(value, list):
        inside = list(enumerate(value[:3]))
    for key, entry in inside:
        yield from _leaves(entry, (*path, key))


def _using(name: str, path: str, shop: Shop, number: int) -> list[str]:
    """A command that reads a model, a design or a state."""
    model, design = shop.result("model"), shop.result("design")
    log = [shop.log(), "--card", shop.card()]
    if name == "state":
        return ["drift", model, *log, "--state", path]
    if name == "design":
        targets = [["--to", one] for one in ("c", "st", "plcopen", "fmu", "json", "mat")]
        return [["validate", model, path], ["export", path, *chain(*targets)]][number // 4 % 2]
    tables = [["--to", one] for one in ("friction-table", "csv", "c", "st")]
    return [
        ["export", path, *chain(*tables), "--rated", "2"],
        ["design", path],
        ["predict", path, *log],
        ["validate", path, design],
        ["drift", path, *log],
        ["validate", model, design, "--plant", path],
    ][number % 6]


def result_values(rng: np.random.Generator) -> Family:
    """A result with one entry taken out or changed."""
    for number in count():
        name = ("model", "model", "design", "state")[number % 4]
        draw, value = rng.random(), VALUES[int(rng.integers(0, len(VALUES)))]
        remove = rng.random() < 0.2

        def make(
            shop: Shop,
            folder: Path,
            name: str = name,
            draw: float = draw,
            value: Any = value,
            remove: bool = remove,
            number: int = number,
        ) -> list[str]:
            content = json.loads(Path(shop.result(name)).read_text("utf-8"))
            paths = list(_leaves(content))
            *outer, key = paths[int(draw * len(paths))]
            entry = content
            for part in outer:
                entry = entry[part]
            if remove:
                del entry[key]
            else:
                entry[key] = value
            (folder / f"{name}.json").write_text(json.dumps(content), "utf-8")
            return _using(name, str(folder / f"{name}.json"), shop, number // 4)

        shown = "removed" if remove else repr(value)[:20]
        yield Case(f"{name} {draw:.4f} {shown} {number}", make)


def result_bytes(rng: np.random.Generator) -> Family:
    """Files that are no results, some made to break the reader."""
    _ = rng
    contents: dict[str, Callable[[bytes], bytes]] = {
        "empty": lambda _: b"",
        "half": lambda whole: whole[: len(whole) // 2],
        "brackets": lambda _: b"[" * 200_000,
        "tables": lambda _: b'{"a":' * 200_000,
        "nested": lambda _: b'{"a":' * 900 + b"1" + b"}" * 900,
        "nested in place": lambda whole: whole.replace(b'"force"', b"[" * 800 + b"]" * 800, 1),
        "digits": lambda whole: re.sub(rb"\d+\.\d+", b"9" * 5000, whole, count=1),
        "many digits": lambda whole: re.sub(rb"\d+\.\d+", b"9" * 400, whole),
        "null": lambda _: b"null",
        "a number": lambda _: b"1",
        "nan": lambda whole: re.sub(rb"\d+\.\d+", b"NaN", whole),
        "twice": lambda whole: whole + whole,
        "utf-16": lambda whole: whole.decode().encode("utf-16"),
        "latin-1": lambda whole: whole.replace(b"a", b"\xff"),
        "schema": lambda _: b'{"schema": "model/1"}',
        "surrogates": lambda whole: whole.replace(b'"force"', b'"\\ud800"', 1),
        "large": lambda whole: whole + b" " * 60_000_000,
    }
    for number, (how, content) in enumerate(contents.items()):
        for name in ("model", "design", "state"):

            def make(
                shop: Shop,
                folder: Path,
                name: str = name,
                content: Callable[[bytes], bytes] = content,
                number: int = number,
            ) -> list[str]:
                whole = Path(shop.result(name)).read_bytes()
                (folder / f"{name}.json").write_bytes(content(whole))
                return _using(name, str(folder / f"{name}.json"), shop, number)

            yield Case(f"{name} of {how}", make)


# Command lines


def options(rng: np.random.Generator) -> Family:
    """Each option that takes a value, with absurd ones."""
    log, model = ["{log}", "--card", "{card}"], "{model}"
    takers = {
        ("identify", *log): ("--design-period", "--orders", "--seed", "--drive"),
        ("predict", model, *log): ("--window", "--drive"),
        ("design", model): ("--design-period", "--modulus", "--delay", "--poles", "--auxiliary"),
        ("validate", model, "{design}"): (
            *("--modulus", "--delay", "--standstill", "--tracking", "--overshoot", "--force"),
            "--seed",
        ),
        ("drift", model, *log): ("--margin", "--variation", "--run-length", "--seed"),
        ("trace", *log): ("--seed",),
        ("simulate", "{card}"): ("--seed", "--format"),
        ("registry", "list"): ("--registry",),
        ("reidentify", "."): ("--registry", "--settle", "--lease", "--attempts"),
    }
    numbers = [*NUMBERS, "1e6,0.9", "1e300,1e300", "1e-300,0.7", "20,1e-300", "3,2,99999999"]
    numbers += ["9" * 400 + ",1,1", "0,0,0", "1,1,1", "0.5,0.5j", "1e300", ",".join(["0.1"] * 500)]
    everything = [
        (command, option, value)
        for command, names in takers.items()
        for option in names
        for value in numbers
    ]
    for place in rng.permutation(len(everything)):
        command, option, value = everything[place]

        def make(
            shop: Shop,
            _folder: Path,
            command: tuple[str, ...] = command,
            option: str = option,
            value: str = value,
        ) -> list[str]:
            known = {
                "{log}": shop.log(),
                "{card}": shop.card(),
                "{model}": shop.result("model"),
                "{design}": shop.result("design"),
            }
            return [*(known.get(part, part) for part in command), f"{option}={value}"]

        yield Case(f"option {command[0]} {option} {value[:20]!r}", make)


def _lines(shop: Shop, path: str, number: int) -> list[str]:
    """A command line in which a path stands in one of all places."""
    log, card = shop.log(), shop.card()
    model, design = shop.result("model"), shop.result("design")
    return [
        ["predict", model, path, "--card", card],
        ["predict", model, log, "--card", path],
        ["predict", path, log, "--card", card],
        ["validate", model, path],
        ["drift", model, log, "--card", card, "--state", path],
        ["simulate", path],
        ["simulate", card, "--effects", path],
        ["design", model, "--out", path],
        ["registry", "list", "--registry", path],
        ["identify", path, "--card", card],
        ["reidentify", path, "--registry", "r.db"],
        ["trace", log, "--test", path, "--card", card],
        ["validate", model, design, "--plant", path],
        ["export", path, "--to", "c"],
        ["axis-test", path, "--card", card],
        ["axis-test", log, "--card", card, "--registry", path],
    ][number % 16]


def names(rng: np.random.Generator) -> Family:
    """Names that are no files, too long, or not to be printed."""
    _ = rng
    for number, name in enumerate(name for name in NAMES for _place in range(15)):

        def make(shop: Shop, _folder: Path, name: str = name, number: int = number) -> list[str]:
            return _lines(shop, name, number)

        yield Case(f"name {name[:20]!r} {number % 15}", make)


def files(rng: np.random.Generator) -> Family:
    """Things that are no files to read: folders, pipes, devices, sockets, links, endless ones."""
    _ = rng

    def sparse(path: Path) -> None:
        path.touch()
        os.truncate(path, 10**12)

    def plug(path: Path) -> None:
        here = socket.socket(socket.AF_UNIX)
        here.bind(str(path.relative_to(Path.cwd())))
        here.close()

    makers: dict[str, Callable[[Path], object]] = {
        "folder": lambda path: path.mkdir(),
        "pipe": lambda path: os.mkfifo(path),
        "endless": lambda path: path.symlink_to("/dev/zero"),
        "random": lambda path: path.symlink_to("/dev/urandom"),
        "null": lambda path: path.symlink_to("/dev/null"),
        "socket": plug,
        "sparse": sparse,
        "terminal": lambda path: path.symlink_to("/dev/tty"),
        "zeros": lambda path: path.write_bytes(bytes(10_000)),
    }
    for how, place in ((how, place) for place in range(15) for how in makers):

        def make(shop: Shop, folder: Path, how: str = how, place: int = place) -> list[str]:
            makers[how](folder / "thing")
            return _lines(shop, str(folder / "thing"), place)

        yield Case(f"file {how} {place}", make)


FAMILIES: tuple[Callable[[np.random.Generator], Family], ...] = (
    *(damaged_bytes, odd_texts, odd_signals, odd_clocks, odd_shapes, card_values, card_units),
    *(card_bytes, result_values, result_bytes, options, names, files),
)
