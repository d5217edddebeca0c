"""Jobs end in the same bytes, whatever ends them on the way, and do nothing twice."""

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.suite import make_suite
from tests.test_tuning.jobs import CANDIDATES, JOB, SCENARIOS, in_small_pieces, pairs_driven, results_of, written
from tuning import racing, tiled_judge
from tuning.dataset import front_dataset, open_evaluations
from tuning.evaluate import evaluate
from tuning.job_folder import events_of, locked
from tuning.plans_only import PLANNED
from tuning.run_job import open_job, read_setup, report_job, resume_job, run_job
from tuning.store import FIGURES, as_evaluations, read_store
from tuning.weights_file import load_weights

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return written(tmp_path_factory.mktemp("job"))


@pytest.fixture(scope="module")
def whole(file, tmp_path_factory):
    """The folder of a job that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    with pytest.MonkeyPatch.context() as patch:
        in_small_pieces(patch.setattr)
        run_job(file, folder, quiet=True)
    return folder


@pytest.fixture(autouse=True)
def _small_pieces(monkeypatch):
    in_small_pieces(monkeypatch.setattr)


class StopAfter:
    """Ends the work, by an error of one's choice, in the place of the nth call of the engine."""

    def __init__(self, count, error):
        self.left, self.error, self.judge = count, error, tiled_judge.judge_pairs

    def __call__(self, *arguments, **settings):
        self.left -= 1
        if self.left < 0:
            raise self.error
        return self.judge(*arguments, **settings)


def test_all_that_the_budget_pays_for_is_judged(whole):
    training = as_evaluations(whole / "training.zarr")
    assert training.done.shape == (CANDIDATES, SCENARIOS)
    assert training.done.all()
    assert training.generation.tolist() == [0] + [1] * 4 + [2] * 4
    driven = pairs_driven(events_of(whole))
    assert len(driven) == len(set(driven))
    assert sum(suite == "training" for suite, _, _ in driven) == CANDIDATES * SCENARIOS


def test_where_plans_are_all_that_matters_nothing_is_driven(tmp_path):
    other = "[parameters.sparse_base]\nlow = 1.0\nhigh = 3.0"
    text = JOB.replace("[parameters.clearance]\nlow = 0.02\nhigh = 0.5", other)
    goals = '[[objectives]]\nmeasure = "expansions"\ndirection = "min"\n'
    file = written(tmp_path, text.replace("[parameters.velocity]", f"{goals}[parameters.sparse_gain]"))
    findings = run_job(file, tmp_path / "out", quiet=True)
    training = as_evaluations(tmp_path / "out" / "training.zarr")
    assert training.done.all()
    assert set(training.columns) == {*PLANNED, "outcome"}
    best = findings.front[0].training.objectives[0].value
    assert best == training.columns["expansions"].mean(axis=1).min() < findings.default.training.objectives[0].value
    assert "length" not in open_evaluations(tmp_path / "out")


def test_the_recommended_constants_are_a_file_of_weights(whole):
    from adwa_jax.presets import paper
    from tuning.space import constant

    loaded = load_weights(whole / "recommended.toml", paper())
    rows = as_evaluations(whole / "training.zarr").values
    found = [constant(loaded, "clearance"), constant(loaded, "velocity")]
    assert np.isclose(rows, found, rtol=1e-6).all(axis=1).any()
    assert "controller_server" in (whole / "recommended_nav2.yaml").read_text()


def test_the_dataset_has_dimensions_units_and_a_table(whole):
    dataset = open_evaluations(whole)
    assert dict(dataset["length"].sizes) == {"candidate": CANDIDATES, "scenario": SCENARIOS}
    assert (dataset["length"].units, dataset["jerk"].units) == ("m", "m/s³")
    assert dataset["outcome"].dtype == np.int32
    assert dataset["clearance"].dims == ("candidate",)
    assert dataset["clearance"].units == "1"  # a weight
    described = {**dataset.variables}
    assert all(variable.attrs["long_name"] for variable in described.values())
    assert {name for name, variable in described.items() if "units" not in variable.attrs} == {"candidate", "scenario"}
    assert dataset.attrs == {"title": f"{whole.name}: training", "missing": "not driven"}
    assert dict(open_evaluations(whole, "held_out").sizes)["scenario"] == 3


def test_a_candidate_has_the_same_number_and_constants_in_both_parts(whole):
    training, held_out = open_evaluations(whole), open_evaluations(whole, "held_out")
    job = open_job(whole)
    assert held_out["candidate"].values.tolist() == job.held_out_rows.tolist()
    same = training.sel(candidate=held_out["candidate"])
    for name in ("clearance", "velocity", "generation"):
        assert same[name].values.tolist() == held_out[name].values.tolist()


def test_the_front_opens_as_a_dataset_with_intervals_and_the_default_first(whole):
    findings = open_job(whole).findings
    dataset = front_dataset(findings)
    assert dataset["member"].values.tolist() == list(range(len(findings.front) + 1))
    assert dataset.attrs["recommended_member"] == findings.choices[findings.recommended].member + 1
    frame = dataset.to_dataframe()
    for number, member in enumerate((findings.default, *findings.front)):
        assert frame.loc[number, ["clearance", "velocity"]].tolist() == member.values.tolist()
        index = [statistic.label for statistic in findings.goals.objectives].index("length_ratio")
        for suite, judged in (("training", member.training), ("held_out", member.held_out)):
            ends = frame.loc[number, [f"length_ratio_{suite}{end}" for end in ("", "_low", "_high")]].tolist()
            expected = [np.nan] * 3 if judged is None else list(judged.objectives[index])
            np.testing.assert_array_equal(ends, expected)


def test_a_job_has_no_other_parts_than_two(tmp_path):
    with pytest.raises(InputError, match=r"suite: 'heldout'; a job has the parts training and held_out; name one"):
        open_evaluations(tmp_path, "heldout")


def test_the_table_has_a_row_an_episode_under_its_candidate_and_scenario(whole):
    frame = open_evaluations(whole).to_dataframe()
    assert frame.index.names == ["candidate", "scenario"]
    assert len(frame) == CANDIDATES * SCENARIOS
    assert {*FIGURES, "success", "done", "generation", "clearance", "velocity"} == set(frame.columns)
    found, (_, name, *_) = read_store(whole / "training.zarr")
    episode = frame.loc[(3, name)]
    assert episode["time"] == found.columns["time"][3, 1]
    assert episode["velocity"] == found.values[3, 1]
    means = frame.groupby("candidate")["length"].mean()
    np.testing.assert_allclose(means, found.columns["length"].mean(axis=1), rtol=1e-5)


class TestOpened:
    def test_it_holds_what_the_report_was_made_of_and_writes_nothing(self, whole):
        before = results_of(whole)
        job = open_job(whole)
        assert results_of(whole) == before
        reported = report_job(whole, quiet=True)
        assert [member.row for member in job.findings.front] == [member.row for member in reported.front]
        assert job.findings.compared == reported.compared
        assert job.setup.held_out.names == make_suite("paper-15", 2, 3).names

    def test_a_members_held_out_results_are_those_of_driving_it(self, whole):
        job = open_job(whole)
        for number in (0, 1):
            driven, kept = evaluate(job.setup.held_out, job.preset(number)), job.held_out_results(number)
            np.testing.assert_array_equal(kept.outcome, driven.outcome)
            np.testing.assert_array_equal(kept.measures["time"], driven.measures["time"])

    def test_numbers_are_those_of_the_tables(self, whole):
        job = open_job(whole)
        last = len(job.findings.front)
        assert job.member(0) is job.findings.default
        assert job.member(last) is job.findings.front[-1]
        chosen = job.choosing(last)
        assert chosen.choices[chosen.recommended].member == last - 1
        with pytest.raises(InputError, match=rf"^member: {last + 1}; must be from 1 to {last}, or 0 for the default; "):
            job.preset(last + 1)
        with pytest.raises(InputError, match=r"^member: 0; .*; choose a member of the front, from 1$"):
            job.choosing(0)

    def test_what_was_not_driven_is_told(self, whole):
        job = open_job(whole)
        with pytest.raises(InputError, match=r"^member: 1; was not driven on the held-out scenarios; "):
            replace(job, held_out=None).held_out_results(1)

    def test_a_folder_without_a_job_is_refused(self, tmp_path):
        with pytest.raises(InputError, match="no job"):
            open_job(tmp_path)


def test_another_run_ends_in_the_same_bytes_and_a_finished_one_stays_as_it_is(whole, file, tmp_path):
    before = results_of(whole)
    resume_job(whole, quiet=True)
    report_job(whole, quiet=True)
    assert results_of(whole) == before
    driven = pairs_driven(events_of(whole))
    assert len(driven) == len(set(driven))


@pytest.mark.parametrize("blocks", [0, 6])
def test_an_interrupted_job_goes_on_to_the_same_bytes(whole, file, tmp_path, monkeypatch, blocks):
    with monkeypatch.context() as patch:
        patch.setattr(tiled_judge, "judge_pairs", StopAfter(blocks, KeyboardInterrupt()))
        with pytest.raises(KeyboardInterrupt):
            run_job(file, tmp_path / "out", quiet=True)
    resume_job(tmp_path / "out", quiet=True)
    assert results_of(tmp_path / "out") == results_of(whole)
    driven = pairs_driven(events_of(tmp_path / "out"))
    assert len(driven) == len(set(driven))


def test_a_damaged_tile_is_driven_again_and_no_other(whole, file, tmp_path):
    folder = tmp_path / "out"
    shutil.copytree(whole, folder)
    chunk = folder / "training.zarr" / "figures" / "c" / "2" / "1" / "0"
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 0xFF
    chunk.write_bytes(content)
    (folder / "training.zarr" / "figures" / "c" / "4" / "0" / "0").write_bytes(b"")
    before = len(pairs_driven(events_of(folder)))
    resume_job(folder, quiet=True)
    again = pairs_driven(events_of(folder))[before:]
    assert sorted(again) == [("training", row, scenario) for row, scenario in ((2, 2), (2, 3), (4, 0), (4, 1))]
    assert results_of(folder) == results_of(whole)


def test_a_race_judges_on_fewer_scenarios_and_goes_on_to_the_same_bytes(tmp_path, monkeypatch):
    def first_is_out(goals, columns, candidates):
        return np.arange(candidates) == 0

    monkeypatch.setattr(racing, "clearly_out", first_is_out)
    file = written(tmp_path, JOB.replace("population = 4", "population = 4\nracing = true"))
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run_job(file, whole, quiet=True)
    with monkeypatch.context() as patch:
        patch.setattr(tiled_judge, "judge_pairs", StopAfter(7, KeyboardInterrupt()))
        with pytest.raises(KeyboardInterrupt):
            run_job(file, parts, quiet=True)
    resume_job(parts, quiet=True)
    assert results_of(parts) == results_of(whole)
    done = as_evaluations(whole / "training.zarr").done
    assert done.sum(axis=1).tolist() == [5, 2, 4, 5, 5, 2, 4, 5, 5, 2, 2]  # in the end single ones, for what is left
    (searched,) = [event for event in events_of(whole) if event["event"] == "searched"]
    assert 45 - SCENARIOS < done.sum() == searched["driven"] <= 45


class TestRefusals:
    def test_a_second_process_is_refused_by_name(self, whole):
        with locked(whole), pytest.raises(InputError, match=rf"process {os.getpid()} works on it; .*; wait"):
            resume_job(whole, quiet=True)

    def test_a_folder_that_holds_something_is_refused(self, whole, file, tmp_path):
        with pytest.raises(InputError, match=r"^--out: .* holds a job already; .* adwa tune resume "):
            run_job(file, whole, quiet=True)
        (tmp_path / "mine.txt").write_text("x")
        with pytest.raises(InputError, match=r"is not empty; "):
            run_job(file, tmp_path, quiet=True)

    def test_what_the_method_cannot_do_is_refused_before_it_runs(self, tmp_path):
        text = JOB.replace("clearance", "v_samples").replace("low = 0.02\nhigh = 0.5", "low = 5\nhigh = 9")
        text = text.replace('"log"', '"integer"').replace('"nsga3"', '"gradient"').replace("population = 4", "")
        text = text.replace("[parameters.velocity]\nlow = 0.2\nhigh = 1.5\n", "")
        file = written(tmp_path, text)
        with pytest.raises(InputError, match=r"job\.toml: method\.name: 'gradient'; integer parameters have no grad"):
            read_setup(file, tmp_path, quiet=True)

    def test_a_folder_without_a_job_cannot_go_on(self, tmp_path):
        with pytest.raises(InputError, match="no job; must be the folder of a job that has begun"):
            resume_job(tmp_path, quiet=True)

    def test_a_full_disk_is_one_line_and_nothing_is_lost(self, whole, file, tmp_path, monkeypatch):
        with monkeypatch.context() as patch:
            patch.setattr(tiled_judge, "judge_pairs", StopAfter(4, OSError(28, "No space left on device")))
            with pytest.raises(InputError, match=r"^[^\n]*No space left on device; .*adwa tune resume [^\n]*$"):
                run_job(file, tmp_path / "out", quiet=True)
        resume_job(tmp_path / "out", quiet=True)
        assert results_of(tmp_path / "out") == results_of(whole)
        driven = pairs_driven(events_of(tmp_path / "out"))
        assert len(driven) == len(set(driven))

    def test_weights_that_changed_are_told(self, tmp_path, monkeypatch):
        start = tmp_path / "start.toml"
        start.write_text("local_heading = 0.8\nclearance = 0.3\nvelocity = 0.8\nglobal_heading = 0.1\n")
        file = written(tmp_path, JOB.replace('preset = "paper"', 'preset = "paper"\nweights = "start.toml"'))
        with monkeypatch.context() as patch:
            patch.setattr(tiled_judge, "judge_pairs", StopAfter(0, KeyboardInterrupt()))
            with pytest.raises(KeyboardInterrupt):
                run_job(file, tmp_path / "out", quiet=True)
        start.write_text(start.read_text().replace("0.3", "0.4"))
        with pytest.raises(InputError, match=r"out: planner; not what the job began with; .*; restore the file"):
            resume_job(tmp_path / "out", quiet=True)


def started(*arguments):
    """The command in a process of its own."""
    code = ("import signal; signal.signal(signal.SIGINT, signal.default_int_handler); import runpy; "
            "runpy.run_module('tests.test_tuning.jobs', run_name='__main__')")  # fmt: skip
    return subprocess.Popen([sys.executable, "-c", code, "tune", *map(str, arguments), "-q"], cwd=ROOT,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip


def until_blocks(folder, count, process):
    """Wait until so many blocks are driven in all, or the process has ended."""
    while process.poll() is None and sum(event["event"] == "block" for event in events_of(folder)) < count:
        time.sleep(0.01)


def test_killed_and_told_to_stop_it_goes_on_to_the_same_bytes_and_does_nothing_twice(whole, file, tmp_path):
    folder = tmp_path / "out"
    process = started("run", file, "--out", folder)
    until_blocks(folder, 2, process)
    process.kill()
    process.communicate()
    for count, sent in ((5, signal.SIGINT), (9, signal.SIGTERM)):
        process = started("resume", folder)
        until_blocks(folder, count, process)
        process.send_signal(sent)
        out, err = process.communicate(timeout=60)
        assert (process.returncode, out) == (130, "")
        assert err == f"adwa: stopped; what is done is kept; go on with: adwa tune resume {folder}\n"
    resume_job(folder, quiet=True)
    assert results_of(folder) == results_of(whole)
    driven = pairs_driven(events_of(folder))
    assert len(driven) == len(set(driven))


def test_a_job_file_that_was_edited_since_is_not_gone_on_with(whole, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(whole, folder)
    text = (folder / "job.toml").read_text()
    (folder / "job.toml").write_text(text.replace("high = 1.5", "high = 1.4"))
    for again in (resume_job, report_job):
        with pytest.raises(InputError, match="job; not what the job began with"):
            again(folder, quiet=True)


@pytest.mark.parametrize("content", ["{}", "[]", "not JSON"])
def test_a_damaged_environment_is_one_line(whole, tmp_path, content):
    folder = tmp_path / "copy"
    shutil.copytree(whole, folder)
    (folder / "environment.json").write_text(content)
    with pytest.raises(InputError, match=r"environment\.json: damaged or missing \(.*\); .*; restore it, or"):
        resume_job(folder, quiet=True)


def test_a_job_without_its_file_is_not_taken_for_none(whole, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(whole, folder)
    (folder / "job.toml").unlink()
    with pytest.raises(InputError, match=r"job\.toml is missing; .*; put the job's file back"):
        resume_job(folder, quiet=True)


def test_a_report_says_what_is_damaged(whole, tmp_path, capsys):
    folder = tmp_path / "copy"
    shutil.copytree(whole, folder)
    report_job(folder, quiet=True)
    assert "damaged" not in capsys.readouterr().err
    chunk = next(path for path in sorted((folder / "training.zarr" / "figures").rglob("*"))
                 if path.is_file() and path.name != "zarr.json" and "/c/3/" in str(path))  # fmt: skip
    content = bytearray(chunk.read_bytes())
    content[-1] ^= 1
    chunk.write_bytes(content)
    report_job(folder, quiet=True)
    assert "1 damaged tiles are left out" in capsys.readouterr().err
