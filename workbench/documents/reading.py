"""Results read back: strict JSON into frozen dataclasses, one line where it does not fit."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from design.machine.validated import brief, validated
from identification.errors import BadModel
from identification.signals.check import ABSURD
from workbench.cards.card import OFFERED_FOR_VELOCITY
from workbench.files import RESULT_BYTES, broken_link, refuse_larger, refuse_special

Value = TypeVar("Value")
MOST_DIGITS = 30  # of a whole number in a result


@dataclass(frozen=True)
class Stored:
    """A result that is no file but held in a registry, and what messages call it by."""

    name: str
    content: Mapping[str, Any]

    def __str__(self) -> str:
        return self.name


def read_result(path: Path, kind: type[Value], schema: str) -> Value:
    """The result of dataclass `kind` in the JSON file; raises as `read_raw` and `validated`."""
    return validated(read_raw(path, schema), str(path), kind)


def read_raw(path: Path | Stored, schema: str) -> Mapping[str, Any]:
    """The JSON object in the file, or stored; raises BadModel where it is not of that schema."""
    raw = read_document(path)
    found = raw.get("schema")
    if found == schema:
        return raw
    if str(found).startswith("velocity-") and not schema.startswith("velocity-"):
        raise BadModel(
            f'{path}: of a rig of kind = "velocity", for which this is not offered; there are'
            f" {OFFERED_FOR_VELOCITY}"
        )
    said = "no 'schema'" if found is None else f"schema {brief(found)}"
    kind = re.sub("[-_]", " ", schema.partition("/")[0])
    raise BadModel(f"{path}: {said}, {schema!r} needed; give the {kind} that this version writes")


def read_document(path: Path | Stored) -> dict[str, Any]:
    """The JSON object in the file, or stored, unchecked; raises BadModel in one line."""
    raw = _read_json(path)
    if not isinstance(raw, dict):
        raise BadModel(f"{path}: holds {brief(raw)}, a JSON object needed; give a result's file")
    return raw


def _read_json(path: Path | Stored) -> object:
    text = json.dumps(path.content) if isinstance(path, Stored) else _text(path)
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


def _text(path: Path) -> str:
    refuse_special(path, BadModel)
    refuse_larger(path, RESULT_BYTES, "a result", BadModel)
    try:
        return path.read_text(encoding="utf-8")
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
