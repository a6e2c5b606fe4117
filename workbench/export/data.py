"""A controller as files of values: JSON with the program itself, MAT for a MATLAB model."""

import io

from design.generated.exported import Exported
from design.generated.program_values import matlab_values, program_document
from workbench.output import dumps


def json_file(what: Exported) -> dict[str, str]:
    """The program as a tree, the values behind it and the test vector."""
    return {f"{what.program.name}.json": dumps(program_document(what)) + "\n"}


def mat_file(what: Exported) -> dict[str, bytes]:
    """The values behind the program and the test vector, as a structure for MATLAB (v5)."""
    from scipy.io import savemat

    packed = io.BytesIO()
    savemat(  # its stubs know paths only
        packed,  # type: ignore[arg-type]
        {what.program.name: matlab_values(what)},
        oned_as="row",
        long_field_names=True,
    )
    return {f"{what.program.name}.mat": packed.getvalue()}
