"""Mistakes in job files: each named with its dotted path, all of them together, before anything runs."""

import re
from dataclasses import replace

import pytest
from PIL import Image

from adwa_jax.presets import extended
from scenarios.errors import InputError
from scenarios.suite import make_suite, save_suite
from tuning.job_checks import goals_of, planner_of, remarks_of, set_up, space_of
from tuning.job_file import load_job
from tuning.objectives import DEFAULT_OBJECTIVES, Constraint, Statistic

JOB = """\
name = "office"
seed = 7

[planner]
preset = "extended"

[training]
suites = [{suite = "paper-15", count = 3, seed = 1}]

[held_out]
suites = [{suite = "paper-15", count = 2, seed = 2}]

[parameters.clearance]
low = 0.02
high = 0.5
scale = "log"

[[constraints]]
measure = "success"
at_least = 0.95

[method]
name = "sobol"
episodes = 30
"""


@pytest.fixture
def written(tmp_path):
    def write(*changes, text=JOB):
        for before, after in changes:
            assert before in text
            text = text.replace(before, after, 1)
        path = tmp_path / "job.toml"
        path.write_text(text)
        return path

    return write


def told(path):
    """The mistakes, without the file's name."""
    with pytest.raises(InputError) as caught:
        load_job(path)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}: ") for line in lines)
    return [line.removeprefix(f"{path}: ") for line in lines]


def test_a_job_says_planner_space_goals_and_suites(written):
    path = written()
    job = load_job(path)
    config = planner_of(job.planner, path.parent)
    assert config == extended()
    assert space_of(job, config).names == ("clearance",)
    goals = goals_of(job)
    assert goals.objectives == DEFAULT_OBJECTIVES
    assert goals.constraints == (Constraint(Statistic("success", "max"), 0.95),)
    setup = set_up(job, path, path.parent, quiet=True)
    assert (setup.training.names, len(setup.held_out.names)) == (make_suite("paper-15", 1, 3).names, 2)


def test_several_suites_are_taken_together_under_different_names(written, tmp_path):
    save_suite(make_suite("paper-15", 1, 2), tmp_path / "a.suite")
    path = written(('seed = 1}', 'seed = 1}, {suite_file = "a.suite"}'))
    setup = set_up(load_job(path), path, tmp_path, quiet=True)
    assert len(set(setup.training.names)) == len(setup.training.scenarios) == 5


def test_a_robots_file_lies_relative_to_the_job(written, tmp_path):
    (tmp_path / "small.toml").write_text("radius = 0.2\nv_max = 0.6\n")
    path = written(('preset = "extended"', 'preset = "extended"\nrobot = "small.toml"'))
    robot = planner_of(load_job(path).planner, tmp_path).constants.robot
    assert robot == replace(extended().constants.robot, radius=0.2, v_max=0.6)


MISTAKES = {
    "unknown key": (("seed = 7", "sead = 7"), "sead: unknown key; the keys are name, seed, .*; did you mean seed?"),
    "unknown key of an entry": (("count = 3", "cuont = 3"),
                                "training.suites.0.cuont: unknown key; .*; did you mean count?"),
    "missing table": (('[held_out]\nsuites = [{suite = "paper-15", count = 2, seed = 2}]', ""),
                      "held_out: missing; .*; add it"),
    "wrong type": (("episodes = 30", 'episodes = "30"'),
                   "method.episodes: '30'; must be a whole number; write it without quotes or decimals"),
    "no list": (("[{suite = \"paper-15\", count = 3, seed = 1}]", '"paper-15"'),
                "training.suites: 'paper-15'; must be a list; write it in .*"),
    "value for a table": (('[planner]\npreset = "extended"', 'planner = "extended"'),
                          "planner: 'extended'; must be a table; write its keys in .*"),
    "unknown preset": (('"extended"', '"extendet"'), "planner.preset: 'extendet'; .*; did you mean extended?"),
    "parameter without effect": (("parameters.clearance", "parameters.velocity"),
                                 "parameters.velocity: has no effect under preset extended; .*"),
    "empty range": (("low = 0.02", "low = 0.9"), "parameters.clearance.* 0.9, 0.5; must be .*"),
    "log scale from 0": (("low = 0.02", "low = 0.0"), "parameters.clearance.low: 0; must be above 0 .*"),
    "unknown measure": (('measure = "success"', 'measure = "sucess"'),
                        "constraints.0.measure: 'sucess'; must be one of success, .*; did you mean success?"),
    "two bounds": (("at_least = 0.95", "at_least = 0.95\nat_most = 1.0"),
                   "constraints.0: both of at_least and at_most given; .*"),
    "overlap": (("seed = 2", "seed = 1"), "held_out.suites.0: paper-15, seed 1; overlaps training.suites.0, .*"),
    "small budget": (("episodes = 30", "episodes = 5"), "method.episodes: 5; .* on 3 training scenarios take 6; .*"),
    "unknown method": (('"sobol"', '"sobel"'), "method.name: 'sobel'; must be one of .*; did you mean sobol?"),
    "setting of the method": (("episodes = 30", "episodes = 30\ngeneration = 3"),
                              "method.generation: 3; must be a power of two; try 64"),
    "unknown setting": (("episodes = 30", "episodes = 30\npopulation = 8"), "method.population: unknown key; .*"),
    "two kinds of suite": (('suite = "paper-15", count = 3', 'suite = "paper-15", map = "a.png", count = 3'),
                           "training.suites.0: suite, map given; exactly one .*; give one"),
    "no robot": (('preset = "extended"', 'preset = "extended"\nrobot = "tank"'), "planner.robot: 'tank'; .*"),
    "no robot file": (('preset = "extended"', 'preset = "extended"\nrobot = "gone.toml"'), "planner: .*gone.toml: .*"),
    "no weights": (('preset = "extended"', 'preset = "extended"\nweights = "gone.toml"'), "planner: .*gone.toml: .*"),
    "race on few": (("episodes = 30", "episodes = 30\nracing = true"), "method.racing: true; .*"),
    "not a share": (("at_least = 0.95", "at_least = 0.95\nworst_share = 1.5"),
                    "constraints.0.worst_share: 1.5; must be less than or equal to 1; correct it"),
    "NaN": (("low = 0.02", "low = nan"), "parameters.clearance.low: nan; must be .*"),
    "integer scale": (('scale = "log"', 'scale = "integer"'), "parameters.clearance.scale: 'integer'; .*"),
    "share in percent": (("at_least = 0.95", "at_least = 95"),
                         "constraints.0.at_least: 95; success is never above 1; lower it"),
    "below nothing": (("at_least = 0.95", "at_most = -0.1"),
                      "constraints.0.at_most: -0.1; success is never below 0; raise it"),
    "contradiction": (("[method]", '[[constraints]]\nmeasure = "success"\nat_most = 0.5\nworst_share = 0.1\n[method]'),
                      "constraints.0.at_least: 0.95; .* at most 0.5, as constraints.1.at_most asks for; lower it, .*"),
    "key of a map": (("count = 3", "count = 3, movers = 2"),
                     "training.suites.0.movers: without effect on paper-15; .* a map .*; leave out, or name a map"),
    "no rule": (("[method]", "[choice]\nrule = \"best\"\n[method]"), "choice.rule: 'best'; must be .*"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_with_its_path_value_rule_and_remedy(written, mistake):
    change, expected = MISTAKES[mistake]
    (line,) = told(written(change))
    assert re.fullmatch(expected.replace("?", r"\?"), line), line


MANY = """\
name = 1
sead = 7

[training]
suites = [{suite = "paper-15", count = 3, seed = 1}]

[held_out]
suites = [{suite = "paper-15", count = 2, seed = 1}]

[parameters]
clearance = {low = 0.0, high = 0.5, scale = "log"}
velocity = {low = 0.0, high = 1.0}
forward = {low = "0", high = 1.0}

[[objectives]]
measure = "luck"
direction = "min"

[[constraints]]
measure = "success"
at_least = 5

[method]
name = "sobol"
episodes = 3
racing = true
generation = 3

[choice]
rule = "best"
"""


def test_mistakes_of_every_kind_are_listed_together(written):
    """What is wrong in one table hides no mistake in another, nor one of a parameter that of the next."""
    places = [line.split(":")[0] for line in told(written(text=MANY))]
    assert sorted(places) == [
        "choice.rule", "constraints.0.at_least", "held_out.suites.0", "method.episodes", "method.generation",
        "method.racing", "name", "objectives.0.measure", "parameters.clearance.low", "parameters.forward.low",
        "parameters.velocity", "sead",
    ]  # fmt: skip


def test_a_mistake_in_a_table_raises_none_in_those_that_depend_on_it(written):
    """Under the preset that is meant all is well."""
    (line,) = told(written(('"extended"', '"papre"'), ("parameters.clearance", "parameters.velocity")))
    assert line.startswith("planner.preset: 'papre'; ")


def test_a_default_outside_its_range_is_remarked_on(written):
    path = written(("low = 0.02", "low = 0.7"), ("high = 0.5", "high = 0.9"))
    space = space_of(load_job(path), extended())
    assert 0.0 < space.default[0] < 0.7
    (remark,) = remarks_of(space)
    assert re.fullmatch(rf"parameters\.clearance: the default, {space.default[0]:g}, is outside its range; .* at 0\.7",
                        remark)  # fmt: skip
    assert remarks_of(space_of(load_job(written()), extended())) == []


@pytest.mark.parametrize("text", ["name = office", "a = 1\na = 2\n", "[[["])
def test_what_is_not_toml_is_told(written, text):
    (line,) = told(written(text=text))
    assert re.search(r"not TOML \(.*line \d.*\)", line)


@pytest.mark.parametrize("sensed", ["", ", sensed_only = true"])
def test_the_same_scenarios_by_another_name_are_refused(written, tmp_path, sensed):
    save_suite(make_suite("paper-15", 1, 2), tmp_path / "a.suite")
    path = written(('suite = "paper-15", count = 2, seed = 2', f'suite_file = "a.suite"{sensed}'))
    with pytest.raises(InputError, match=r"held_out: 2 of 2 scenarios are training scenarios too .*; choose other"):
        set_up(load_job(path), path, tmp_path, quiet=True)


def test_all_files_that_are_not_there_are_listed_together(written):
    suites = '{suite = "papr-15"}, {suite_file = "gone.npz"}'
    lines = told(written(('suite = "paper-15", count = 2', 'map = "gone.map", count = 2'),
                         ('{suite = "paper-15", count = 3, seed = 1}', suites), ("low = 0.02", "low = 0.9"),
                         ('preset = "extended"', 'preset = "extended"\nrobot = "r.toml"\nweights = "w.toml"')))
    assert [re.sub(r"/\S*/", "", line) for line in lines] == [
        "training.suites.0.suite: 'papr-15'; must be one of paper-15, paper-20, paper-25, blocks, rooms, maze, barn, "
        "crowd; did you mean paper-15?",
        "training.suites.1.suite_file: gone.npz; no such file; check the name and the path",
        "held_out.suites.0.map: gone.map; no such file; check the name and the path",
        "planner: r.toml: no such file; a file of robot limits (TOML) is expected; check the name and folder",
        "planner: w.toml: no such file; a file of weights (TOML) is expected; check the name and folder",
        "parameters.clearance: low, high: 0.9, 0.5; must be 0 ≤ low < high ≤ 1e+06; correct them",
    ]  # fmt: skip


def test_suites_that_cannot_be_read_are_all_named_by_their_places(written, tmp_path):
    for name in ("a.map", "b.map"):
        (tmp_path / name).write_text("no map")
    path = written(('suite = "paper-15", count = 3', 'map = "a.map", count = 3'),
                   ('suite = "paper-15", count = 2', 'map = "b.map", count = 2'))
    with pytest.raises(InputError, match=r"training\.suites\.0: .*a\.map.*\n.*held_out\.suites\.0: .*b\.map"):
        set_up(load_job(path), path, tmp_path, quiet=True)


def test_constants_that_no_plan_depends_on_are_refused_where_only_plans_matter(written):
    objectives = '[[objectives]]\nmeasure = "expansions"\ndirection = "min"\n\n[method]'
    (line,) = told(written(("[method]", objectives), ('measure = "success"\nat_least = 0.95',
                                                      'measure = "expansions"\nat_most = 900.0')))
    assert line.startswith("parameters.clearance: has no effect where all that matters is known of a plan; must be ")


@pytest.mark.parametrize("side", [1e-30, 1e30])
def test_a_pixel_of_no_sensible_size_is_refused(written, tmp_path, side):
    Image.new("L", (20, 20), 255).save(tmp_path / "a.png")
    path = written(('suite = "paper-15", count = 3', f'map = "a.png", resolution = {side}, count = 3'))
    with pytest.raises(InputError, match=r"training\.suites\.0\.resolution: 1e.*; must be from 0\.001 to 100 m"):
        set_up(load_job(path), path, tmp_path, quiet=True)
