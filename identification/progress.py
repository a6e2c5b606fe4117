"""How far a long computation has come, told to whoever asked."""

from collections.abc import Callable

Progress = Callable[[str, float], None]  # the stage and the share of it that is done


def quiet(_stage: str, _share: float) -> None:
    """No progress is shown."""
