"""The notebook of the tour runs from start to end, and is kept with its outputs."""

import nbformat
import pytest
from nbclient import NotebookClient
from nbformat import NotebookNode
from support.paths import ROOT

pytestmark = pytest.mark.long

TOUR = ROOT / "docs" / "tour.ipynb"
MOST_BYTES = 300_000


def list_outputs(notebook: NotebookNode) -> list[NotebookNode]:
    return [o for cell in notebook.cells if cell.cell_type == "code" for o in cell.outputs]


@pytest.mark.filterwarnings("ignore")
def test_the_tour_runs_and_names_what_it_conceals() -> None:
    notebook = nbformat.read(TOUR, as_version=4)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": ROOT}}).execute()
    text = str(list_outputs(notebook))
    assert "cart_coulomb_friction" in text and "<strong>named</strong>" in text
    assert text.count("image/png") == 2


def test_the_tour_is_kept_with_its_outputs_and_small() -> None:
    assert TOUR.stat().st_size < MOST_BYTES
    notebook = nbformat.read(TOUR, as_version=4)
    assert all(cell.outputs for cell in notebook.cells if cell.cell_type == "code")
    assert not any(
        o.output_type in ("error", "stream") and o.get("name") == "stderr"
        for o in list_outputs(notebook)
    )
