import sys
import tomllib
from types import SimpleNamespace

import pytest

from adwa_jax.presets import PRESETS
from tests.test_tuning.findings_by_hand import findings
from tuning.choice import ChoiceSettings
from tuning.demo import run_demo
from tuning.objectives import DEFAULT_OBJECTIVES
from tuning.space import Parameter, Space


@pytest.fixture
def ran(monkeypatch):
    """Calls of the runner, which finds what was written by hand."""
    calls = []

    def run_job(job_path, folder, quiet):
        calls.append((job_path, folder, quiet))
        return findings()

    monkeypatch.setitem(sys.modules, "tuning.run_job", SimpleNamespace(run_job=run_job))
    return calls


def test_the_demo_runs_a_job_on_training_maps_that_are_not_held_out(tmp_path, ran):
    run_demo(tmp_path / "demo", seed=3, quiet=True)
    ((file, folder, quiet),) = ran
    job = tomllib.loads(file.read_text())
    (training,), (held_out,) = job["training"]["suites"], job["held_out"]["suites"]
    assert training["suite"] == held_out["suite"] == "paper-20"
    assert training["seed"] != held_out["seed"]
    assert job["seed"] == 3
    assert folder == tmp_path / "demo" / "job"
    assert quiet


def test_what_the_demo_tunes_can_be_tuned_and_its_choice_names_the_objectives(tmp_path, ran):
    run_demo(tmp_path, quiet=True)
    job = tomllib.loads(ran[0][0].read_text())
    base = PRESETS[job["planner"]["preset"]]()
    space = Space(tuple(Parameter(name, **table) for name, table in job["parameters"].items()), base)
    for parameter, value in zip(space.parameters, space.default, strict=True):
        assert parameter.low <= value <= parameter.high
    choice = ChoiceSettings(**job["choice"])
    assert set(choice.weights) == {statistic.label for statistic in DEFAULT_OBJECTIVES}


def test_the_demo_ends_with_constants_success_before_and_after_and_the_report(tmp_path, ran, capsys):
    run_demo(tmp_path)
    printed = capsys.readouterr().out
    assert "clearance = 0.3125 (0.1)" in printed
    assert "success on 40 training scenarios: 95.0 % [" in printed
    assert printed.count(" before, ") == printed.count(" after\n") == 2
    assert "better? In part:" in printed
    assert printed.splitlines()[-1] == f"report: {tmp_path / 'job' / 'report.html'}"


def test_a_quiet_demo_prints_nothing(tmp_path, ran, capsys):
    run_demo(tmp_path, quiet=True)
    assert capsys.readouterr().out == ""
