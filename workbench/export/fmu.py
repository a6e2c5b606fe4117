"""An FMU 3.0 packed: its descriptions and the controller's source, and no binary."""

import io
import zipfile

from design.generated.c import fmu_texts
from design.generated.exported import Exported
from workbench.export.filled import filled

EPOCH = (1980, 1, 1, 0, 0, 0)  # of the files inside, so that the same design gives the same bytes


def fmu_file(what: Exported) -> dict[str, bytes]:
    """The FMU, by its file's name."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in fmu_texts(what, filled).items():
            archive.writestr(zipfile.ZipInfo(name, EPOCH), text, zipfile.ZIP_DEFLATED)
    return {f"{what.program.name}.fmu": packed.getvalue()}
