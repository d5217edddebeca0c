from dataclasses import replace

import pytest

from adwa_jax.presets import extended, jackal, on_robot, paper
from scenarios.errors import InputError
from tuning.options import Vehicle, configured, reach_of, require_one_disc


def test_without_options_the_preset_stays_as_it_is():
    assert configured("paper", Vehicle()) == paper()
    assert configured("extended", Vehicle()) == extended()


def test_a_robot_and_its_speed_are_set_together():
    config = configured("extended", Vehicle("jackal", v_max=0.5, sensor_range=2.5))
    expected = on_robot(extended(), replace(jackal(), v_max=0.5))
    behaviour = replace(expected.constants.behaviour, sensor_range=2.5)
    assert config == expected._replace(constants=replace(expected.constants, behaviour=behaviour))


def test_a_speed_alone_keeps_the_presets_robot():
    config = configured("paper", Vehicle(v_max=0.6))
    assert config.constants.robot == replace(paper().constants.robot, v_max=0.6)


def test_a_weights_file_has_the_last_word(tmp_path):
    (tmp_path / "weights.toml").write_text("lookahead = 1.25\nclearance_margin = 0.5\n")
    config = configured("extended", Vehicle("jackal"), tmp_path / "weights.toml")
    assert (config.constants.behaviour.lookahead, config.constants.behaviour.clearance_margin) == (1.25, 0.5)


@pytest.mark.parametrize(("vehicle", "option"), [
    ({"robot": "tank"}, "--robot: 'tank'; the robots are disc, jackal; "),
    ({"v_max": 0.0}, "--v-max: 0; must be above 0"), ({"v_max": 10.5}, "--v-max: 10.5; "),
    ({"v_max": float("nan")}, "--v-max: nan; "), ({"sensor_range": 0.0}, "--sensor-range: 0; "),
    ({"sensor_range": float("inf")}, "--sensor-range: inf; "),
])  # fmt: skip
def test_what_no_robot_can_have_is_refused(vehicle, option):
    with pytest.raises(InputError) as caught:
        Vehicle(**vehicle)
    assert str(caught.value).startswith(option)


def test_the_disc_that_holds_a_robot():
    assert reach_of(paper().constants.robot) == 0.25
    assert reach_of(replace(paper().constants.robot, radius=0.2, disc_offsets=(-0.3, 0.1))) == pytest.approx(0.5)


def test_several_discs_are_refused_where_one_is_needed():
    require_one_disc("--feasible", paper())
    with pytest.raises(InputError, match=r"^--feasible: the robot has 2 discs; .*; choose --robot disc"):
        require_one_disc("--feasible", on_robot(extended(), jackal()))
