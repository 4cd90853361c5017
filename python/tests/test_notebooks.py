"""The notebooks of docs/notebooks run from their first cell to their last, and draw something."""

import ast
import io
import json

import numpy as np
import pytest
from conftest import ROOT

FOLDER = ROOT / "docs" / "notebooks"
# How many figures each shows.
FIGURES = {"recording": 3, "scene": 3, "calibration": 1, "first-hour": 2}


def shown_by(notebook):
    """Runs all cells in one namespace, and returns what their last lines show."""
    namespace, shown = {"__name__": "__main__"}, []
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    for k, cell in enumerate(cells):
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == [], "a notebook is kept without its outputs"
        body = ast.parse("".join(cell["source"])).body
        last = body.pop() if isinstance(body[-1], ast.Expr) else None
        place = f"{notebook.name}, cell {k}"
        exec(compile(ast.Module(body, []), place, "exec"), namespace)
        if last is not None:
            shown.append(eval(compile(ast.Expression(last.value), place, "eval"), namespace))
    return namespace, shown


def ink(figure):
    """The share of a picture's points that are not white."""
    from matplotlib import image
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=60)
    picture.seek(0)
    return float(np.mean(np.any(image.imread(picture)[:, :, :3] < 0.99, axis=2)))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(FIGURES))
def test_a_notebook_runs_and_draws(name, program, monkeypatch):
    from matplotlib.figure import Figure
    monkeypatch.chdir(FOLDER)
    namespace, shown = shown_by(FOLDER / f"{name}.ipynb")
    figures = [one for one in shown if isinstance(one, Figure)]
    assert len(figures) == FIGURES[name]
    for figure in figures:
        assert 0.01 < ink(figure) < 0.5
        assert all(axes.has_data() for axes in figure.axes)
    if name == "scene":
        for one in namespace["found"]:  # nothing is better than its bound, but by chance
            assert one["distance_mm"] > 0.6 * one["bound_mm"]
            assert one["distance_mm"] < 1.6 * one["bound_mm"]
    if name == "first-hour":
        assert len(namespace["good"]) == 80
        assert abs(float(np.mean(namespace["good"]["velocity_mps"])) - 3) < 0.01
    if name == "calibration":
        assert abs(float(namespace["late_ps"].mean())) < 100
        assert np.all(namespace["calibrated"]["valid"][1:-1])


def test_all_notebooks_are_tried():
    assert {file.stem for file in FOLDER.glob("*.ipynb")} == set(FIGURES)
