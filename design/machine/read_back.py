"""Model and design of their documents, in SI; refused where one contradicts itself."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from design.machine.codec import around_in, pairs, said_of
from design.machine.design import Design
from design.machine.documents import design_document, model_document
from design.machine.model import Model, used
from design.machine.plausible import refuse_apart, refuse_changed_units, refuse_unequal
from design.machine.readable import Conversion
from design.machine.validated import validated
from identification.effects._library import Library
from identification.errors import BadModel
from identification.model.estimates import Estimate


def design_of(raw: Mapping[str, Any], called: str, conversion: Conversion) -> Design:
    """The design that a document holds; raises BadModel, by the name that it is called by, in one
    line where it is none."""
    around = around_in(raw, "motion", raw.get("command"), "unit")._replace(conversion=conversion)
    found = validated(raw, called, Design, around)
    try:
        ours = design_document(found)
        _refuse_other_laws(raw, ours, found)
        both = tuple(pairs(raw, ours))
        _refuse_changed_units(both, found)
    except BadModel as error:
        raise BadModel(f"{called}: {error}") from None
    if not found.controllers:
        raise BadModel(f"{called}: holds no controller; run 'workbench design' again")
    return replace(found, read=said_of(both))


def model_of(
    raw: Mapping[str, Any], called: str, library: Library, conversion: Conversion
) -> Model:
    """The model that a document holds, with effects of the library; raises BadModel, by the name
    that it is called by, in one line where it is none."""
    rig = raw.get("rig")
    around = around_in(rig, "motion", rig, "command_unit")._replace(
        library=library, conversion=conversion
    )
    found = validated(raw, called, Model, around)
    both = tuple(pairs(raw, model_document(found)))
    try:
        refuse_changed_units({where: one for where, one, _ in both}, found)
    except BadModel as error:
        raise BadModel(f"{called}: {error}") from None
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
