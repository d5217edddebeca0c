from dataclasses import replace

import pytest

from adwa_jax.presets import extended, on_robot
from scenarios.errors import InputError
from tuning.options import Vehicle, configured
from tuning.robot_file import load_robot

ROBOT = extended().constants.robot


def written(folder, text):
    path = folder / "robot.toml"
    path.write_text(text)
    return path


def test_what_is_left_out_is_as_the_robot_has_it(tmp_path):
    path = written(tmp_path, "radius = 0.2\nv_max = 0.6\n")
    assert load_robot(path, ROBOT) == replace(ROBOT, radius=0.2, v_max=0.6)


def test_a_robot_may_have_several_discs(tmp_path):
    path = written(tmp_path, "radius = 0.2\ndisc_offsets = [-0.1, 0.1]\n")
    assert load_robot(path, ROBOT).disc_offsets == (-0.1, 0.1)


def test_the_preset_drives_the_robot_and_a_speed_has_the_last_word(tmp_path):
    path = written(tmp_path, "radius = 0.2\nv_max = 0.6\n")
    expected = on_robot(extended(), replace(ROBOT, radius=0.2, v_max=0.5))
    assert configured("extended", Vehicle(str(path), v_max=0.5)) == expected


@pytest.mark.parametrize(("text", "told"), [
    ("radius = ", r"not TOML \(.*\); a file of robot limits \(TOML\) is expected; write lines such as: radius = 0.2"),
    ("size = 1.0", "size: unknown key; the keys are radius, .*; remove or rename it"),
    ('radius = "0.2"', "radius = '0.2'; must be a number, at most 10000; correct it"),
    ("v_max = nan", "v_max = nan; must be a number, at most 10; correct it"),
    ("v_max = 10.5", "v_max = 10.5; must be a number, at most 10; correct it"),
    ("v_max = 0.0", "v_max = 0: must be positive; set it in SI units"),
    ("v_min = 2.0", r"v_min = 2: must not exceed v_max = 1; lower it"),
    ("disc_offsets = 0.1", r"disc_offsets = 0.1; must be a list of one number or more; write them in brackets"),
    ("disc_offsets = [0.1]", r"disc_offsets = \(0.1,\): a single disc is centred on the robot; set it to \(0.0,\)"),
    ("disc_offsets = []", r"disc_offsets = \[\]; must be a list of one number or more; write them in brackets"),
])  # fmt: skip
def test_what_no_robot_can_be_is_one_line(tmp_path, text, told):
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=rf"^{path}: {told}$"):
        load_robot(path, ROBOT)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone.toml: no such file; .*; check the name and folder"):
        configured("extended", Vehicle(str(tmp_path / "gone.toml")))
