"""The tables of a model and the controls that take them: which files are written, and which not."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from identification.errors import BadModel
from workbench.export.backlash_formats import BACKLASH
from workbench.export.cogging_formats import COGGING, NO_COGGING_TABLE
from workbench.export.compensation import Compensation, Format, TableFile
from workbench.export.feed_forward import feed_forward_c, feed_forward_st
from workbench.export.friction_formats import FRICTION, NO_FRICTION_TABLE

FORMATS: Mapping[str, tuple[Format, ...]] = {
    "friction-table": FRICTION,
    "cogging-table": COGGING,
    "backlash": BACKLASH,
}
NOT_THERE: Mapping[str, Mapping[str, str]] = {
    "friction-table": {"codesys": NO_FRICTION_TABLE},
    "cogging-table": NO_COGGING_TABLE,
    "backlash": {},
}
CODE: Mapping[str, Callable[[Compensation], tuple[TableFile, ...]]] = {
    "c": feed_forward_c,
    "st": feed_forward_st,
}


@dataclass(frozen=True)
class Tables:
    """The files of what was asked for, and what is not written, a line each with its reason."""

    files: tuple[TableFile, ...]
    left_out: tuple[str, ...]


def tables(what: Compensation, targets: Sequence[str], controls: Sequence[str]) -> Tables:
    """The files of these targets, for these controls; for every control where none is named.

    Raises BadModel, in one line, where a target or a control that was named cannot be written:
    what the model lacks, or what only the user can say.
    """
    files, left = list[TableFile](), list[str]()
    for target in dict.fromkeys(targets):
        if target == "csv":
            for table in FORMATS:
                _tried(_of(table, ""), what, files, left)
            if not files:
                raise BadModel("; ".join(left))
        elif target in CODE:
            files += CODE[target](what)
        else:
            files += [one(what) for one in _of(target, "")]
            _for_controls(target, what, controls, files, left)
    for control in controls:
        if left and not any(one.control == control for one in files):
            raise BadModel("; ".join(left))
    by_name = {one.name: one for one in files}
    return Tables(tuple(by_name.values()), tuple(dict.fromkeys(left)))


def _of(table: str, control: str) -> list[Format]:
    """The files of a table for a control, "" for any."""
    return [one for one in FORMATS[table] if one.control == control]


def _tried(
    formats: Iterable[Format], what: Compensation, files: list[TableFile], left: list[str]
) -> None:
    """All files of these formats, or why not."""
    try:
        files += [one(what) for one in formats]
    except BadModel as error:
        left.append(str(error))


def _for_controls(
    target: str, what: Compensation, controls: Sequence[str], files: list[TableFile],
    left: list[str],
) -> None:  # fmt: skip
    """The files of each control; one that is not named is left out where a number is wanting."""
    known = dict.fromkeys(one.control for one in FORMATS[target] if one.control)
    for control in controls or known:
        formats = _of(target, control)
        if not formats:
            left.append(NOT_THERE[target][control])
        refused, before = list[str](), len(files)
        for one in formats:
            _tried([one], what, files, refused)
        if controls and refused and len(files) == before:
            raise BadModel(refused[0])
        left += refused
