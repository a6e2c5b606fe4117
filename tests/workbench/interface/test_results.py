"""What results are turned into: objects of python-control and arviz."""

import importlib
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import control
import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

import workbench as wb
from design.machine.documents import model_document
from identification.errors import UserError
from identification.estimation.posterior import Posterior
from tests.chain import identified
from workbench.interface.models import IdentifyResult
from workbench.output import dumps


def result(sampled: Posterior | None = None) -> IdentifyResult:
    found = identified()
    return IdentifyResult(
        found.card if hasattr(found, "card") else _card(), replace(found, posterior_samples=sampled)
    )


def _card() -> Any:
    from workbench.cards.card import load_card
    from workbench.logs.sources import card_path

    return load_card(card_path("paper_table1_rich"))


def sampled(draws: int = 30) -> Posterior:
    """Chains whose values say parameter, ensemble and draw: 1000 k + ensemble + draw / 100."""
    names = tuple(identified().fit.free)
    ensemble, draw, k = np.meshgrid(
        np.arange(4), np.arange(draws), np.arange(len(names)), indexing="ij"
    )
    chains = 1000.0 * k + ensemble + draw / 100.0
    ones = dict.fromkeys(names, 1.0)
    way = "the run over the whole of each log"
    return Posterior(
        names, chains, ones, ones, way, 0.3, 32, draws, 32 * draws, True, "converged"
    )  # fmt: skip


@pytest.mark.slow
def test_the_plant_and_the_loop_in_python_control() -> None:
    model = result()
    designed = wb.design(model)
    loop = designed.to_control()
    plant = model.to_control()
    assert isinstance(plant, control.TransferFunction)
    np.testing.assert_allclose(plant.den[0][0], loop.plant.den[0][0], rtol=1e-12)
    assert plant.dt == pytest.approx(designed.design.plant.h)
    poles = control.feedback(loop.plant, loop.feedback).poles()
    assert np.max(np.abs(poles)) < 1.0
    slow = np.exp(1e-4j)
    gain = loop.plant(slow) / (1.0 + loop.plant(slow) * loop.feedback(slow)) * loop.forward(slow)
    assert abs(gain) == pytest.approx(1.0, abs=1e-3)
    laws = [designed.to_control(name).feedback.num[0][0].tolist() for name in ("pid", "rst")]
    assert laws[0] != laws[1] and loop.feedback.num[0][0].tolist() in laws
    assert model.to_control(period=0.02).dt == pytest.approx(0.02)


@pytest.mark.slow
def test_the_posterior_in_arviz_has_a_chain_for_each_ensemble() -> None:
    found = result(sampled()).to_arviz()
    names = identified().fit.free
    assert list(found.posterior.data_vars) == list(names)
    assert dict(found.posterior.sizes) == {"chain": 4, "draw": 30}
    assert found.attrs["verdict"] == "converged"
    for k, name in enumerate(names):
        chains = found.posterior[name].to_numpy()
        expected = 1000.0 * k + np.arange(4)[:, None] + np.arange(30)[None, :] / 100.0
        np.testing.assert_allclose(chains, expected)


def test_without_arviz_the_command_that_installs_it_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun = importlib.import_module

    def without(module: str, package: str | None = None) -> Any:
        if module.split(".")[0] == "arviz":
            raise ModuleNotFoundError(f"No module named {module!r}", name=module)
        return begun(module, package)

    monkeypatch.setattr(importlib, "import_module", without)
    with pytest.raises(UserError, match=r"pip install 'servo-workbench\[arviz\]'"):
        result(sampled()).to_arviz()


def test_nothing_heavy_is_imported_before_it_is_named() -> None:
    said = subprocess.run(
        [sys.executable, "-c", "import sys, workbench\nprint(sorted(sys.modules))\ndir(workbench)"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    for heavy in ("numpy", "pandas", "numba", "scipy", "click", "matplotlib", "identification"):
        assert f"'{heavy}'" not in said, heavy


def test_every_name_of_the_front_is_there() -> None:
    for name in (
        "identify",
        "trace",
        "design",
        "validate",
        "predict",
        "drift",
        "simulate",
        "response",
    ):
        found = getattr(wb, name)
        assert callable(found)
        assert name in dir(wb)
        assert found.__doc__ and len(found.__doc__.splitlines()) > 2
    with pytest.raises(AttributeError, match="no attribute 'idetify'"):
        _ = wb.idetify


@pytest.mark.slow
def test_a_notebook_shows_results_as_html_and_figures_as_pictures(tmp_path: Path) -> None:
    cells = ('import workbench as wb\nmade = wb.simulate("demo")\nmade', CELL, "design.plot()")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(one) for one in cells])
    text = dumps(model_document(identified().model))
    (tmp_path / "model.json").write_text(text, "utf-8")
    NotebookClient(notebook, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [[sorted(out.data) for out in cell.outputs] for cell in notebook.cells]
    pair = ["text/html", "text/plain"]
    assert shown == [[pair], [pair], [["image/png", "text/plain"]]]


CELL = 'design = wb.design("model.json")\ndesign'
