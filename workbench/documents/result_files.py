"""model.json and design.json read back in SI; a design is refused where it contradicts itself."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from design.machine.codec import around_in, pairs, said_of
from design.machine.design import Design
from design.machine.documents import design_document, model_document
from design.machine.model import Model, used
from design.machine.plausible import refuse_apart, refuse_changed_units, refuse_unequal
from identification.effects._library import Library, built_in
from identification.errors import BadModel
from identification.model.estimates import Estimate
from workbench.cards.units import conversion
from workbench.documents.reading import Stored, read_raw, validated

DESIGN_SCHEMA = "design/2"


def read_design(path: Path | Stored) -> Design:
    """The design in the file `path`, or stored, in SI; raises BadModel in one line where it is
    none."""
    raw = read_raw(path, DESIGN_SCHEMA)
    around = around_in(raw, "motion", raw.get("command"), "unit")._replace(conversion=conversion)
    found = validated(raw, path, Design, around)
    try:
        ours = design_document(found)
        _refuse_other_laws(raw, ours, found)
        both = tuple(pairs(raw, ours))
        _refuse_changed_units(both, found)
    except BadModel as error:
        raise BadModel(f"{path}: {error}") from None
    if not found.controllers:
        raise BadModel(f"{path}: holds no controller; run 'workbench design' again")
    return replace(found, read=said_of(both))


def _refuse_changed_units(both: tuple[tuple[str, Estimate, Estimate], ...], found: Design) -> None:
    """Raises BadModel where a value in another unit is not what the file says in other places."""
    at = {where: (one, ours) for where, one, ours in both}
    start = "compensator.friction."
    nine = {w.removeprefix(start): both for w, both in at.items() if w.startswith(start)}
    refuse_apart(
        {name: both[0] for name, both in nine.items()},
        {name: both[1] for name, both in nine.items()},
        f"[{start}",
    )
    if "plant.m" in at:
        (one, ours), (other, same) = at["plant.m"], nine["m"]
        refuse_unequal("[plant.m]", one, ours, used(same), f"[{start}m]")
        refuse_unequal(f"[{start}m]", other, same, used(ours), "[plant.m]")
    for name in found.controllers:
        place = name.replace("-", "_")
        (one, ours), (other, same) = at[f"{place}.h"], at["plant.h"]
        refuse_unequal(f"[{place}.h]", one, ours, used(same), "[plant.h]")
        refuse_unequal("[plant.h]", other, same, used(ours), f"[{place}.h]")


def _refuse_other_laws(raw: Mapping[str, Any], ours: Mapping[str, Any], found: Design) -> None:
    """Raises BadModel where a law is not the controller beside it."""
    for name in found.controllers:
        place = name.replace("-", "_")
        law, own = raw[place].get("law"), ours[place]["law"]
        if law is None:
            continue
        if own is None:
            raise BadModel(f"[{name}.law] needs [command]; run 'workbench design' again")
        for key in "RST":
            if len(own[key]) != len(law[key]) or not np.allclose(
                own[key], law[key], rtol=1e-9, atol=0.0
            ):
                raise BadModel(
                    f"[{name}.law] {key} is not [{name}] {key} in the unit of the command; run"
                    " 'workbench design' again"
                )


MODEL_SCHEMA = "model/1"


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
        library=built_in() if library is None else library, conversion=conversion
    )
    found = validated(raw, path, Model, around)
    both = tuple(pairs(raw, model_document(found)))
    try:
        refuse_changed_units({where: one for where, one, _ in both}, found)
    except BadModel as error:
        raise BadModel(f"{path}: {error}") from None
    return replace(found, read=said_of(both))
