"""Versions of our package and of those that its numbers hang on."""

from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("servo-workbench", "numpy", "scipy", "numba")


def versions() -> dict[str, str]:
    """Versions of our package and of those that its numbers hang on."""
    return {name: _version(name) for name in PACKAGES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"
