"""Small readers of the tables of controls, written from their manuals and apart from the writers.

Each gives numbers in SI at the axis, or as the file has them where it says so.
"""

import csv
import math
import re
from collections.abc import Callable

import numpy as np

from identification.arrays import Array

Curve = Callable[[Array], Array]  # of velocity [m/s or rad/s], with its sign, to force [N or N m]


def mirrored(v: list[float], F: list[float]) -> Curve:
    """A table of rising speeds without sign, as a control uses it: the sign is the velocity's."""
    assert v == sorted(v) and min(v) >= 0 and len(set(v)) == len(v)
    return lambda asked: np.sign(asked) * np.interp(np.abs(asked), v, F)


def neutral(text: str) -> tuple[list[str], Array]:
    """Heads and rows of a CSV with comments."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    head, *rows = csv.reader(lines)
    return head, np.array(rows, dtype=float)


def cnc_list(text: str) -> dict[str, int]:
    """A list of TwinCAT CNC: name and whole number a line."""
    pairs = [line.split() for line in text.splitlines() if line and line[0] != "#"]
    assert all(len(pair) == 2 for pair in pairs)
    found = {name: int(value) for name, value in pairs}
    assert len(found) == len(pairs)
    return found


def cnc_friction(text: str, rotary: bool, rated: float, per_turn: float | None) -> Curve:
    """TF5200: in um/s or 0.001 deg/s, out in 0.1 % of the rated torque, scaled by 0.1 %."""
    found = cnc_list(text)
    count = found["frict_comp.table_entries"]
    assert found["frict_comp.mode"] == 3 and 2 <= count <= 20
    speed = math.radians(1e-3) if rotary else 1e-6
    share = found["frict_comp.scaling_factor"] / 1000 * 1e-3 * rated
    force = share * (2 * math.pi / per_turn if per_turn else 1.0)
    rows = [
        (found[f"frict_comp.table[{i}].in"], found[f"frict_comp.table[{i}].out"])
        for i in range(count)
    ]
    return mirrored([speed * v for v, _ in rows], [force * F for _, F in rows])


def sinamics_friction(text: str, unit_in_si: float, force_in_si: float) -> Curve:
    """p3820 to p3829 and p3830 to p3839; one unit of speed and of torque in SI at the axis."""
    found = {
        int(number): float(value)
        for number, value in re.findall(r"^p(\d+)\[0\] = (\S+)$", text, re.M)
    }
    assert sorted(found) == [*range(3820, 3840)]
    v = [unit_in_si * found[3820 + i] for i in range(10)]
    return mirrored(v, [force_in_si * found[3830 + i] for i in range(10)])


def objects(text: str) -> dict[tuple[int, int], tuple[float, str]]:
    """Objects of a drive with value and unit, by index and subindex."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    return {
        (int(row["index"], 16), int(row["subindex"], 16)): (float(row["value"]), row["unit"])
        for row in rows
    }


def ax8000_cogging(text: str) -> tuple[Callable[[Array], Array], int]:
    """The torque [N m] that the motor adds at its angle [rad], and how many harmonics it has."""
    found = objects(text)
    count = len(found) // 3
    assert {index for index, _ in found} == {0x32CB}
    assert sorted(sub for _, sub in found) == [*range(7, 7 + 3 * count)]
    triples = [
        (found[0x32CB, 7 + 3 * i][0], found[0x32CB, 8 + 3 * i][0], found[0x32CB, 9 + 3 * i][0])
        for i in range(count)
    ]
    assert all(n == int(n) and 0 < n <= 200 and 0 <= phi < 360 and r > 0 for n, phi, r in triples)

    def torque(angle: Array) -> Array:
        waves = (r * np.cos(n * angle - math.radians(phi)) for n, phi, r in triples)
        return np.asarray(sum(waves, np.zeros(len(angle))))

    return torque, count


def hal_curve(text: str, in_si: float) -> Curve:
    """lincurve of LinuxCNC: straight between its points, held beyond them."""
    (loaded,) = re.findall(r"^loadrt lincurve names=(\S+) personality=(\d+)$", text, re.M)
    name, count = loaded[0], int(loaded[1])
    assert 2 <= count <= 16
    value = dict(re.findall(rf"^setp {re.escape(name)}\.(\S+) (\S+)$", text, re.M))
    x, y = ([float(value[f"{axis}-val-{i:02d}"]) for i in range(count)] for axis in "xy")
    assert len(value) == 2 * count and x == sorted(x)
    return lambda asked: np.interp(asked, [in_si * one for one in x], y)


def machine_data(text: str) -> dict[str, float]:
    """SINUMERIK: `N32450 $MA_BACKLASH[0,AX1]=0.05` a line, `;` a comment, M17 at the end."""
    lines = [line for line in text.splitlines() if not line.startswith(";")]
    assert lines[-1] == "M17"
    pairs = [re.fullmatch(r"N(\d+) (\$MA_\w+)\[0,AX1\]=(\S+)", line) for line in lines[:-1]]
    return {f"{one[1]} {one[2]}": float(one[3]) for one in pairs if one}


def st_constant(text: str) -> float:
    """The one LREAL constant of a declaration in Structured Text."""
    (found,) = re.findall(r"^\s+\w+ : LREAL := (\S+);$", text, re.M)
    return float(found)
