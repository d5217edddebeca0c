"""The command line: its contract of options, fields and exit codes; and no mistake of a user's prints a traceback."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from adwa_jax.episode import Outcome
from adwa_jax.presets import paper
from scenarios.errors import InputError
from scenarios.suite import SUITE_NAMES, save_suite
from tests.test_tuning.worlds import BANDS, mixed_suite, part_of
from tuning import ablate, cli, console
from tuning.intervals import wilson

SUITE = part_of(mixed_suite(), [1, 2, 3, 4, 5])  # those of one padded shape
YAML = """\
image: {image}
resolution: {resolution}
origin: [{x}, {y}, {yaw}]
negate: 0
occupied_thresh: {occupied}
free_thresh: {free}
"""
WEIGHTS = {"local_heading": 0.4, "clearance": 0.4, "velocity": 0.6, "global_heading": 0.1}
RULE = {"dense_base": 0.5, "dense_gain": 0.5, "sparse_base": 1.2, "sparse_gain": 0.6}


def image(path, levels):
    Image.fromarray(np.asarray(levels, np.uint8)).save(path)


def yaml(path, image="rooms.png", resolution=0.5, x=0.0, y=0.0, yaw=0.0, occupied=0.65, free=0.196):
    Path(path).write_text(YAML.format(**{key: value for key, value in locals().items() if key != "path"}))


def toml(path, **values):
    Path(path).write_text("".join(f"{key} = {value}\n" for key, value in values.items()))


def scen(path, *rows, version="version 1", size=(6, 5), name="bands.map"):
    """rows: (start x, start y, goal x, goal y, length)."""
    lines = [f"0\t{name}\t{size[0]}\t{size[1]}\t" + "\t".join(map(str, row)) for row in rows]
    Path(path).write_text("\n".join([version, *lines]) + "\n")


def write_maps():
    Path("bands.map").write_text(BANDS)
    Path("ä [b] {c} 100% $d.map").write_text(BANDS)
    Path("sealed.map").write_text("type octile\nheight 2\nwidth 5\nmap\n..@..\n..@..\n")
    Path("cut.map").write_text("".join(BANDS.splitlines(keepends=True)[:-2]))
    Path("ragged.map").write_text(BANDS.replace(".@@@@.", ".@@@@", 1))
    Path("header.map").write_text(BANDS.replace("type octile", "type hexagonal"))
    Path("map.txt").write_text(BANDS)
    Path("folder.map").mkdir()
    scen("some.scen", (0, 0, 5, 4, 9.0), (0, 0, 0, 0, 0.0), (1, 2, 4, 2, 3.0))
    scen("sealed.scen", (0, 0, 4, 0, 0.0), (4, 1, 0, 1, 0.0), size=(5, 2), name="sealed.map")
    scen("walls.scen", (1, 1, 0, 0, 1.0))
    scen("other.scen", (0, 0, 5, 4, 9.0), size=(7, 5))
    scen("empty.scen")
    scen("v9.scen", (0, 0, 5, 4, 9.0), version="version 9")
    Path("zero.scen").write_text("")


def write_images():
    rooms = np.full((8, 8), 255)
    rooms[3, 1:] = 0
    rooms[:2, :2] = 205
    image("rooms.png", rooms)  # rows from the top: unknown in the upper left, a wall over the middle
    image("all.png", np.full((4, 4), 255))
    image("open.png", np.full((14, 14), 255))
    image("black.png", np.zeros((4, 4)))
    image("one.png", [[255]])
    Image.fromarray(np.full((4, 4), 60_000, np.uint16)).save("deep.png")
    clear = np.full((4, 4, 4), 255)
    clear[0, 0, 3] = 0
    image("clear.png", clear)
    Path("no.png").write_text("no picture")
    yaml("rooms.yaml")
    yaml("turned.yaml", image="all.png", x=10.0, y=20.0, yaw=1.5707963267948966)
    yaml("missing.yaml", image="gone.png")
    yaml("nan.yaml", resolution=".nan")
    yaml("thresholds.yaml", occupied=0.2, free=0.5)
    yaml("deep.yaml", image="deep.png")
    Path("short.yaml").write_text(YAML.format(image="rooms.png", resolution=1, x=0, y=0, yaw=0, occupied=0.65, free=0.2)
                                  .replace("resolution: 1\n", ""))  # fmt: skip
    Path("broken.yaml").write_text("image: [rooms.png\n")


def write_weights():
    toml("weights.toml", **WEIGHTS)
    toml("rule.toml", **WEIGHTS, **RULE)
    toml("unknown.toml", **WEIGHTS, clearence=0.4)
    toml("missing.toml", **{key: value for key, value in WEIGHTS.items() if key != "velocity"})
    toml("nan.toml", **{**WEIGHTS, "clearance": "nan"})
    toml("negative.toml", **{**WEIGHTS, "clearance": -0.4})
    toml("string.toml", **{**WEIGHTS, "clearance": '"0.4"'})
    toml("list.toml", **{**WEIGHTS, "clearance": "[0.4]"})
    toml("progress.toml", **WEIGHTS, progress=1.0)
    toml("zero.toml", **dict.fromkeys(WEIGHTS, 0))
    toml("dense.toml", **WEIGHTS, **{**RULE, "dense_base": 0.9})
    toml("sparse.toml", **WEIGHTS, **{**RULE, "sparse_base": 0.9})


def write_suites():
    save_suite(SUITE, "some.suite")
    save_suite(part_of(SUITE, [2]), "walled.suite")
    save_suite(part_of(SUITE, []), "hollow.suite")
    Path("zero.suite").write_text("")
    Path("cut.suite").write_bytes(Path("some.suite").read_bytes()[:200])
    with np.load("some.suite") as archive:
        arrays = {name: archive[name] for name in archive.files}
    header = json.loads(arrays["header"].tobytes()) | {"version": 99}
    np.savez("old.npz", **{**arrays, "header": np.frombuffer(json.dumps(header).encode(), np.uint8)})
    Path("worlds").mkdir()
    Path("table.csv").write_text("name,length\na,1\n")
    Path("words.txt").write_text("Dear all\n")
    os.mkfifo("pipe")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with every input that is used below, good and bad."""
    path, before = tmp_path_factory.mktemp("inputs"), Path.cwd()
    os.chdir(path)
    try:
        for write in (write_maps, write_images, write_weights, write_suites):
            write()
    finally:
        os.chdir(before)
    return path


@pytest.fixture
def adwa(folder, monkeypatch, capsys):
    """Runs the command in the folder: (exit code, standard output, standard error)."""
    monkeypatch.chdir(folder)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["adwa", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code or 0, *capsys.readouterr()

    return run


def strict_json(text):
    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def summary(folder):
    """Of the suite file, through the runner."""
    out = folder / "evaluated"
    arguments = ["evaluate", "--suite-file", str(folder / "some.suite"), "--json", str(folder / "evaluated.json")]
    result = CliRunner().invoke(cli.app, [*arguments, "--out", str(out)])
    assert result.exit_code == 0, result.output
    return strict_json((folder / "evaluated.json").read_text())


PLAN = ("plan", "--map", "bands.map", "--start", "0.5,0.5", "--goal", "5.5,4.5")
EVALUATE = ("evaluate", "--suite-file", "some.suite")
ENDS = ("--start", "0.5,0.5", "--goal", "0.5,0.5")


class TestPlan:
    def test_json_has_the_contracts_fields(self, adwa):
        code, out, err = adwa(*PLAN, "--json", "-")
        assert (code, err) == (0, "")
        (record,) = strict_json(out)
        assert (record["start"], record["goal"], record["status"]) == ([0.5, 0.5], [5.5, 4.5], "FOUND")
        assert (record["length"], record["key_point_length"]) == (9.0, 9.0)
        assert (record["breaking_points"], record["danger_points"]) == (2, 0)
        assert isinstance(record["expansions"], int)
        assert record["path"][0] == record["key_points"][0] == [0.5, 0.5]
        assert record["path"][-1] == record["key_points"][-1] == [5.5, 4.5]
        assert len(record["path"]) == 10
        assert "expected" not in record

    def test_a_table_is_printed_and_a_file_written(self, adwa, tmp_path):
        code, out, err = adwa(*PLAN, "--json", tmp_path / "new" / "plan.json")
        assert (code, err) == (0, "")
        assert "bands.map: 1 FOUND" in out
        assert "9.0000" in out
        assert strict_json((tmp_path / "new" / "plan.json").read_text())[0]["status"] == "FOUND"

    def test_quiet_prints_nothing(self, adwa, tmp_path):
        assert adwa(*PLAN, "--quiet") == (0, "", "")
        assert adwa("plan", "--map", "rooms.yaml", *ENDS, "-q", "--json", tmp_path / "plan.json") == (0, "", "")

    def test_a_scen_lists_the_expected_length_of_every_query(self, adwa):
        code, out, err = adwa(*PLAN[:3], "--scen", "some.scen", "--planner", "dijkstra", "--json", "-")
        assert (code, err) == (0, "")
        records = strict_json(out)
        assert [record["start"] for record in records] == [[0.5, 0.5], [0.5, 0.5], [1.5, 2.5]]
        assert [record["goal"] for record in records] == [[5.5, 4.5], [0.5, 0.5], [4.5, 2.5]]
        assert [record["expected"] for record in records] == [record["length"] for record in records] == [9.0, 0.0, 3.0]

    def test_limit_takes_the_first_queries(self, adwa):
        _, out, _ = adwa("plan", "--map", "bands.map", "--scen", "some.scen", "--limit", 2, "--json", "-")
        assert len(strict_json(out)) == 2
        assert adwa("plan", "--map", "bands.map", "--scen", "some.scen", "--limit", 99, "-q")[0] == 0

    def test_listed_unreachable_queries_are_unreachable_and_nothing_found_is_exit_1(self, adwa):
        code, out, err = adwa("plan", "--map", "sealed.map", "--scen", "sealed.scen", "--json", "-")
        assert code == 1
        assert [(record["status"], record["expected"]) for record in strict_json(out)] == [("UNREACHABLE", None)] * 2
        assert err == "adwa: none of the 2 queries has a path; see their status\n"

    def test_a_scen_named_for_another_map_of_the_size_is_told(self, adwa):
        code, _, err = adwa("plan", "--map", "ä [b] {c} 100% $d.map", "--scen", "some.scen", "--limit", 1)
        assert code == 0
        assert err == "some.scen was made for bands.map; taken as queries on ä [b] {c} 100% $d.map\n"

    @pytest.mark.parametrize(("arguments", "cells"), [
        (("--planner", "traditional"), 8), (("--planner", "dijkstra"), 10), (("--scope", "start"), 10),
        (("--weight-rule", "0.25,0.5,1.25,0.5"), 10), (("--budget", "200"), 10),
        (("--weights", "rule.toml"), 10),
    ])  # fmt: skip
    def test_options_of_the_planner(self, adwa, arguments, cells):
        code, out, _ = adwa(*PLAN, *arguments, "--json", "-")
        assert code == 0
        assert len(strict_json(out)[0]["path"]) == cells

    def test_negative_coordinates_may_stand_alone_or_after_an_equals_sign(self, adwa):
        for start in (["--start", "-1,2"], ["--start=-1,2"]):
            code, _, err = adwa("plan", "--map", "bands.map", *start, "--goal", "5.5,4.5")
            assert code == 2
            assert err.startswith("adwa: --start: -1,2; lies outside the map, which spans x 0..6, y 0..5 m")

    def test_start_and_goal_in_one_cell_are_a_path(self, adwa):
        code, out, _ = adwa("plan", "--map", "one.png", *ENDS, "--json", "-")
        assert code == 0
        assert strict_json(out)[0]["path"] == [[0.5, 0.5]]

    def test_a_turned_map_is_queried_and_answered_in_the_world_frame(self, adwa):
        goal = ("--goal", "8.25,21.75")
        code, out, _ = adwa("plan", "--map", "turned.yaml", "--start", "9.75,20.25", *goal, "--json", "-")
        assert code == 0
        (record,) = strict_json(out)
        assert record["path"] == [[9.75, 20.25], [9.25, 20.75], [8.75, 21.25], [8.25, 21.75]]
        assert record["key_points"] == [[9.75, 20.25], [8.25, 21.75]]
        assert record["length"] == pytest.approx(1.5 * np.sqrt(2), abs=1e-9)
        code, _, err = adwa("plan", "--map", "turned.yaml", "--start", "10.25,20.25", *goal)
        assert code == 2
        assert "--start: 10.25,20.25; lies outside the map" in err

    def test_the_policy_for_unknown_cells_is_told_and_kept(self, adwa):
        corner = ("plan", "--map", "rooms.yaml", "--start", "0.25,0.25", "--goal", "0.25,3.75")
        code, out, err = adwa(*corner, "--json", "-", "--unknown", "free")
        assert (code, err) == (0, "6.2% of rooms.yaml is unknown and counts as free (--unknown)\n")
        assert strict_json(out)[0]["length"] == 3.5
        code, out, err = adwa(*corner, "--json", "-")
        assert code == 2
        assert strict_json(out)[0]["status"] == "BAD_GOAL"
        note, reason = err.splitlines()
        assert note == "6.2% of rooms.yaml is unknown and counts as occupied (--unknown)"
        assert reason.startswith("adwa: --goal: 0.25,3.75; lies in an unknown cell; choose a known one")
        assert len(adwa(*corner, "--quiet")[2].splitlines()) == 1

    def test_an_unreachable_goal_is_exit_1_with_its_status_in_the_json(self, adwa):
        code, out, err = adwa("plan", "--map", "sealed.map", "--start", "0.5,0.5", "--goal", "4.5,0.5", "--json", "-")
        assert code == 1
        assert strict_json(out)[0]["status"] == "UNREACHABLE"
        reason = "--goal: 4.5,0.5 is UNREACHABLE from --start 0.5,0.5; no free way joins them; choose another goal"
        assert err == f"adwa: {reason}\n"

    def test_a_spent_budget_is_exit_1(self, adwa):
        code, out, err = adwa(*PLAN, "--budget", 3, "--json", "-")
        assert code == 1
        assert strict_json(out)[0]["status"] == "BUDGET_EXHAUSTED"
        assert err == "adwa: --budget: used up after 3 expansions without reaching the goal; raise it\n"

    def test_a_figure_is_drawn_whatever_the_files_are_called(self, adwa, tmp_path):
        picture = tmp_path / "new" / "ä [b] $x_{2$ 日.PNG"
        map_name = "ä [b] {c} 100% $d.map"
        assert adwa("plan", "--map", map_name, *ENDS, "--figure", picture, "-q") == (0, "", "")
        with Image.open(picture) as drawn:
            assert min(drawn.size) > 100


class TestEvaluate:
    def test_json_has_the_contracts_fields(self, summary):
        assert summary["count"] == len(SUITE.names) == len(summary["scenarios"])
        assert list(summary["outcomes"]) == [outcome.name for outcome in Outcome]
        assert sum(summary["outcomes"].values()) == summary["count"]
        assert summary["success_rate"] == summary["outcomes"]["REACHED"] / summary["count"]
        assert summary["success_ci"] == list(wilson(summary["outcomes"]["REACHED"], summary["count"]))
        assert [row["name"] for row in summary["scenarios"]] == list(SUITE.names)
        assert set(summary["means"]) == set(summary["scenarios"][0]) - {"name", "outcome"}

    def test_every_measure_of_the_specification_is_there(self, summary):
        assert {"length", "length_ratio", "spl", "time", "breaking_points", "danger_points", "least_clearance",
                "mean_clearance", "curvature", "angle_over_length", "command_variation", "jerk", "barn_score",
                "planned_length", "planned_breaking_points", "planned_danger_points", "expansions",
                "hit_while_stopped"} <= set(summary["means"])  # fmt: skip

    def test_the_folder_holds_the_same_and_a_contact_sheet(self, summary, folder):
        out = folder / "evaluated"
        assert strict_json((out / "results.json").read_text()) == summary
        assert len((out / "results.csv").read_text().splitlines()) == 1 + len(SUITE.names)
        with Image.open(out / "scenarios.png") as sheet:
            assert min(sheet.size) > 100

    def test_count_takes_the_first_of_a_file_with_the_same_results(self, adwa, summary):
        code, out, _ = adwa(*EVALUATE, "--count", 2, "--json", "-")
        assert code == 1  # the one that reaches its goal is the last
        assert strict_json(out)["scenarios"] == summary["scenarios"][:2]

    def test_weights_change_the_drive_and_not_the_plan(self, adwa, summary):
        _, out, _ = adwa(*EVALUATE, "--weights", "weights.toml", "--json", "-", "-q")
        other = strict_json(out)["scenarios"]
        assert [row["planned_length"] for row in other] == [row["planned_length"] for row in summary["scenarios"]]
        assert [row["mean_clearance"] for row in other] != [row["mean_clearance"] for row in summary["scenarios"]]

    def test_a_table_is_printed_and_quiet_prints_nothing(self, adwa, summary):
        code, out, err = adwa(*EVALUATE)
        assert (code, err) == (0, "")
        assert "5 scenarios" in out
        assert re.search(r"success rate +\d+\.\d%", out)
        assert "planned_key_point_breaking_points" in out
        assert adwa(*EVALUATE, "--quiet") == (0, "", "")

    def test_nothing_reached_is_exit_1(self, adwa):
        code, out, err = adwa("evaluate", "--suite-file", "walled.suite", "--json", "-")
        assert code == 1
        assert strict_json(out)["outcomes"]["NO_PATH"] == 1
        assert strict_json(out)["means"]["time"] is None
        assert err == "adwa: none of the 1 scenarios reached its goal; see their outcomes\n"

    def test_tasks_on_a_map_of_the_users(self, adwa):
        code, out, _ = adwa("evaluate", "--map", "open.png", "--count", 2, "--seed", 3, "--json", "-")
        assert code in (0, 1)
        first = strict_json(out)
        assert first["count"] == 2
        _, out, _ = adwa("evaluate", "--map", "open.png", "--count", 1, "--seed", 3, "--json", "-")
        assert strict_json(out)["scenarios"] == first["scenarios"][:1]
        _, out, _ = adwa("evaluate", "--map", "open.png", "--count", 1, "--seed", 4, "--json", "-")
        assert strict_json(out)["scenarios"] != first["scenarios"][:1]

    def test_a_named_suite_is_determined_by_name_seed_and_count(self, adwa, tmp_path):
        command = ("suite", "make", "paper-15", "--count", 2, "--seed", 5, "--out")
        assert adwa(*command, tmp_path / "a.suite", "-q") == (0, "", "")
        code, out, err = adwa(*command, tmp_path / "b.suite")
        assert (code, err) == (0, "")
        assert out == f"wrote {tmp_path / 'b.suite'}: 2 scenarios of paper-15\n"
        with np.load(tmp_path / "a.suite") as a, np.load(tmp_path / "b.suite") as b:
            assert all(np.array_equal(a[name], b[name]) for name in a.files)


    def test_the_extended_planner_drives_another_robot_without_a_map(self, adwa):
        robot = ("--preset", "extended", "--robot", "jackal", "--v-max", 1.5, "--sensor-range", 3, "--sensed-only")
        code, out, err = adwa("evaluate", "--suite-file", "some.suite", "--count", 1, *robot, "--json", "-")
        assert err in ("", "adwa: none of the 1 scenarios reached its goal; see their outcomes\n")
        found = strict_json(out)
        assert (found["suite"], found["count"]) == ("mixed-sensed", 1)
        assert found["scenarios"][0]["optimal_length"] < 8.5  # the wall is not on its map
        assert code == (0 if found["outcomes"]["REACHED"] else 1)

    def test_feasible_tells_what_is_proven_of_each_scenario(self, adwa):
        code, out, _ = adwa(*EVALUATE, "--feasible", "--json", "-")
        assert code == 0
        found = strict_json(out)
        labels = {row["name"]: row["feasibility"] for row in found["scenarios"]}
        assert (labels["open"], labels["walled"], labels["brief"]) == ("POSSIBLE", "IMPOSSIBLE", "IMPOSSIBLE")
        assert found["feasible"]["IMPOSSIBLE"] == list(labels.values()).count("IMPOSSIBLE")
        kept = found["feasible"]["not_impossible"]
        assert kept["count"] == 5 - found["feasible"]["IMPOSSIBLE"]
        assert kept["success_rate"] == found["outcomes"]["REACHED"] / kept["count"]
        _, out, _ = adwa(*EVALUATE, "--feasible")
        assert re.search(rf"success of the {kept['count']} not impossible +\d+\.\d%", out)

    def test_a_gallery_pictures_the_failures(self, adwa, tmp_path):
        assert adwa(*EVALUATE, "--gallery", tmp_path / "new", "-q") == (0, "", "")
        assert "## No path" in (tmp_path / "new" / "gallery.md").read_text()
        assert (tmp_path / "new" / "no_path.png").stat().st_size > 0


class TestAblateAndWeights:
    def test_rows_are_told_as_they_come_and_written_to_a_folder(self, adwa, tmp_path, monkeypatch):
        monkeypatch.setattr(ablate, "preset", lambda rules: paper())
        command = ("ablate", "--suite-file", "some.suite", "--rule", "replan", "--rule", "replan", "--out")
        code, out, err = adwa(*command, tmp_path / "new")
        assert code == 0
        names = ["paper", "extended", "extended without replan", "paper with replan"]
        assert [line.split(":")[0] for line in err.splitlines()] == names
        assert "5 scenarios, each with every configuration" in out
        assert out.splitlines()[-1] == f"wrote ablation.md, .json, .csv and .png in {tmp_path / 'new'}"
        rows = strict_json((tmp_path / "new" / "ablation.json").read_text())["rows"]
        assert [row["configuration"] for row in rows] == names
        assert [row["difference"] for row in rows] == [None, 0.0, 0.0, 0.0]
        assert (tmp_path / "new" / "ablation.png").stat().st_size > 0
        assert adwa(*command, tmp_path / "new", "-q") == (0, "", "")

    def test_a_preset_is_printed_as_a_file_of_weights(self, adwa, tmp_path):
        for arguments in ((), ("--preset", "extended"), ("--preset", "extended", "--robot", "jackal", "--v-max", 1)):
            code, out, err = adwa("weights", *arguments)
            assert (code, err) == (0, "")
            (tmp_path / "weights.toml").write_text(out)
            again = ("--weights", tmp_path / "weights.toml")
            assert adwa("evaluate", "--suite", "none", *arguments, *again)[2].startswith("adwa: --suite: 'none'; ")


class TestDriveAndSuite:
    def test_drive_writes_a_picture_and_an_animation_and_tells_what_evaluate_found(self, adwa, tmp_path):
        code, out, err = adwa("drive", "--suite-file", "some.suite", "--index", 3, "--figure", tmp_path / "d.png",
                              "--animation", tmp_path / "d.gif", "--json", tmp_path / "d.json")  # fmt: skip
        assert (code, err) == (0, "")
        assert out.splitlines()[-1] == f"wrote {tmp_path / 'd.png'}, {tmp_path / 'd.gif'}"
        with Image.open(tmp_path / "d.gif") as film:
            assert film.n_frames >= 1
        driven = strict_json((tmp_path / "d.json").read_text())
        _, text, _ = adwa(*EVALUATE, "--json", "-", "-q")
        found = strict_json(text)["scenarios"][3]
        assert {name: driven[name] for name in found if name != "name"} == {
            name: value for name, value in found.items() if name != "name"}  # fmt: skip

    def test_drive_without_a_path_is_exit_1_and_pictured(self, adwa, tmp_path):
        code, _, err = adwa("drive", "--suite-file", "walled.suite", "--figure", tmp_path / "d.png", "--animation",
                            tmp_path / "d.gif", "-q")  # fmt: skip
        assert (code, err) == (1, "")
        assert (tmp_path / "d.png").stat().st_size > 0

    def test_suite_show_tells_the_recipe_and_draws(self, adwa, tmp_path):
        code, out, err = adwa("suite", "show", "some.suite", "--figure", tmp_path / "s.png", "--limit", 2)
        assert (code, err) == (0, "")
        assert out.splitlines()[:2] == ["mixed: 5 scenarios", "recipe: {}"]
        assert (tmp_path / "s.png").stat().st_size > 0

    def test_a_folder_with_a_suites_name_does_not_hide_the_suite(self, adwa, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        Path("maze").mkdir()
        assert adwa("suite", "make", "maze", "--count", 1, "--out", tmp_path / "m.suite", "-q")[0] == 0

    @pytest.mark.realdata
    def test_a_folder_of_barn_worlds_is_a_suite(self, adwa, data_folder, tmp_path):
        barn = data_folder / "barn"
        code, out, _ = adwa("suite", "make", barn / "world_files", "--out", tmp_path / "barn.suite")
        assert code == 0
        assert out.endswith("2 scenarios of world_files\n")
        assert adwa("suite", "show", barn / "world_files", "--figure", tmp_path / "s.png", "-q") == (0, "", "")


MISTAKES = {
    # maps
    "no such map": (("plan", "--map", "gone.map", *ENDS), "gone.map", "no such file", "check the name"),
    "cut map": (("plan", "--map", "cut.map", *ENDS), "cut.map:7", "height 5", "fetch the map again"),
    "ragged map": (("plan", "--map", "ragged.map", *ENDS), "ragged.map:6", "5 characters", "mend the row"),
    "map header": (("plan", "--map", "header.map", *ENDS), "header.map:1", "hexagonal", "check that"),
    "map suffix": (("plan", "--map", "map.txt", *ENDS), "map.txt", "'.txt'", "rename it"),
    "map is a folder": (("plan", "--map", "folder.map", *ENDS), "folder.map", "is a folder", "name the file"),
    "no free cell": (("plan", "--map", "black.png", *ENDS), "black.png", "no free cell", "check the map"),
    "no picture": (("plan", "--map", "no.png", *ENDS), "no.png", "cannot be read", "check the file"),
    "16-bit picture": (("plan", "--map", "deep.png", *ENDS), "deep.png", "more than 8 bits", "convert it"),
    "16-bit picture of a YAML": (("plan", "--map", "deep.yaml", *ENDS), "deep.png", "more than 8 bits", "convert it"),
    "transparent picture": (("plan", "--map", "clear.png", *ENDS), "clear.png", "1 transparent", "flatten"),
    "missing picture": (("plan", "--map", "missing.yaml", *ENDS), "missing.yaml, image", "'gone.png'", "mend"),
    "no resolution": (("plan", "--map", "short.yaml", *ENDS), "short.yaml", "'resolution'", "add"),
    "NaN resolution": (("plan", "--map", "nan.yaml", *ENDS), "nan.yaml, resolution", "nan", "metres"),
    "thresholds": (("plan", "--map", "thresholds.yaml", *ENDS), "thresholds.yaml, free_thresh", "0.5", "swap or mend"),
    "no YAML": (("plan", "--map", "broken.yaml", *ENDS), "broken.yaml:1", "is not YAML", "mend"),
    "resolution option": (("plan", "--map", "all.png", *ENDS, "--resolution", 0), "--resolution: ", "0.0", "metres"),
    # queries
    "start outside": ((*PLAN[:3], "--start", "6,1", "--goal", "1,0.5"), "--start", "6,1", "choose a point on it"),
    "start in a wall": ((*PLAN[:3], "--start", "1.5,1.5", "--goal", "1,1"), "--start", "1.5,1.5", "a free point"),
    "goal in a wall": ((*PLAN[:3], "--start", "1,0.5", "--goal", "1.5,1.5"), "--goal", "1.5,1.5", "a free point"),
    "start near a wall": ((*PLAN, "--robot-radius", 0.5), "--start", "0.5,0.5", "a smaller radius"),
    "start is no point": ((*PLAN[:3], "--start", "1", "--goal", "1,1"), "--start", "'1'", "write for instance"),
    "start is NaN": ((*PLAN[:3], "--start", "nan,1", "--goal", "1,1"), "--start", "'nan,1'", "write for instance"),
    "goal is infinite": ((*PLAN[:3], "--start", "1,1", "--goal", "1e300,1"), "--goal", "'1e300,1'", "write for"),
    "goal not given": ((*PLAN[:3], "--start", "1,1"), "--goal", "not given", "add it"),
    "nothing to plan": (PLAN[:3], "--start", "not given", "add it"),
    "scen and start": ((*PLAN, "--scen", "some.scen"), "--scen", "some.scen", "leave out"),
    "no such scen": ((*PLAN[:3], "--scen", "gone.scen"), "gone.scen", "no such file", "check the name"),
    "empty scen": ((*PLAN[:3], "--scen", "empty.scen"), "empty.scen", "no scenario", "fetch"),
    "0-byte scen": ((*PLAN[:3], "--scen", "zero.scen"), "zero.scen", "0 bytes", "fetch"),
    "scen version": ((*PLAN[:3], "--scen", "v9.scen"), "v9.scen:1", "version 9", "check that"),
    "scen of another map": ((*PLAN[:3], "--scen", "other.scen"), "other.scen:2", "7 x 5", "name the map"),
    "limit 0": ((*PLAN[:3], "--scen", "some.scen", "--limit", 0), "--limit", "0", "leave it out"),
    "budget 0": ((*PLAN, "--budget", 0), "--budget", "0", "leave it out"),
    "NaN radius": ((*PLAN, "--robot-radius", "nan"), "--robot-radius", "nan", "metres"),
    "negative radius": ((*PLAN, "--robot-radius", -1), "--robot-radius", "-1", "metres"),
    "huge radius": ((*PLAN, "--robot-radius", "1e300"), "--robot-radius", "1e+300", "metres"),
    "dense rule": ((*PLAN, "--weight-rule", "0.9,0.5,1.2,0.6"), "--weight-rule", "must be < 1", "lower dense_base"),
    "sparse rule": ((*PLAN, "--weight-rule", "0.5,0.5,0.9,0.6"), "--weight-rule", "0.9", "raise it"),
    "three constants": ((*PLAN, "--weight-rule", "1,2,3"), "--weight-rule", "'1,2,3'", "write for instance"),
    "rule twice": ((*PLAN, "--weight-rule", "1,1,2,1", "--weights", "w.toml"), "--weights", "w.toml", "leave out"),
    "weights without a rule": ((*PLAN, "--weights", "weights.toml"), "weights.toml", "no constant of eq. 5", "add"),
    "weights of a bad rule": ((*PLAN, "--weights", "dense.toml"), "dense.toml", "must be < 1", "lower dense_base"),
    "empty rule": ((*PLAN, "--weight-rule", ""), "--weight-rule", "''", "write for instance"),
    # outputs
    "json is a folder": ((*PLAN, "--json", "worlds"), "--json", "worlds", "name a file in it"),
    "json below a file": ((*PLAN, "--json", "bands.map/x.json"), "--json", "bands.map/x.json", "name a folder"),
    "json cannot be written": ((*PLAN, "--json", "/proc/no/x.json"), "--json", "/proc/no/x.json", "check its"),
    "json has no room": ((*PLAN, "--json", "/dev/full"), "--json", "/dev/full", "free space"),
    "figure suffix": ((*PLAN, "--figure", "plan.xyz"), "--figure", "plan.xyz", "rename it"),
    "suite in place of a pipe": (("suite", "make", "maze", "--out", "pipe"), "--out", "pipe", "name another"),
    "suite in place of a folder": (("suite", "make", "maze", "--out", "worlds"), "--out", "worlds", "name a file"),
    "out is a file": ((*EVALUATE, "--out", "bands.map"), "--out", "bands.map", "name a folder"),
    "animation suffix": (("drive", *EVALUATE[1:], "--animation", "d.avi"), "--animation", "d.avi", "rename it"),
    # suites
    "no suite": (("evaluate",), "--suite, --suite-file, --map", "0 given", "give one"),
    "two suites": ((*EVALUATE, "--map", "bands.map"), "--suite, --suite-file, --map", "2 given", "give one"),
    "three suites": ((*EVALUATE, "--map", "x", "--suite", "maze"), "--suite, --suite-file", "3 given", "give one"),
    "unknown suite": (("evaluate", "--suite", "labyrinth"), "--suite", "'labyrinth'", "choose one"),
    "unknown suite to make": (("suite", "make", "labyrinth", "--out", "l.suite"), "NAME", "'labyrinth'", "choose one"),
    "no such suite file": (("evaluate", "--suite-file", "gone.suite"), "gone.suite", "no such file", "check the name"),
    "0-byte suite": (("evaluate", "--suite-file", "zero.suite"), "zero.suite", "0 bytes", "make it again"),
    "cut suite": (("evaluate", "--suite-file", "cut.suite"), "cut.suite", "cut off", "give a file"),
    "suite without scenarios": (("evaluate", "--suite-file", "hollow.suite"), "mixed", "0 scenarios", "make it again"),
    "table that is no suite": (("evaluate", "--suite-file", "table.csv"), "table.csv:1", "no column", "check that"),
    "words that are no tracks": (("evaluate", "--suite", "words.txt"), "words.txt:1", "'Dear all'", "mend"),
    "no suite of such a name": (("drive", "--suite-file", "gone"), "gone", "must be a saved suite", "check the name"),
    "older suite": (("evaluate", "--suite-file", "old.npz"), "old.npz", "version 99", "make it again"),
    "older suite to show": (("suite", "show", "old.npz"), "old.npz", "version 99", "make it again"),
    "folder without worlds": (("evaluate", "--suite-file", "worlds"), "worlds", "no .world", "name the folder"),
    "unknown preset": ((*EVALUATE, "--preset", "best"), "--preset", "'best'", "choose one"),
    "count 0": (("evaluate", "--suite", "paper-15", "--count", 0), "--count: ", "0", "try 1"),
    "negative count": (("evaluate", "--suite", "paper-15", "--count", -5), "--count: ", "-5", "try 1"),
    "count beyond all": (("evaluate", "--suite", "paper-15", "--count", 10**20), "--count: ", str(10**20), "try 1"),
    "count of a file": ((*EVALUATE, "--count", 6), "--count", "6", "choose from 1 to 5"),
    "claims count": (("claims", "--count", 0), "--count", "0", "200"),
    "negative seed": (("evaluate", "--suite", "paper-15", "--seed", -1), "--seed: ", "-1", "try"),
    "index beyond": (("drive", *EVALUATE[1:], "--index", 5), "--index", "5", "choose a lower one"),
    "negative index": (("drive", *EVALUATE[1:], "--index", -1), "--index", "-1", "first scenario is 0"),
    "limit of a sheet": (("suite", "show", "some.suite", "--limit", 0), "--limit", "0", "draw at least one"),
    "obstacles": (("evaluate", "--map", "all.png", "--unknown-obstacles", -1), "--unknown-obstacles", "-1", "correct"),
    "movers": (("evaluate", "--map", "all.png", "--movers", 10**9), "--movers", str(10**9), "correct"),
    "movers without a map": (("evaluate", "--suite", "paper-15", "--movers", 5), "--movers", "5", "or give --map"),
    "unknown robot": ((*EVALUATE, "--robot", "tank"), "--robot", "'tank'", "choose one"),
    "no speed": ((*EVALUATE, "--v-max", 0), "--v-max", "0", "correct it"),
    "too fast": (("ablate", *EVALUATE[1:], "--v-max", 11), "--v-max", "11", "correct it"),
    "blind": (("drive", *EVALUATE[1:], "--sensor-range", 0), "--sensor-range", "0", "correct it"),
    "no disc": ((*EVALUATE, "--robot", "jackal", "--feasible"), "--feasible", "2 discs", "--robot disc"),
    "gallery is a file": ((*EVALUATE, "--gallery", "bands.map"), "--gallery", "bands.map", "name a folder"),
    "unknown rule": (("ablate", *EVALUATE[1:], "--rule", "luck"), "--rule", "'luck'", "choose among"),
    "ablation into a file": (("ablate", *EVALUATE[1:], "--out", "bands.map"), "--out", "bands.map", "name a folder"),
    "no suite to ablate": (("ablate",), "--suite, --suite-file, --map", "0 given", "give one"),
    "no room on the map": (("evaluate", "--map", "one.png"), "one.png", "no two connected cells", "a smaller radius"),
    # weights
    "no such weights": ((*EVALUATE, "--weights", "gone.toml"), "gone.toml", "no such file", "check the name"),
    "unknown key": ((*EVALUATE, "--weights", "unknown.toml"), "unknown.toml", "clearence", "remove or rename"),
    "missing key": ((*EVALUATE, "--weights", "missing.toml"), "missing.toml", "velocity", "add it"),
    "NaN weight": ((*EVALUATE, "--weights", "nan.toml"), "nan.toml", "clearance = nan", "correct it"),
    "negative weight": ((*EVALUATE, "--weights", "negative.toml"), "negative.toml", "clearance = -0.4", "correct it"),
    "string weight": ((*EVALUATE, "--weights", "string.toml"), "string.toml", "clearance = '0.4'", "without quotes"),
    "list weight": ((*EVALUATE, "--weights", "list.toml"), "list.toml", "clearance = [0.4]", "without quotes"),
    "weight without effect": ((*EVALUATE, "--weights", "progress.toml"), "progress.toml", "progress", "--preset ext"),
    "zero weights": ((*EVALUATE, "--weights", "zero.toml"), "zero.toml", "all 0", "raise one"),
    "dense constants": ((*EVALUATE, "--weights", "dense.toml"), "dense.toml", "must be < 1", "lower dense_base"),
    "sparse constants": ((*EVALUATE, "--weights", "sparse.toml"), "sparse.toml", "0.9", "raise it"),
    # typer's own
    "unknown policy": ((*PLAN, "--unknown", "maybe"), "--unknown", "'maybe'", "see adwa plan --help"),
    "unknown planner": ((*PLAN, "--planner", "rrt"), "--planner", "'rrt'", "see adwa plan --help"),
    "unknown scope": ((*PLAN, "--scope", "map"), "--scope", "'map'", "see adwa plan --help"),
    "unknown option": ((*PLAN, "--fast"), "--fast", "", "see adwa plan --help"),
    "unknown command": (("fly",), "fly", "", "see adwa --help"),
    "unknown command of suites": (("suite", "fly"), "fly", "", "see adwa suite --help"),
    "option without a value": (("plan", "--map"), "--map", "", "--help"),
    "no map": (("plan", *ENDS), "--map", "", "see adwa plan --help"),
    "count in words": (("evaluate", "--suite", "maze", "--count", "ten"), "--count", "", "see adwa evaluate --help"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_with_place_value_and_remedy_and_exit_2(adwa, mistake):
    arguments, *fragments = MISTAKES[mistake]
    code, out, err = adwa(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("adwa: ")
    assert len(err.splitlines()) == 1, err
    for fragment in fragments:
        assert fragment in err


def test_a_film_that_cannot_be_written_is_refused_before_the_drive(adwa, monkeypatch):
    monkeypatch.setattr("matplotlib.animation.FFMpegWriter.isAvailable", lambda: False)
    code, out, err = adwa("drive", "--suite-file", "gone", "--animation", "d.mp4")
    assert (code, out) == (2, "")
    assert err == "adwa: d.mp4: .mp4 is written by ffmpeg, which is not on the PATH; install it or write a .gif\n"


def test_a_map_too_large_for_exact_costs_is_refused_by_name(adwa, tmp_path):
    image(tmp_path / "huge.png", np.full((3000, 3000), 255))
    image(tmp_path / "long.png", np.full((1, 20_000), 255))
    for name in ("huge.png", "long.png"):
        code, _, err = adwa("plan", "--map", tmp_path / name, *ENDS)
        assert code == 2
        assert len(err.splitlines()) == 1
        assert name in err
        assert "coarsen its resolution" in err


def test_without_a_command_the_help_is_shown(adwa):
    for arguments in ((), ("suite",)):
        code, out, err = adwa(*arguments)
        assert (code, err) == (2, "")
        assert "Usage: adwa" in out


def test_help_names_the_suites_and_every_option_of_the_contract():
    text = {}
    for command in ("plan", "evaluate", "ablate"):
        output = CliRunner().invoke(cli.app, [command, "--help"]).output
        text[command] = " ".join(re.sub("[^-a-zA-Z0-9]", " ", output).split())  # without the frame of the help
    for option in ("map", "start", "goal", "scen", "limit", "planner", "scope", "weight-rule", "robot-radius",
                   "unknown", "json", "figure"):  # fmt: skip
        assert f"--{option} " in text["plan"]
    for option in ("suite", "suite-file", "map", "count", "seed", "preset", "weights", "json", "out", "robot", "v-max",
                   "sensor-range", "sensed-only", "feasible", "gallery"):  # fmt: skip
        assert f"--{option} " in text["evaluate"]
    for option in ("suite", "suite-file", "map", "count", "seed", "rule", "robot", "out"):
        assert f"--{option} " in text["ablate"]
    for name in SUITE_NAMES:
        assert name in text["evaluate"]


def test_input_errors_pass_through_the_app_itself(folder):
    result = CliRunner().invoke(cli.app, ["plan", "--map", str(folder / "cut.map"), *ENDS])
    assert isinstance(result.exception, InputError)


def test_a_bug_keeps_its_traceback(adwa, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(cli, "load_map", broken)
    with pytest.raises(ZeroDivisionError):
        adwa(*PLAN)


def in_a_process(*arguments, stdout=subprocess.PIPE, **settings):
    """The command as a terminal starts it: a background shell has its children ignore Ctrl-C."""
    code = ("import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
            "from tuning.cli import main; main()")  # fmt: skip
    return subprocess.Popen([sys.executable, "-c", code, *map(str, arguments)],
                            stdout=stdout, stderr=subprocess.PIPE, text=True, **settings)  # fmt: skip


class TestProcess:
    def test_exit_codes_and_streams(self, folder):
        process = in_a_process(*PLAN, "--json", "-", cwd=folder)
        out, err = process.communicate(timeout=60)
        assert (process.returncode, err) == (0, "")
        assert strict_json(out)[0]["status"] == "FOUND"

    def test_another_working_folder(self, folder):
        process = in_a_process("plan", "--map", folder / "sealed.map", "--start", "0,0", "--goal", "4.5,0.5", cwd="/")
        out, err = process.communicate(timeout=60)
        assert (process.returncode, out, len(err.splitlines())) == (1, "", 1)

    def test_output_that_has_no_room_is_one_line(self, folder):
        with open("/dev/full", "w") as full:
            process = in_a_process(*PLAN, cwd=folder, stdout=full)
            _, err = process.communicate(timeout=60)
        assert process.returncode == 2
        assert err.startswith("adwa: output: No space left on device; check")
        assert len(err.splitlines()) == 1

    def test_a_reader_that_leaves_early_is_no_error_to_tell(self, folder):
        process = in_a_process(*PLAN, "--json", "-", cwd=folder)
        process.stdout.close()
        assert process.wait(timeout=60) == 1
        assert process.stderr.read() == ""
        process.stderr.close()

    def test_a_terminal_that_knows_ascii_only_gets_something_readable(self, folder):
        arguments = ("plan", "--map", "ä [b] {c} 100% $d.map", "--scen", "some.scen", "--limit", 1)
        process = in_a_process(*arguments, cwd=folder, env={**os.environ, "PYTHONIOENCODING": "ascii"})
        out, err = process.communicate(timeout=60)
        assert process.returncode == 0
        assert "1 FOUND" in out
        assert "\\xe4 [b] {c} 100% $d.map" in err

    def test_ctrl_c_ends_the_work_with_130_and_no_traceback(self, folder):
        process = in_a_process("evaluate", "--suite", "paper-15", "--count", 100_000, cwd=folder,
                               env={**os.environ, "FORCE_COLOR": "1"})  # fmt: skip
        shown = ""
        while "/s" not in shown:  # the bar's rate: it is past compiling and at work
            shown += process.stderr.read(1) or pytest.fail(shown)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        assert (process.returncode, out) == (130, "")
        assert "Traceback" not in err


class TestProgressBar:
    def test_it_appears_on_a_terminal_after_its_patience_and_leaves_nothing(self, monkeypatch, capsys):
        monkeypatch.setattr(console, "PATIENCE", 0.05)
        monkeypatch.setenv("FORCE_COLOR", "1")
        with console.progress_bar("working on {x} [bold]", quiet=False) as progress:
            progress(1, 4)
            time.sleep(0.4)
        shown = capsys.readouterr()
        assert shown.out == ""
        assert "working on {x} [bold]" in shown.err
        assert "1/4" in shown.err

    @pytest.mark.parametrize("setting", ["quiet", "short", "no terminal"])
    def test_it_does_not_where_it_should_not(self, monkeypatch, capsys, setting):
        monkeypatch.setattr(console, "PATIENCE", 5.0 if setting == "short" else 0.01)
        if setting != "no terminal":
            monkeypatch.setenv("FORCE_COLOR", "1")
        with console.progress_bar("working", quiet=setting == "quiet") as progress:
            progress(1, 4)
            time.sleep(0.1)
        assert capsys.readouterr() == ("", "")

    def test_it_ends_with_the_work_that_fails(self, monkeypatch, capsys):
        monkeypatch.setattr(console, "PATIENCE", 0.01)
        def fail():
            with console.progress_bar("working", quiet=False):
                time.sleep(0.1)
                raise InputError("bad")

        with pytest.raises(InputError, match="bad"):
            fail()
        assert capsys.readouterr() == ("", "")
