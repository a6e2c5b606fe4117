"""The words in which people read what documents and metrics name by a key or a count."""

WORDS_OF_VERDICTS = {
    "none": "unchanged",
    "not_judged": "inconclusive",
    "structure": "structure changed",
    "set_aside": "excluded",
}


def in_words(key: str) -> str:
    """A verdict, a decision or another key of a document as people read it."""
    return WORDS_OF_VERDICTS.get(key, key.replace("_", " "))


def counted(count: int, thing: str) -> str:
    """So many of a thing: "1 log", "3 logs"."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"
