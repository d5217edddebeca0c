from dataclasses import fields, replace

import numpy as np
import pytest

from adwa_jax.constants import Options
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.presets import Preset, extended, paper, preset
from adwa_jax.rules import EVERY_RULE, Rules
from adwa_jax.score import ScoreWeights
from scenarios.errors import InputError
from tuning import weights_file
from tuning.weights_file import (
    COUNTS,
    MEANINGS,
    NEEDS,
    in_use,
    load_weight_rule,
    load_weights,
    parse_weight_rule,
    weights_text,
)

SCORE = {"local_heading": 0.4, "clearance": 0.25, "velocity": 0.6, "global_heading": 0}
RULE = {"dense_base": 0.5, "dense_gain": 0.5, "sparse_base": 1.25, "sparse_gain": 0.5}


@pytest.fixture
def written(tmp_path):
    def write(text="", **values):
        path = tmp_path / "weights.toml"
        path.write_text(text + "".join(f"{key} = {value}\n" for key, value in values.items()))
        return path

    return write


def refusal(path):
    with pytest.raises(InputError) as caught:
        load_weights(path, paper())
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message.removeprefix(str(path))


def test_score_weights_stand_in_for_the_presets_and_nothing_else_changes(written):
    loaded = load_weights(written(**SCORE), paper()).constants
    assert loaded.weights == ScoreWeights(0.4, 0.25, 0.6, 0.0)
    assert (loaded.weight_rule, loaded.robot, loaded.behaviour) == (
        paper().constants.weight_rule, paper().constants.robot, paper().constants.behaviour)  # fmt: skip


def test_the_rule_may_come_with_or_without_its_thresholds(written):
    loaded = load_weights(written(**SCORE, **RULE), paper()).constants
    assert loaded.weight_rule == WeightRule(0.5, 0.5, 1.25, 0.5, 1.5, 0.5)
    loaded = load_weights(written(**SCORE, **RULE, dense_ratio=2, sparse_ratio=0.25), paper()).constants
    assert loaded.weight_rule == WeightRule(0.5, 0.5, 1.25, 0.5, 2.0, 0.25)


@pytest.mark.parametrize("key", [*SCORE, *RULE])
def test_a_missing_key_is_named(written, key):
    values = {name: value for name, value in {**SCORE, **RULE}.items() if name != key}
    message = refusal(written(**values))
    assert message.startswith(f": {key}: missing;")
    assert message.endswith("add it")


def test_thresholds_alone_are_no_rule(written):
    assert "dense_base, dense_gain, sparse_base, sparse_gain: missing" in refusal(written(**SCORE, dense_ratio=1.5))


@pytest.mark.parametrize("text", ["clearence = 0.4\n", "[weights]\nclearance = 0.4\n"])
def test_an_unknown_key_is_named_with_the_known_ones(written, text):
    message = refusal(written(text=text))
    assert "unknown key" in message
    assert "local_heading, clearance" in message
    assert message.endswith("remove or rename it")


@pytest.mark.parametrize("value", ["nan", "inf", "-0.1", "1e300", "1" + "0" * 400, '"0.4"', "true", "[0.4]",
                                   "1979-05-27"])  # fmt: skip
@pytest.mark.parametrize("key", ["clearance", "sparse_gain"])
def test_a_value_that_is_no_weight_is_shown_with_its_key(written, key, value):
    message = refusal(written(**{**SCORE, **RULE, key: value}))
    assert message.startswith(f": {key} = ")
    assert "must be a" in message


@pytest.mark.parametrize(("values", "promise"), [
    ({"dense_base": 0.7}, "must be < 1, so that ω < 1 in dense areas (eq. 5)"),
    ({"sparse_base": 0.99}, "must be ≥ 1, so that ω > 1 in sparse areas (eq. 5)"),
    ({"sparse_base": 16.5}, "must be ≤ 16"),
    ({"dense_ratio": 0.4, "dense_base": 0.0, "dense_gain": 0.1}, "must not exceed dense_ratio"),
])  # fmt: skip
def test_a_rule_that_breaks_its_promise_is_refused_with_the_inequality(written, values, promise):
    message = refusal(written(**SCORE, **{**RULE, **values}))
    assert promise in message


def test_a_rule_that_breaks_its_promise_only_when_rounded_to_float32_is_refused(written):
    assert np.float32(0.99999999) == 1.0
    message = refusal(written(**SCORE, **{**RULE, "dense_base": 0.99999999, "dense_gain": 0}))
    assert "must be < 1" in message


@pytest.mark.parametrize("content", [b"clearance 0.4", b"clearance = 0.4\nclearance = 0.5\n",
                                     b"a = " + b"1" * 5000, b"a = " + b"[" * 100_000])  # fmt: skip
def test_what_is_not_toml_is_refused(tmp_path, content):
    path = tmp_path / "weights.toml"
    path.write_bytes(content)
    assert "write lines such as: clearance = 0.4" in refusal(path)


def beyond_paper(written, rules, **values):
    return load_weights(written(**values), preset(rules)).constants


def test_constants_of_the_rules_in_use_may_be_given_one_by_one(written):
    loaded = beyond_paper(written, EVERY_RULE, contact_time=2.5, lookahead=3, mover_margin=0.125)
    expected = extended().constants
    assert loaded == replace(expected, weights=replace(expected.weights, contact_time=2.5),
                             behaviour=replace(expected.behaviour, lookahead=3.0, mover_margin=0.125))  # fmt: skip


def test_distances_of_the_papers_method_may_be_given_too(written):
    loaded = load_weights(written(**SCORE, clearance_cap=0.75, clearance_margin=0.5), paper()).constants
    assert (loaded.behaviour.clearance_cap, loaded.behaviour.clearance_margin) == (0.75, 0.5)


@pytest.mark.parametrize(("key", "rule"), NEEDS.items())
def test_a_constant_without_its_rule_is_refused(written, key, rule):
    message = refusal(written(**SCORE, **{key: 0.5}))
    assert message == (f": {key}: without effect; the preset's rule '{rule}' is off; remove it, or choose "
                       "--preset extended")
    beyond_paper(written, Rules().only(rule), **({} if rule == "progress" else SCORE), **{key: 0.5})


def test_a_term_that_progress_replaces_is_refused(written):
    with pytest.raises(InputError, match=r"velocity: without effect; .* 'progress' .*; remove it"):
        beyond_paper(written, EVERY_RULE, velocity=0.5)


def test_weights_that_are_all_zero_are_refused(written):
    message = refusal(written(**dict.fromkeys(SCORE, 0)))
    assert message == (": local_heading, clearance, velocity, global_heading: all 0; at least one weight must be above "
                       "0; raise one")


def test_a_distance_that_must_be_positive_is_refused(written):
    assert refusal(written(**SCORE, clearance_cap=0)) == ": clearance_cap = 0: must be positive; raise it"


@pytest.mark.parametrize("rules", [Rules(), EVERY_RULE, Rules().only("reverse")])
def test_what_is_written_is_read_back_to_the_same_numbers(tmp_path, rules):
    constants, options = preset(rules)
    constants = replace(constants, weights=replace(constants.weights, clearance=1 / 3))
    options = replace(options, dwa=replace(options.dwa, v_samples=7))
    assert set(MEANINGS) == {*weights_file.SCORE, *weights_file.RULE, *weights_file.BEHAVIOUR, *COUNTS}
    text = weights_text(Preset(constants, options))
    assert all("  # " in line for line in text.splitlines())  # its meaning
    (tmp_path / "weights.toml").write_text(text)
    loaded, counts = load_weights(tmp_path / "weights.toml", Preset(paper().constants, Options(rules=rules)))
    assert all(getattr(counts.dwa, name) == getattr(options.dwa, name) for name in COUNTS)
    for part in ("weights", "weight_rule", "behaviour"):
        for field in fields(getattr(constants, part)):
            if in_use(field.name, rules):
                given, again = (np.float32(getattr(getattr(each, part), field.name)) for each in (constants, loaded))
                assert given == again, field.name


def test_counts_become_static_options(written):
    loaded = load_weights(written(**SCORE, v_samples=7, horizon_steps=15), paper())
    dwa = paper().options.dwa
    assert loaded.options == replace(paper().options, dwa=replace(dwa, v_samples=7, horizon_steps=15))


@pytest.mark.parametrize("value", ["1", "102", "7.0", "-3", "true", '"7"'])
def test_a_count_that_is_none_is_refused(written, value):
    message = refusal(written(**SCORE, v_samples=value))
    assert message.startswith(f": v_samples = {value}".replace('"', "'").replace("true", "True"))


@pytest.mark.parametrize("config", [paper(), extended()])
def test_the_rule_of_any_presets_file_is_read(tmp_path, config):
    (tmp_path / "weights.toml").write_text(weights_text(config).replace("dense_gain = 0.5", "dense_gain = 0.25"))
    assert load_weight_rule(tmp_path / "weights.toml") == replace(paper().constants.weight_rule, dense_gain=0.25)


def test_a_file_without_a_rule_has_none_to_read(written):
    with pytest.raises(InputError, match=r"no constant of eq\. 5; .*; add them$"):
        load_weight_rule(written(**SCORE))


def test_a_file_that_is_not_there_a_folder_and_a_picture_are_refused(tmp_path):
    assert "no such file" in refusal(tmp_path / "none.toml")
    assert "is a folder" in refusal(tmp_path)
    (tmp_path / "picture.toml").write_bytes(b"\x89PNG\r\n")
    assert "byte 0 is not text" in refusal(tmp_path / "picture.toml")


def test_a_rule_on_the_command_line():
    assert parse_weight_rule("0.5, 0.25,1.5,0.75") == WeightRule(0.5, 0.25, 1.5, 0.75)


@pytest.mark.parametrize("text", ["", "1,2,3", "0.5,0.5,1.2,0.6,1", "a,b,c,d", "0.5,nan,1.2,0.6", "0.5,-0.5,1.2,0.6",
                                  "0.5,0.5,inf,0.6", "0.9,0.9,1.2,0.6", "0.5,0.5,0.9,0.6"])  # fmt: skip
def test_a_bad_rule_on_the_command_line_is_refused(text):
    with pytest.raises(InputError, match=r"^--weight-rule: ") as caught:
        parse_weight_rule(text)
    assert "\n" not in str(caught.value)
