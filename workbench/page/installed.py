"""Whether the libraries of the page are installed, which an extra brings."""

from importlib.util import find_spec

from identification.errors import UserError

NEEDED_LIBRARIES = ("starlette", "uvicorn", "python_multipart")


class MissingPage(UserError):
    """A library of the page is not installed."""


def refuse_missing() -> None:
    """Raises MissingPage with the extra to install."""
    lost = [name for name in NEEDED_LIBRARIES if find_spec(name) is None]
    if lost:
        raise MissingPage(
            f"the page needs the library {lost[0]!r}, which is not installed; run"
            " pip install 'servo-workbench[page]'"
        )
