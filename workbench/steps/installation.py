"""The installation looked over: versions, compiled kernels, and the folder of data."""

import os
import platform
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from design.machine.versions import installed
from workbench.cards.card import load_card
from workbench.files import shipped_cards
from workbench.logs.sources import DATA_VARIABLE

SHOWN_VERSIONS = (
    "servo-workbench", "numpy", "scipy", "numba", "pandas", "pyarrow", "pint", "matplotlib",
)  # fmt: skip
OPTIONAL = {"psycopg": "PostgreSQL (servo-workbench[postgres])",
            "distributed": "fleets (servo-workbench[fleet])"}  # fmt: skip
CACHE_SUFFIXES = (".nbi", ".nbc")


@dataclass(frozen=True)
class Installation:
    """What was found. wrong: a line on each thing that does not work; never without a hint."""

    python: str
    platform: str
    processors: int
    packages: Mapping[str, str]
    optional: Mapping[str, str | None]
    cache: Mapping[str, object]
    data: Mapping[str, object]
    wrong: tuple[str, ...]


def check_installation() -> Installation:
    """The installation that runs this."""
    wrong = list[str]()
    return Installation(
        python=f"{platform.python_version()} ({sys.executable})",
        platform=f"{platform.system()} {platform.release()}, {platform.machine()}",
        processors=os.cpu_count() or 1,
        packages={name: installed(name) or "missing" for name in SHOWN_VERSIONS},
        optional={name: installed(name) for name in OPTIONAL},
        cache=_cache(wrong),
        data=_data(wrong),
        wrong=tuple(wrong),
    )


def _cache(wrong: list[str]) -> dict[str, object]:
    """Where numba keeps compiled kernels, how many there are, and whether it can add to them."""
    import numba

    named = numba.config.CACHE_DIR  # type: ignore[attr-defined]  # of NUMBA_CACHE_DIR
    root = Path(__file__).resolve().parents[2]
    places = [Path(named)] if named else [root / "identification", root / "design"]
    found = [
        path for place in places if place.is_dir() for path in place.rglob("*")
        if path.suffix in CACHE_SUFFIXES
    ]  # fmt: skip
    size = sum(path.stat().st_size for path in found)
    there = [next(p for p in (one, *one.parents) if p.exists()) for one in places]
    writable = all(os.access(place, os.W_OK) for place in there)
    if not writable:
        wrong.append(
            f"compiled kernels cannot be cached in {', '.join(map(str, places))}: every command"
            " compiles anew, or numba uses your own cache folder; set NUMBA_CACHE_DIR to a folder"
            " that you may write"
        )
    return {"places": [str(place) for place in places], "kernels": sum(p.suffix == ".nbc"
            for p in found), "bytes": size, "writable": writable}  # fmt: skip


def _data(wrong: list[str]) -> dict[str, object]:
    """The folder of data, and how many files of each shipped card are in it."""
    named = os.environ.get(DATA_VARIABLE)
    if not named:
        return {"folder": None, "cards": {}}
    folder = Path(named)
    if not folder.is_dir():
        wrong.append(f"{DATA_VARIABLE}={named} is no folder; correct it, or unset it")
        return {"folder": named, "cards": {}}
    cards = {}
    for name, path in shipped_cards().items():
        files = load_card(path, with_recipe=False).files
        if files:
            there = sum((folder / name / entry.name).is_file() for entry in files)
            cards[name] = {"there": there, "of": len(files)}
    return {"folder": named, "cards": cards}
