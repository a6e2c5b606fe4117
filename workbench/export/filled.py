"""The templates of this folder filled in."""

from typing import Any

from workbench.output import templates


def filled(template: str, *, markup: bool = False, **values: Any) -> str:
    """The template `<template>.j2` filled in; with `markup`, values are escaped for XML."""
    found = templates("workbench.export", escaped=markup, keep_trailing_newline=True)
    return found.get_template(f"{template}.j2").render(**values)
