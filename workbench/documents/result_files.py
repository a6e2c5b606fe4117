"""model.json and design.json read back in SI; a design is refused where it contradicts itself."""

from pathlib import Path

from design.machine.design import Design
from design.machine.model import Model
from design.machine.read_back import design_of, model_of
from identification.effects._library import Library, built_in
from workbench.cards.units import conversion
from workbench.documents.reading import Stored, read_raw

DESIGN_SCHEMA, MODEL_SCHEMA = "design/2", "model/1"


def read_design(path: Path | Stored) -> Design:
    """The design in the file `path`, or stored, in SI; raises BadModel in one line where it is
    none."""
    return design_of(read_raw(path, DESIGN_SCHEMA), str(path), conversion)


def read_model(path: Path | Stored, library: Library | None = None) -> Model:
    """The model in the file `path`, or stored, in SI; raises BadModel in one line where it is none.

    library: the effects that it may name, by default all but a user's own files. Refused is too
    what names another effect, or has a value in another unit than ours that contradicts the rest.
    """
    raw = read_raw(path, MODEL_SCHEMA)
    if library is None and raw.get("effects"):
        from workbench.cards import own_effects  # with it comes numba

        library = own_effects.library()
    return model_of(raw, str(path), built_in() if library is None else library, conversion)
