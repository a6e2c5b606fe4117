"""design.json's difference equation, programmed from the file alone, is what was simulated."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from design.closed_loop.driven_loop import driven_loop, run_driven
from design.machine.design import Design
from design.machine.documents import design_document
from design.machine.model import Model
from identification.arrays import Array
from identification.model.plant import Actuator
from tests.chain import EMPS, TABLES, designed, model_of
from workbench.output import dumps

Step = Callable[[float], float]


@cache
def motor() -> tuple[Model, Design]:
    model = model_of(EMPS, k_a=35.15)
    model = replace(model, rig=replace(model.rig, command_unit="A", control_limit=4.0))
    return model, designed(model, period=2e-3)


@cache
def cylinder() -> tuple[Model, Design]:
    model = model_of(TABLES["paper_table2"], Actuator(19530.0, 10405.0))
    model = replace(model, rig=replace(model.rig, control_limit=0.4))
    return model, designed(model)


def filtered(b: list[float], a: list[float], first: float) -> Step:
    """A filter that has stood at its input `first` for ever."""
    x, y = [first] * len(b), [first * sum(b) / sum(a)] * len(a)

    def step(value: float) -> float:
        x[:] = [value, *x[:-1]]
        y[:] = [0.0, *y[:-1]]
        y[0] = sum(c * v for c, v in zip(b, x, strict=True))
        y[0] -= sum(c * v for c, v in zip(a[1:], y[1:], strict=True))
        return y[0]

    return step


def compensated(document: dict[str, Any], y_0: float) -> Callable[[float, float, float], float]:
    """F_comp as the file's filters, nine parameters, N_c and e_T say: paper, eqs. (3)-(5)."""
    c = document["compensator"]
    p = {name: one["value"] for name, one in c["friction"].items()}
    N_c, e_T, of = c["N_c"]["value"], c["e_T"]["value"], c["filters"]
    A = filtered(of["A"]["b"], of["A"]["a"], y_0)
    B = filtered(of["B"]["b"], of["B"]["a"], y_0)
    C = filtered(of["C"]["b"], of["C"]["a"], 0.0)
    slope = filtered(of["slope"], [1.0], y_0)

    if c["excess"]:
        p |= {"F_sp": max(p["F_sp"] - p["F_cp"], 0.0), "F_sn": min(p["F_sn"] + p["F_cn"], 0.0)}

    def force(r: float, y: float, F: float) -> float:
        v, e_y = slope(A(y)), r - B(y)
        if c["excess"] and not p["dv_n"] / N_c <= v <= p["dv_p"] / N_c:
            raw = 0.0
        elif v >= p["dv_p"]:
            raw = p["F_cp"]
        elif v <= p["dv_n"]:
            raw = -p["F_cn"]
        elif p["dv_n"] / N_c <= v <= p["dv_p"] / N_c:
            raw = min(abs(e_y) / e_T, 1.0) * (p["F_sp"] if e_y >= 0 else p["F_sn"])
        else:
            raw = min(max(F, p["F_sn"]), p["F_sp"])
        return C(raw)

    return force


def programmed(
    document: dict[str, Any], name: str, r: Array, y: Array, F: Array, *, compensator: bool
) -> Array:
    """The commands of a drive that runs the controller `name` of the file, (n,).

    Before the first sample the machine stood at r[0].
    """
    one, force = document[name], document["force"]
    law = one["law"]
    base = force["h"]["value"] if force else law["h"]["value"]
    ratio = round(law["h"]["value"] / base)
    limit = (force or law)["limit"]["value"]
    friction = compensated(document, r[0]) if compensator else lambda *_: 0.0
    R, S, T, W = (law[key] for key in "RSTW")
    past = {key: [at] * 8 for key, at in (("r", r[0]), ("y", r[0]), ("c", 0.0), ("free", 0.0))}
    moved, total, u, out = r[0], 0.0, 0.0, []
    k_a = (document["command"]["force_per_command"] or {"value": None})["value"]
    rate = one["reference_rate"]["value"] or np.inf
    for k in range(len(r)):
        moved += min(max(r[k] - moved, -rate * base), rate * base)
        acts = k % ratio == 0
        if acts:
            past["r"].insert(0, moved)
            past["y"].insert(0, y[k])
            c_free = sum(t * v for t, v in zip(T, past["r"], strict=False))
            c_free -= sum(v * w for v, w in zip(R, past["y"], strict=False))
            pairs = zip(S[1:], W[1:], past["c"], past["free"], strict=False)
            c_free += sum((w - s) * c - w * free for s, w, c, free in pairs)
            F_comp = friction(moved, y[k], F[k] if force else k_a * u)
        if force is None:
            part = F_comp / k_a
            u = min(max(c_free + part, -limit), limit)
            c = u - part
        else:
            k_i, T_i = force["k_i"]["value"], force["T_i"]["value"]
            e = c_free + F_comp - F[k]
            free, before = k_i * e + total, total
            u = min(max(free, -limit), limit)
            total += 0.0 if (free - u) * e > 0.0 else k_i * base / T_i * e
            c = c_free if free == u else F[k] + (u - before) / k_i - F_comp
        if acts:
            past["c"].insert(0, c)
            past["free"].insert(0, c_free)
        out.append(u)
    return np.array(out)


@pytest.mark.slow
@pytest.mark.parametrize("compensator", [False, True])
@pytest.mark.parametrize("name", ["rst", "pid"])
@pytest.mark.parametrize("machine", [motor, cylinder])
def test_the_file_alone_gives_the_simulated_commands(
    machine: Callable[[], tuple[Model, Design]], name: str, compensator: bool
) -> None:
    model, found = machine()
    with_it = found.compensator.value if compensator else None
    one = replace(found.controllers[name], rate=1.0)
    found = replace(found, rst=one) if name == "rst" else replace(found, pid=one)
    loop = driven_loop(model, found, one, with_it)
    steps = np.repeat([0.01, 0.06, -0.03], round(0.4 / loop.h))
    run = run_driven(model, loop, steps, np.random.default_rng(1))
    limit = loop.limit or np.inf
    assert np.mean(np.abs(run.u) >= limit) > 0.01  # the limit has its part in it
    document = json.loads(dumps(design_document(found)))
    own = programmed(document, name, steps, run.y_measured, run.F_measured, compensator=compensator)
    assert np.max(np.abs(own - run.u)) < 1e-6 * limit


@pytest.mark.slow
def test_command_unit_limit_and_gain_stand_in_the_file() -> None:
    document = json.loads(dumps(design_document(motor()[1])))
    assert document["command"]["unit"] == "A"
    assert document["command"]["limit"]["value"] == 4.0
    assert document["command"]["force_per_command"]["unit"] == "N/A"
    law = document["rst"]["law"]
    assert (law["output"], law["unit"], law["input"]) == ("command", "A", "m")
    assert law["R"] == [value / 35.15 for value in document["rst"]["R"]]
    assert any("within +- 4 A" in line for line in law["equation"])
    force = json.loads(dumps(design_document(cylinder()[1])))
    assert force["rst"]["law"]["unit"] == "N" and force["rst"]["law"]["limit"] is None
    assert force["force"]["limit"] == {
        "value": 0.4, "unit": "V", "sd": None, "low": None, "high": None
    }  # fmt: skip
