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
    cache, data = found.cache, found.data
    lines = [
        f"python    {found.python}",
        f"system    {found.platform}, {found.processors} processors",
        f"packages  {packages}",
    ]
    for name, number in found.optional.items():
        lines.append(f"optional  {name} {number or 'not installed'}: {OPTIONAL[name]}")
    size = float(str(cache["bytes"])) / 1e6
    writable = "writable" if cache["writable"] else "NOT writable"
    lines.append(f"kernels   {cache['kernels']} compiled, {size:.3g} MB, {writable}")
    lines += [f"          in {place}" for place in _texts(cache["places"])]
    folder = data["folder"] or "WORKBENCH_DATA is not set: measured sets are fetched when needed"
    lines.append(f"data      {folder}")
    cards = data["cards"]
    if isinstance(cards, Mapping):
        lines += [f"          {name}: {of['there']} of {of['of']} files"
                  for name, of in cards.items()]  # fmt: skip
    if registry is None:
        lines.append("registry  none named (--registry, or WORKBENCH_REGISTRY)")
    else:
        says = f"answers, {registry['machines']} machines" if registry["answers"] else "no answer"
        lines.append(f"registry  {registry['where']}: {says}")
    return screen(*lines, *(f"wrong     {one}" for one in wrong))


def _texts(value: object) -> list[str]:
    return [str(one) for one in value] if isinstance(value, list) else []
