"""What one screen is, for the tests of what commands print."""

from workbench.screen import SCREEN_LINES, SCREEN_WIDTH, Screen


def one_screen(shown: str | Screen) -> str:
    """The text of a screen, by default, which has to be one: 40 lines of 100 columns."""
    text = shown.text() if isinstance(shown, Screen) else shown
    lines = text.splitlines()
    assert 0 < len(lines) <= SCREEN_LINES, text
    wide = [line for line in lines if len(line) > SCREEN_WIDTH]
    assert not wide, wide
    return text


def words_of(text: str) -> str:
    """The text on one line, however it is folded."""
    return " ".join(text.split())
