"""The installation on a terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from workbench.screen import Screen, screen
from workbench.steps.installation import OPTIONAL, Installation


def installation_view(
    found: Installation, registry: Mapping[str, Any] | None, wrong: Sequence[str]
) -> Screen:
    """Versions, kernels, data and registry, a line each, and what is wrong."""
    packages = ", ".join(f"{name} {number}" for name, number in found.packages.items())
    cache, cards, places = found.cache, found.data["cards"], found.cache["places"]
    size = float(str(cache["bytes"])) / 1e6
    writable = "writable" if cache["writable"] else "NOT writable"
    folder = "WORKBENCH_DATA is not set: measured sets are fetched when needed"
    says = "none named (--registry, or WORKBENCH_REGISTRY)"
    if registry is not None:
        many = f"answers, {registry['machines']} machines" if registry["answers"] else "no answer"
        says = f"{registry['where']}: {many}"
    rows = [
        ("python", found.python),
        ("system", f"{found.platform}, {found.processors} processors"),
        ("packages", packages),
        *(("optional", f"{name} {number or 'not installed'}: {OPTIONAL[name]}")
          for name, number in found.optional.items()),
        ("kernels", f"{cache['kernels']} compiled, {size:.3g} MB, {writable}"),
        *(("", f"in {place}") for place in (places if isinstance(places, list) else ())),
        ("data", found.data["folder"] or folder),
        *(("", f"{name}: {of['there']} of {of['of']} files")
          for name, of in (cards.items() if isinstance(cards, Mapping) else ())),
        ("registry", says),
        *(("wrong", one) for one in wrong),
    ]  # fmt: skip
    return screen(*(f"{label:10}{text}" for label, text in rows))
