"""Every notebook asks a question, is stored without outputs, and runs from top to bottom, making pictures."""

import os
from itertools import pairwise
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
PICTURES = {"01_pipeline": 8, "02_astar": 8, "03_dynamic_obstacles": 5, "04_pareto": 6, "05_gradients": 6,
            "06_your_own_map": 7}  # at least; others: 1  # fmt: skip
SECONDS = 600  # a cell's, where nothing is compiled yet and the machine is busy

each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """For the process of the notebook: few scenarios, this checkout's packages, no settings of the user's."""
    monkeypatch.setenv("QUICK", "1")
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    paths = [str(FOLDER.parent), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))


def executed(notebook, name, seconds=SECONDS):
    """The notebook with its outputs; a cell that fails, takes longer or kills its kernel, fails the test under the
    notebook's and its own name.
    """
    resources, begun = {"metadata": {"path": str(FOLDER)}}, []
    client = NotebookClient(notebook, timeout=seconds, kernel_name="python3", resources=resources,
                            on_cell_execute=lambda cell, cell_index: begun.append((cell_index + 1, cell.id)))
    failure = None
    try:
        client.execute()
    except CellExecutionError as error:
        failure = f"{error.ename}: {error.evalue}"
    except CellTimeoutError:
        failure = f"did not end within {seconds} s"
    except DeadKernelError:
        failure = "its kernel died"
    if failure is not None:
        number, cell = begun[-1]
        pytest.fail(f"{name}, cell {number} ({cell}): {failure}")
    return notebook


def outputs_of(cell):
    return cell.get("outputs", [])


def pictures_in(notebook):
    return [made for cell in notebook.cells for made in outputs_of(cell)
            if {"image/png", "image/gif"} & set(made.get("data", {}))]  # fmt: skip


def test_there_are_notebooks():
    assert set(PICTURES) <= {path.stem for path in NOTEBOOKS}


@each_notebook
def test_a_notebook_is_valid_and_stored_without_outputs(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert notebook.metadata.kernelspec.name == "python3"
    assert len({cell.id for cell in notebook.cells}) == len(notebook.cells)
    for cell in notebook.cells:
        assert not outputs_of(cell), cell.id
        assert cell.get("execution_count") is None, cell.id


@each_notebook
def test_a_notebook_begins_with_a_question_and_has_text_before_code(path):
    cells = nbformat.read(path, as_version=4).cells
    title, question, *_ = [line for line in cells[0].source.splitlines() if line]
    assert title.startswith("# ")
    assert question.startswith("**")
    assert "?" in cells[0].source
    for before, cell in pairwise(cells):
        assert "markdown" in (before.cell_type, cell.cell_type), cell.id


@each_notebook
def test_a_notebook_runs_and_makes_pictures(path):
    notebook = executed(nbformat.read(path, as_version=4), path.stem)
    assert len(pictures_in(notebook)) >= PICTURES.get(path.stem, 1)
    for cell in notebook.cells:
        for made in outputs_of(cell):
            assert made.get("name") != "stderr", f"{path.stem}, cell {cell.id}: {made.text}"


@pytest.mark.parametrize(("source", "seconds", "failure"), [
    ("1 / 0", 60, "ZeroDivisionError"),
    ("import time; time.sleep(60)", 5, "did not end within 5 s"),
    ("import os; os._exit(1)", 60, "its kernel died"),
])  # fmt: skip
def test_a_cell_that_fails_names_its_notebook_and_itself(source, seconds, failure):
    cells = [nbformat.v4.new_markdown_cell("Why?", id="text"), nbformat.v4.new_code_cell("1", id="before"),
             nbformat.v4.new_code_cell(source, id="culprit"), nbformat.v4.new_code_cell("1", id="after")]  # fmt: skip
    with pytest.raises(pytest.fail.Exception, match=rf"^some_name, cell 3 \(culprit\): {failure}"):
        executed(nbformat.v4.new_notebook(cells=cells), "some_name", seconds)
