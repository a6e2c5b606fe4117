"""Result files read back: strict JSON into frozen dataclasses, one line where it does not fit."""

import json
import math
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from identification.errors import BadModel
from workbench.cards.card import OFFERED_FOR_VELOCITY
from workbench.cards.nearest import nearest
from workbench.files import ABSURD, RESULT_BYTES, refuse_larger, refuse_special
from workbench.links import broken_link

Value = TypeVar("Value")
MOST_DIGITS = 30  # of a whole number in a result


def read_result(path: Path, kind: type[Value], schema: str) -> Value:
    """The result of dataclass `kind` in the JSON file `path`.

    Raises BadModel, one line: file, key, what was found and needed; an unknown key comes with the
    nearest right one.
    """
    raw = _read_json(path)
    if not isinstance(raw, Mapping):
        raise BadModel(f"{path}: holds {_shown(raw)}, a JSON object needed; give a {schema} file")
    found = raw.get("schema")
    if found != schema:
        if str(found).startswith("velocity-") and not schema.startswith("velocity-"):
            raise BadModel(
                f'{path}: of a rig of kind = "velocity", for which this is not offered; there are'
                f" {OFFERED_FOR_VELOCITY}"
            )
        said = "no 'schema'" if found is None else f"schema {_shown(found)}"
        raise BadModel(f"{path}: {said}, {schema!r} needed; give the file that command writes")
    unknown = _unknown(raw, kind, "")
    if unknown:
        raise BadModel(f"{path}: {unknown}")
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(kind).validate_json(json.dumps(raw), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise BadModel(f"{path}: {_explained(dict(first))}") from None
    except BadModel as error:
        raise BadModel(f"{path}: {error}") from None


def read_document(path: Path, schema: str | None = None) -> dict[str, Any]:
    """The JSON object in the file, unchecked but for its schema; raises BadModel in one line."""
    raw = _read_json(path)
    if not isinstance(raw, dict) or (schema is not None and raw.get("schema") != schema):
        needed = "a JSON object" if schema is None else f"a {schema} file"
        raise BadModel(f"{path}: holds {_shown(raw)}; {needed} needed")
    return raw


def _read_json(path: Path) -> object:
    refuse_special(path, BadModel)
    refuse_larger(path, RESULT_BYTES, "a result", BadModel)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        wrong = broken_link(path) or "no such file; give the path of a result"
        raise BadModel(f"{path}: {wrong}") from None
    except IsADirectoryError:
        raise BadModel(f"{path}: is a directory; give the JSON file in it") from None
    except UnicodeDecodeError:
        raise BadModel(f"{path}: is not UTF-8 text, so no JSON; give a result file") from None
    except OSError as error:
        wrong = broken_link(path) or f"cannot be read ({error.strerror}); check its rights"
        raise BadModel(f"{path}: {wrong}") from None
    try:
        return json.loads(
            text, parse_constant=_refuse_constant, parse_float=_finite, parse_int=_whole
        )
    except json.JSONDecodeError as error:
        raise BadModel(
            f"{path}: is not JSON ({error}); give the file that a command wrote"
        ) from None
    except RecursionError:
        raise BadModel(
            f"{path}: is nested too deeply for a result; run the command again"
        ) from None
    except ValueError as error:
        raise BadModel(f"{path}: {error}") from None


def _refuse_constant(name: str) -> float:
    raise ValueError(f"holds {name}, finite numbers needed; write null and a reason")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"holds {text}, finite numbers needed; write null and a reason")
    if abs(value) > ABSURD:
        raise ValueError(f"holds {text}, which no machine reaches; correct it, or run it again")
    return value


def _whole(text: str) -> int:
    if len(text) > MOST_DIGITS:
        raise ValueError(f"holds {text[:MOST_DIGITS]}..., which no machine reaches; correct it")
    return int(text)


def _unknown(raw: object, kind: Any, where: str) -> str | None:
    """What is wrong with the first key that `kind` does not have, searched depth first."""
    for option in _options(kind):
        if is_dataclass(option) and isinstance(raw, Mapping):
            hints = get_type_hints(option)
            names = [field.name for field in fields(option)]
            for key, entry in raw.items():
                place = f"{where}.{key}" if where else str(key)
                if key not in names:
                    table = f"[{where}] " if where else ""
                    return f"{table}unknown key {key!r}{nearest(str(key), names)}"
                wrong = _unknown(entry, hints[key], place)
                if wrong:
                    return wrong
        elif get_origin(option) is tuple and isinstance(raw, list):
            inner = get_args(option)[0]
            for number, entry in enumerate(raw):
                wrong = _unknown(entry, inner, f"{where}.{number}")
                if wrong:
                    return wrong
        elif isinstance(raw, Mapping) and len(get_args(option)) == 2:
            for key, entry in raw.items():
                wrong = _unknown(entry, get_args(option)[1], f"{where}.{key}")
                if wrong:
                    return wrong
    return None


def _options(kind: Any) -> tuple[Any, ...]:
    """The types of a union, or the type itself."""
    return get_args(kind) if get_origin(kind) in (Union, types.UnionType) else (kind,)


def _explained(first: Mapping[str, Any]) -> str:
    loc = [str(part) for part in first["loc"]]
    if first["type"] in ("missing", "missing_argument"):
        table = f"[{'.'.join(loc[:-1])}] " if loc[:-1] else ""
        return f"{table}has no {loc[-1]!r}; add it, or run the command again"
    where = f"[{'.'.join(loc)}] " if loc else ""
    message = " ".join(str(first["msg"]).removeprefix("Value error, ").split())
    return f"{where}{_shown(first.get('input'))}: {message[:1].lower()}{message[1:]}"


def _shown(value: object) -> str:
    return " ".join(repr(value).split())[:60]
