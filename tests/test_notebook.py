"""The notebook runs from its first cell to its last, and is committed without its outputs."""

import json
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).resolve().parent.parent / "examples/quickstart.ipynb"


def test_it_is_kept_without_outputs_and_installs_only_where_it_must():
    cells = [cell for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in cells)
    first = "".join(cells[0]["source"])
    assert first.index('find_spec("mjx_hand") is None') < first.index("%pip install --quiet mjx-hand")
    assert not any("pip install" in "".join(cell["source"]) for cell in cells[1:])


@pytest.mark.slow
# The kernel's own start: ports, event loops and the debugger.
@pytest.mark.filterwarnings("default::DeprecationWarning", "default::RuntimeWarning", "default::ResourceWarning")
def test_it_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    # A failing cell raises, with its traceback.
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    text = "".join(output.get("text", "") for output in outputs)
    assert len(pictures) == 2
    assert "16 links, 20 hinges" in text
    assert text.count("degrees, finger tips") == 2
    assert (tmp_path / "my_hand/right_hand.urdf").is_file()
