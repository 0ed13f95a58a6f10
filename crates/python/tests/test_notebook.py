"""The notebook goes from a mesh to a chart."""

from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[1] / "examples" / "mesh_to_chart.ipynb"


def test_the_notebook_runs_to_its_chart(tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    charts = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(charts) == 2
    lines = [output["data"]["text/plain"] for output in outputs if "text/plain" in output.get("data", {})]
    assert any(line.startswith("<radwalk.Result of 'room'") for line in lines)
    assert any(" paths, " in line and "/s, " in line for line in lines), "the line of progress"
