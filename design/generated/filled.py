"""Templates that a text of generated code stands in, which who asks for the text fills in."""

from typing import Any, Protocol


class Filled(Protocol):
    """Fills in a template."""

    def __call__(self, template: str, *, markup: bool = False, **values: Any) -> str:
        """The template of that name filled in; with `markup`, values are escaped for XML."""
        ...
