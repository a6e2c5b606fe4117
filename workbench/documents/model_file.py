"""model.json: a model as it is written, and read back in SI."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from identification.effects._library import Library, built_in
from identification.errors import BadModel
from identification.log import Rig
from identification.model.karnopp import NAMES
from workbench.cards.parameter_units import shown
from workbench.documents.codec import Around, Command, around_in, pairs, said_of, written
from workbench.documents.model import Model
from workbench.documents.plausible import refuse_changed_units
from workbench.documents.reading import Stored, read_raw, validated

MODEL_SCHEMA = "model/1"


def model_document(model: Model) -> dict[str, Any]:
    """The model as model.json writes it: the schema first, one entry an estimate."""
    document = written(model, around_of(model.rig))
    document["friction"] = {name: document["friction"][name] for name in NAMES}
    return {"schema": document.pop("schema"), **document}


def around_of(rig: Rig) -> Around:
    """What the written form of a rig's controller hangs on."""
    units = shown(rig.motion == "rotary", rig.command_unit)
    return Around(units, Command(units.command, rig.control_limit, None))


def read_model(path: Path | Stored, library: Library | None = None) -> Model:
    """The model in the file `path`, or stored, in SI; raises BadModel in one line where it is none.

    library: the effects that it may name, by default all but a user's own files. Refused is too
    what names another effect, or has a value in another unit than ours that contradicts the rest.
    """
    raw = read_raw(path, MODEL_SCHEMA)
    rig = raw.get("rig")
    if library is None and raw.get("effects"):
        from workbench.cards import own_effects  # with it comes numba

        library = own_effects.library()
    around = around_in(rig, "motion", rig, "command_unit")._replace(
        library=built_in() if library is None else library
    )
    found = validated(raw, path, Model, around)
    both = tuple(pairs(raw, model_document(found)))
    try:
        refuse_changed_units({where: one for where, one, _ in both}, found)
    except BadModel as error:
        raise BadModel(f"{path}: {error}") from None
    return replace(found, read=said_of(both))
