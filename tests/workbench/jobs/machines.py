"""Folders of machines with logs of one line, and a first active version."""

from datetime import UTC, datetime
from pathlib import Path

from design.judgement import Candidate
from workbench.registry.store import Registry

NOW = datetime(2026, 3, 1, tzinfo=UTC)


def machine(root: Path, name: str, logs: dict[str, str]) -> Path:
    """The folder of a machine with these logs."""
    folder = root / name / "logs"
    folder.mkdir(parents=True, exist_ok=True)
    (root / name / "card.toml").write_text("", encoding="utf-8")
    for file, text in logs.items():
        (folder / file).write_text(text, encoding="utf-8")
    return folder


def activate(registry: Registry, *names: str) -> None:
    """A first version of each machine, active."""
    for name in names:
        registry.add(name, Candidate({"first": name}), reason="first", by="test", now=NOW)
        registry.promote(name, 1, reason="first", by="test", now=NOW)
