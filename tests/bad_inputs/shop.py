"""What bad inputs are made from: sound cards, logs of every format, a model, design and state."""

from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from design.machine.documents import model_document
from design.simulated.record import record
from identification.arrays import Array
from tests.chain import identified
from tests.workbench.log_files import WRITERS
from workbench.cards.card import load_card
from workbench.cli import main
from workbench.output import dumps
from workbench.steps.simulate import as_columns

_RECIPE = """
[recipe]
duration_s = 6.0
h_s = 2e-3
seed = 5
noise_y = 1e-5
%s
[recipe.friction]
m = 1.0
F_cp = 12.0
F_cn = 15.0
F_vp = 300.0
F_vn = 200.0
dv_p = 0.04
dv_n = -0.04
F_sp = 20.6
F_sn = -23.0
[recipe.reference]
kind = "random_steps"
amplitude = 0.05
dwell_s = 0.5
[recipe.loop]
%s
"""
_PNEUMATIC_LOOP = """position = { kind = "PID", k_R = 1754.0, T_d = 0.018, T_i = 0.072, eps = 0.2 }
force = { k_i = 0.02, T_i = 0.05 }"""
_SIGNALS = """
[signals]
t = { column = "t", unit = "s" }
r = { column = "r", unit = "m" }
y = { column = "y", unit = "m" }
u = { column = "u", unit = "V" }
"""
_ACTUATOR = "actuator = { k1 = 19530.0, k2 = 10405.0 }"
CARDS = {
    "force": (
        '[card]\nname = "force"\n[rig]\nkind = "force"\nstroke_m = [-1.0, 1.0]\n'
        + f'{_SIGNALS}F = {{ column = "F", unit = "N" }}\n'
        + _RECIPE % (f"noise_F = 1e-2\n{_ACTUATOR}", _PNEUMATIC_LOOP)
    ),
    "pneumatic": (
        '[card]\nname = "pneumatic"\n[rig]\nkind = "electro-pneumatic"\narea_p_m2 = 12.6e-4\n'
        + "area_n_m2 = 10.0e-4\nsupply_pressure_pa = 5.0e5\n"
        + f'{_SIGNALS}p_p = {{ column = "p_p", unit = "Pa" }}\n'
        + 'p_n = { column = "p_n", unit = "Pa" }\n'
        + _RECIPE % (f"noise_p = 10.0\n{_ACTUATOR}", _PNEUMATIC_LOOP)
    ),
    "motor": (
        '[card]\nname = "motor"\n[rig]\nkind = "motor"\nforce_per_command = 20.0\n'
        + _SIGNALS
        + _RECIPE
        % (
            "motor = { k_a = 20.0 }",
            'position = { kind = "PID", k_R = 60.0, T_d = 0.1, T_i = 1.0, eps = 0.02 }',
        )
    ),
}
FORMATS = tuple(WRITERS)


@dataclass(frozen=True)
class Shop:
    """A folder of sound files that every case may read and none changes."""

    folder: Path

    def card(self, rig: str = "force") -> str:
        """Path of the rig's card."""
        return str(self.folder / f"{rig}.toml")

    def log(self, rig: str = "force") -> str:
        """Path of the rig's log, a CSV."""
        return str(self.folder / f"{rig}.csv")

    def columns(self, rig: str = "force") -> dict[str, Array]:
        """The columns of that log."""
        names = Path(self.log(rig)).read_text("utf-8").partition("\n")[0].split(",")
        rows = np.loadtxt(self.log(rig), delimiter=",", skiprows=1)
        return {name: rows[:, k].copy() for k, name in enumerate(names)}

    def result(self, name: str) -> str:
        """Path of "model", "design" or "state"."""
        where = {"model": "model/model.json", "design": "design/design.json", "state": "state.json"}
        return str(self.folder / where[name])


def make_shop(folder: Path) -> Shop:
    """The files, in that empty folder."""
    shop = Shop(folder)
    for rig, text in CARDS.items():
        (folder / f"{rig}.toml").write_text(text, "utf-8")
        card = load_card(folder / f"{rig}.toml")
        assert card.recipe is not None
        columns = as_columns(record(rig, card.recipe, None, card.rig()), card)
        WRITERS["a.csv"](folder / f"{rig}.csv", columns)
    for name, write in WRITERS.items():
        write(folder / name, shop.columns())
    Path(shop.result("model")).parent.mkdir()
    Path(shop.result("model")).write_text(dumps(model_document(identified().model)), "utf-8")
    for arguments in (
        ["design", shop.result("model"), "--out", str(folder / "design")],
        ["drift", shop.result("model"), shop.log(), "--card", shop.card(), "--state",
         shop.result("state"), "--out", str(folder / "drift")],
    ):  # fmt: skip
        with redirect_stdout(StringIO()):
            status = main(arguments)
        if status > 1:
            raise AssertionError(f"no sound files to begin with: {arguments}")
    return shop
