"""The notebooks run from top to bottom, and were committed without output."""

import json
from pathlib import Path

import matplotlib as mpl
import pytest

NOTEBOOKS = sorted((Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))


@pytest.fixture(params=NOTEBOOKS, ids=lambda file: file.stem)
def cells(request):
    return json.loads(request.param.read_text(encoding="utf-8"))["cells"]


def test_there_are_notebooks():
    assert NOTEBOOKS


def test_a_notebook_runs(cells):
    names = {}
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    code = ["".join(c["source"]) for c in cells if c["cell_type"] == "code"]
    assert code
    for source in code:
        exec(source, names)
    assert plt.get_fignums()
    plt.close("all")


def test_a_notebook_is_committed_without_output(cells):
    for cell in cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
