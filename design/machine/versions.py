"""Versions of the packages that a result's numbers hang on, as they are installed."""

from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("servo-workbench", "numpy", "scipy", "numba")


def versions() -> dict[str, str]:
    """Versions of our package and of those that its numbers hang on."""
    return {name: installed(name) or "unknown" for name in PACKAGES}


def installed(name: str) -> str | None:
    """The version of a package; None where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None
