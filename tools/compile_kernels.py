"""Compile the kernels that most tests need, once, before two workers would each compile them.

    python tools/compile_kernels.py

They are cached beside their sources; where they are there already this takes a few seconds.
"""

import numpy as np
import pandas as pd

import workbench as wb
from identification.effect_contract.runs import HYDRAULIC, run_with, trial_log, typical
from identification.effects._library import built_in
from workbench.steps.kernels_ahead import fits_compiled_ahead

PLAIN, RICH = "paper_table1_rich", "demo"
SECONDS = 6.0


def short(frame: pd.DataFrame) -> pd.DataFrame:
    """The beginning of a log."""
    return frame[frame["t"] <= SECONDS].iloc[::2].reset_index(drop=True)


def main() -> None:
    """A short log through identification, drift and tracing, every effect's run, then validation,
    while a second process compiles what a fit comes to."""
    with fits_compiled_ahead():
        log = short(wb.simulate(PLAIN).frame)
        model = wb.identify(log, PLAIN)
        wb.drift(model, log.assign(y=np.round(log["y"], 6)), PLAIN)
        wb.simulate(RICH)
        wb.trace(log, None, PLAIN)
        for effect in built_in().values():
            run_with(HYDRAULIC, trial_log(1.0), typical(effect))
        wb.validate(model, wb.design(model))


if __name__ == "__main__":
    main()
