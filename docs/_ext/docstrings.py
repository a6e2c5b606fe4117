"""Docstrings, which are plain text, as the markup that Sphinx reads."""

import re

MARKUP = re.compile(r"(``.*?``|`[^`]*`|^ *\.\. .*|^ *:\w+:.*)|([*|\\])|(\w)_(?=\W|$)")


def as_restructured_text(
    app: object, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Escape what would be markup; what is indented after an empty line is an example."""
    out: list[str] = []
    example = False
    for line in lines:
        indented = line.startswith("    ")
        if indented and not example and (not out or not out[-1].strip()):
            out += ["::", ""]
            example = True
        elif line.strip() and not indented:
            example = False
        out.append(line if example else MARKUP.sub(_escaped, line))
    lines[:] = [*out, ""]


def _escaped(found: re.Match[str]) -> str:
    if found[1]:
        return found[1]
    return f"{found[3]}\\_" if found[3] else f"\\{found[2]}"
