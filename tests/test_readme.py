"""The README's promises that a machine can check."""

import re
from pathlib import Path

import jax
import pytest

from adwa_jax import Outcome, Status, drive, paper, plan
from scenarios.suite import make_suite
from tests.test_tuning.jobs import CANDIDATES, SCENARIOS, in_small_pieces, written
from tuning.run_job import run_job
from tuning.weights_file import load_weights

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()


PYTHON = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


@pytest.mark.parametrize("example", PYTHON[:2], ids=["first screen", "many weights"])
def test_the_python_examples_run_and_print_outcomes(example, capsys):
    exec(compile(example, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert printed.count("'REACHED': ") == 2


def test_the_example_with_a_finished_job_runs(tmp_path, monkeypatch, capsys):
    in_small_pieces(monkeypatch.setattr)
    monkeypatch.chdir(tmp_path)
    run_job(written(tmp_path), tmp_path / "out" / "demo" / "job_0", quiet=True)
    (example,) = PYTHON[2:]
    found = {}
    exec(compile(example, "README.md", "exec"), found)
    assert list(found["front"].columns[:2]) == ["clearance", "velocity"]
    assert len(found["episodes"]) == CANDIDATES * SCENARIOS
    assert (tmp_path / "front.png").exists()
    assert capsys.readouterr().out.splitlines()[1].startswith("s [")


def test_the_first_example_is_short():
    assert len(PYTHON[0].strip().splitlines()) <= 10


def test_the_weights_example_is_the_paper_presets_constants(tmp_path):
    (example,) = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)
    (tmp_path / "weights.toml").write_text(example)
    assert load_weights(tmp_path / "weights.toml", paper()) == paper()


def test_kernels_run_as_they_stand_under_jit():
    scenario = make_suite("paper-15", 0, 1).scenarios[0]
    constants, options = paper()
    planned = jax.jit(plan)(scenario.grid, scenario.start[:2], scenario.goal, constants, options.plan)
    episode = jax.jit(drive)(scenario, planned, constants, options)
    assert int(planned.search.status) == Status.FOUND
    assert int(episode.outcome) in list(Outcome)


def test_every_name_and_file_of_the_notation_table_exists():
    rows = re.findall(r"^\|.*\| `(adwa_jax/\w+\.py)` \|$", README, re.MULTILINE)
    assert len(rows) > 10
    table = README[README.index("## From the paper to the code") : README.index("Kernels are unbatched")]
    for line in table.splitlines():
        file = re.search(r"`(adwa_jax/\w+\.py)`", line)
        if not file:
            continue
        source = (ROOT / file[1]).read_text()
        for name in re.findall(r"`(\w+)`", line.rsplit("|", 2)[0]):
            assert re.search(rf"\b{name}\b", source), f"{name} is not in {file[1]}"


def test_pictures_and_make_targets_exist():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:^|`)make (\w+)", README, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
    for picture in re.findall(r"!\[.*?\]\((.*?)\)", README):
        assert (ROOT / picture).is_file(), picture
