"""Links to files that lead nowhere."""

import errno
from pathlib import Path


def broken_link(path: Path) -> str | None:
    """What is wrong with a link and what to do, as the end of a message; None where it is none."""
    try:
        path.stat()
    except FileNotFoundError:
        if path.is_symlink():
            target = str(path.readlink())
            return f"is a link to {target!r}, which is missing; mend it, or name the file itself"
    except (OSError, RuntimeError) as error:  # RuntimeError: older Pythons, of a circle
        if isinstance(error, RuntimeError) or error.errno == errno.ELOOP:
            return "its links lead in a circle; mend them, or name the file itself"
    return None
