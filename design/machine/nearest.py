"""The nearest known name, for a message on an unknown one."""

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(key: str, known: Iterable[str]) -> str:
    """The end of a message on an unknown name: the nearest known one, and what there is."""
    names = [str(name) for name in known]
    lowered = {name.lower(): name for name in reversed(names)}
    close = get_close_matches(key.lower(), lowered, n=1, cutoff=0.5)
    guess = f"; did you mean {lowered[close[0]]!r}?" if close else ";"
    listed = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
    return f"{guess} (there is: {listed or 'nothing'})"
