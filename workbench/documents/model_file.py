"""model.json: a model as it is written, and read back in SI."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from identification.effects._library import Library, built_in
from identification.errors import BadModel
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import actuator_units
from workbench.cards.effect_values import estimates_in_si
from workbench.cards.parameter_units import all_converted, friction_units, in_unit, shown
from workbench.documents.codec import Around, Command, around_in, written
from workbench.documents.model import Model, ModelFile, fields_of
from workbench.documents.plausible import refuse_changed_units
from workbench.documents.reading import Stored, as_number, plain, read_raw, validated

MODEL_SCHEMA = "model/1"


def model_document(model: Model) -> dict[str, Any]:
    """The model as model.json writes it: the schema first, one entry an estimate."""
    document = plain(ModelFile(**fields_of(model)))
    document["friction"] = {name: document["friction"][name] for name in NAMES}
    if model.controller is not None:
        document["controller"] = written(model.controller, around_of(model.rig))
    return {"schema": document.pop("schema"), **document}


def around_of(rig: Rig) -> Around:
    """What the written form of a rig's controller hangs on."""
    units = shown(rig.motion == "rotary", rig.command_unit)
    return Around(units, Command(units.command, rig.control_limit, None))


def read_model(path: Path | Stored, library: Library | None = None) -> Model:
    """The model in the file `path`, or stored; raises BadModel in one line where it is none.

    library: the effects that it may name, by default all but a user's own files.
    """
    raw = read_raw(path, MODEL_SCHEMA)
    rig = raw.get("rig")
    found = validated(raw, path, ModelFile, around_in(rig, "motion", rig, "command_unit"))
    if library is None:
        library = _installed() if found.effects else built_in()
    try:
        return in_si(found, library)
    except BadModel as error:
        raise BadModel(f"{path}: {error}") from None


def _installed() -> Library:
    from workbench.cards.own_effects import library

    return library()


def in_si(found: ModelFile, library: Library) -> Model:
    """The model with every parameter in its SI unit.

    Raises BadModel where a unit is of no such kind, an effect is not in the library, or a value in
    another unit than ours contradicts the rest.
    """
    motion = found.rig.motion
    friction = friction_units(motion)
    actuator = actuator_units(motion, found.rig.command_unit)
    drive = found.actuator
    try:
        effects = {
            key: estimates_in_si(key, values, library, motion, found.rig.command_unit)
            for key, values in found.effects.items()
        }
    except BadModel as error:
        said = str(error)
        raise BadModel(said if said.startswith("[") else f"[effects] {said}") from None
    shapes = {f"{key}.{n}": e.unit for key, own in effects.items() for n, e in own.items()}
    in_units = replace(
        found,
        friction={n: in_unit(e, friction[n], f"[friction.{n}]") for n, e in found.friction.items()},
        falling={n: in_unit(e, friction[n], f"[falling.{n}]") for n, e in found.falling.items()},
        actuator=drive
        and {n: in_unit(e, actuator[n], f"[actuator.{n}]") for n, e in drive.items()},
        effects=effects,
        posterior=_posterior_in_si(found.posterior, {**friction, **actuator, **shapes}),
    )
    refuse_changed_units(found, in_units)
    return Model(**fields_of(in_units), library=library, read=tuple(_read(found, in_units)))


def _read(written: ModelFile, found: ModelFile) -> list[str]:
    """A line for each value that was written in another unit."""
    said = all_converted(written.friction, found.friction, "friction")
    said += all_converted(written.actuator or {}, found.actuator or {}, "actuator")
    for key, values in found.effects.items():
        said += all_converted(written.effects[key], values, f"effects.{key}")
    raw, values = (_intervals(e.posterior) for e in (written, found))
    return said + all_converted(raw, values, "posterior.parameters")


def _posterior_in_si(
    posterior: Mapping[str, Any] | None, units: Mapping[str, str]
) -> Mapping[str, Any] | None:
    """The posterior with its parameters in SI; raises BadModel where a unit is of another kind."""
    if posterior is None:
        return None
    found = {}
    for name, one in _intervals(posterior).items():
        if name not in units:
            raise BadModel(f"[posterior.parameters] unknown parameter {name!r}")
        found[name] = as_number(in_unit(one, units[name], f"[posterior.parameters.{name}]"))
    return {**posterior, "parameters": found}


def _intervals(posterior: Mapping[str, Any] | None) -> dict[str, Estimate]:
    """The parameters of a posterior; raises BadModel where one is no value with its unit."""
    try:
        return {n: Estimate(**one) for n, one in (posterior or {}).get("parameters", {}).items()}
    except (TypeError, AttributeError):
        raise BadModel(
            "[posterior.parameters] a table of value, unit, sd, low, high each needed; run"
            " 'workbench identify --posterior' again"
        ) from None
