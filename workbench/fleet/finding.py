"""Where a fleet's logs are: a folder, a file, a pattern or any URL that fsspec reads."""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any

from workbench.addresses import shown, without_secrets
from workbench.files import CARD_FILE
from workbench.fleet.values import NEEDED, BadLogs, LogFile

SUFFIX = ".parquet"
TIMES = ("mtime", "LastModified", "last_modified", "modified", "updated", "created", "date_time")


def find_logs(url: str, leave_out: Path | None = None) -> tuple[LogFile, ...]:
    """The Parquet logs at the URL, by machine and name.

    A log's machine is the first folder below the URL ("machine=a" is "a"), or else the file's
    name. leave_out: a local folder that holds no logs. Raises BadLogs.
    """
    if not url.strip():
        raise BadLogs("LOGS is empty; give a folder, a file or an fsspec URL of Parquet logs")
    system, root = file_system(url)
    listing = system.glob if "*" in root or "?" in root else system.find
    try:
        found: Mapping[str, Mapping[str, Any]] = listing(root, detail=True)
    except Exception as error:  # every file system has errors of its own
        raise BadLogs(
            f"{shown(url)}: cannot be listed ({said(error, url)}); check the address"
        ) from error
    base = PurePosixPath(_base(root, found))
    own = leave_out.absolute() if leave_out is not None and _is_local(system) else None
    logs = []
    for path, info in found.items():
        if info.get("type") == "directory":  # a pattern finds them too
            continue
        name = PurePosixPath(path).relative_to(base) if base.parts else PurePosixPath(path)
        hidden = any(part.startswith((".", "_")) for part in name.parts)
        if name.suffix.lower() != SUFFIX or hidden or (own and Path(path).is_relative_to(own)):
            continue
        first = name.parts[0].removeprefix("machine=") if len(name.parts) > 1 else name.stem
        logs.append(LogFile(first, str(name), path, int(info.get("size") or 0), _time(info)))
    if not logs:
        raise BadLogs(
            f"{shown(url)}: no logs (*{SUFFIX}) there; give a folder, a file or an fsspec URL with"
            f" logs as <machine>/*{SUFFIX} or <machine>{SUFFIX}"
        )
    return tuple(sorted(logs, key=lambda log: (log.machine, log.mtime_ns, log.name)))


def file_system(url: str) -> tuple[Any, str]:
    """fsspec's file system of the URL and the path in it; raises BadLogs."""
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise BadLogs(NEEDED) from None
    try:
        system, root = url_to_fs(url)
    except Exception as error:  # a protocol without its package, an archive that is none
        raise BadLogs(
            f"{shown(url)}: cannot be opened ({said(error, url)}); check the address"
        ) from error
    return system, str(root)


def card_text(url: str, log: LogFile) -> str | None:
    """The nearest card.toml at or above the log, down from the URL's folder; None without one."""
    system, _ = file_system(url)
    folder, depth = PurePosixPath(log.path).parent, len(PurePosixPath(log.name).parts)
    for _ in range(depth):
        path = str(folder / CARD_FILE) if folder.parts else CARD_FILE
        try:
            if system.isfile(path):
                return str(system.cat_file(path).decode("utf-8-sig"))
        except Exception as error:
            raise BadLogs(f"{shown(path)}: cannot be read ({said(error, url)})") from error
        folder = folder.parent
    return None


@contextmanager
def local_copy(url: str, log: LogFile) -> Iterator[Path]:
    """The log as a file here: where it lies, or else a copy that is gone after the block.

    Raises BadLogs where it cannot be read.
    """
    system, _ = file_system(url)
    if _is_local(system):
        yield Path(log.path)
        return
    with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
        target = Path(folder) / PurePosixPath(log.name).name
        try:
            system.get_file(log.path, str(target))
        except Exception as error:
            raise BadLogs(f"{shown(log.name)}: cannot be fetched ({said(error, url)})") from error
        yield target


def said(error: BaseException, address: str = "") -> str:
    """What an error says, in one line of bounded length, without the secrets of the address."""
    text = without_secrets(" ".join(str(error).split()), address) or type(error).__name__
    return text if len(text) <= 200 else f"{text[:200]}..."


def _base(root: str, found: Mapping[str, Any]) -> str:
    """The folder below which names are taken."""
    parts = PurePosixPath(root).parts
    for number, part in enumerate(parts):
        if "*" in part or "?" in part:
            return str(PurePosixPath(*parts[:number])) if number else ""
    if root in found:
        parent = PurePosixPath(root).parent
        return str(parent) if parent.parts else ""
    return root


def _is_local(system: Any) -> bool:
    protocol = system.protocol
    return "file" in ([protocol] if isinstance(protocol, str) else protocol)


def _time(info: Mapping[str, Any]) -> int:
    """Modification time [ns]; 0 where the file system does not give it."""
    for key in TIMES:
        found = info.get(key)
        if isinstance(found, int | float):
            return round(found * 1e9)
        if isinstance(found, tuple) and len(found) == 6:  # of zip archives
            return round(datetime(*found, tzinfo=UTC).timestamp() * 1e9)
        if isinstance(found, datetime):
            return round(found.timestamp() * 1e9)
    return 0
