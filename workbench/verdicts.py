"""The words in which people read what documents and metrics name by a key."""

WORDS_OF_VERDICTS = {
    "none": "unchanged",
    "not_judged": "inconclusive",
    "structure": "structure changed",
    "set_aside": "excluded",
}


def in_words(key: str) -> str:
    """A verdict, a decision or another key of a document as people read it."""
    return WORDS_OF_VERDICTS.get(key, key.replace("_", " "))
