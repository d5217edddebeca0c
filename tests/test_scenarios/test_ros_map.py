"""ROS map_server maps against hand-computed values and Nav2's own oracle."""

import json

import numpy as np
import pytest
from PIL import Image

from scenarios.errors import InputError
from scenarios.formats import load_map, load_ros_map

FIELDS = {"image": "m.png", "resolution": "0.05", "origin": "[1.0, -2.0, 0.5]", "negate": "0",
          "occupied_thresh": "0.65", "free_thresh": "0.196"}


def yaml_file(tmp_path, **changes):
    """A map YAML with some fields changed; None leaves one out."""
    path = tmp_path / "m.yaml"
    fields = {name: value for name, value in {**FIELDS, **changes}.items() if value is not None}
    path.write_text("".join(f"{name}: {value}\n" for name, value in fields.items()))
    return path


def ros_map(tmp_path, pixels, **changes):
    Image.fromarray(np.array(pixels, np.uint8)).save(tmp_path / "m.png")
    return load_ros_map(yaml_file(tmp_path, **changes))


def refusal(path):
    with pytest.raises(InputError) as caught:
        load_ros_map(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.split("; ")) >= 3, "found; rule; remedy"
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


def test_metadata_and_turned_rows(tmp_path):
    read = ros_map(tmp_path, [[0, 254], [205, 254]])
    np.testing.assert_array_equal(read.occupancy, [[-1, 0], [100, 0]])
    np.testing.assert_array_equal(read.occupied, [[False, False], [True, False]])
    np.testing.assert_array_equal(read.unknown, [[True, False], [False, False]])
    assert (read.resolution, read.origin, read.yaw, read.y_down) == (0.05, (1.0, -2.0), 0.5, False)
    assert read.occupancy is not None
    assert read.occupancy.dtype == np.int8


def test_grey_205_is_unknown_at_free_thresh_0_196_and_free_at_0_25(tmp_path):
    assert ros_map(tmp_path, [[205]], free_thresh="0.196").unknown.all()
    assert not ros_map(tmp_path, [[205]], free_thresh="0.25").unknown.any()


@pytest.mark.parametrize(("value", "changes", "expected"), [
    # p = 102/255 = 0.4 and 51/255 = 0.2 exactly on a threshold.
    (153, {"occupied_thresh": "0.4"}, 100), (154, {"occupied_thresh": "0.4"}, -1),
    (204, {"free_thresh": "0.2"}, 0), (203, {"free_thresh": "0.2"}, -1),
    # Free is applied last, so it wins where both hold.
    (153, {"occupied_thresh": "0.4", "free_thresh": "0.4"}, 0),
    (255, {"negate": "1"}, 100), (0, {"negate": "true"}, 0), (255, {"negate": "no"}, 0),
    (0, {"mode": "Trinary"}, 100),
    # resolution and thresholds without a dot before the exponent are text to YAML 1.1, numbers to Nav2.
    (0, {"occupied_thresh": "65e-2", "resolution": "5e-2"}, 100)])
def test_trinary_thresholds(tmp_path, value, changes, expected):
    assert ros_map(tmp_path, [[value]], **changes).occupancy == expected


def test_scale_is_linear_between_the_thresholds(tmp_path):
    # p = 1, 0.6, 0.4, 0.2, 0: (p - 0.2)/0.6 of 100 between.
    read = ros_map(tmp_path, [[0, 102, 153, 204, 255]], mode="scale", occupied_thresh="0.8", free_thresh="0.2")
    np.testing.assert_array_equal(read.occupancy, [[100, 67, 33, 0, 0]])
    np.testing.assert_array_equal(read.occupied, [[True, False, False, False, False]])
    assert not read.unknown.any()


def test_scale_with_equal_thresholds_has_nothing_between(tmp_path):
    read = ros_map(tmp_path, [[0, 127, 128, 255]], mode="scale", occupied_thresh="0.5", free_thresh="0.5")
    np.testing.assert_array_equal(read.occupancy, [[100, 100, 0, 0]])


def test_raw_takes_0_to_100_as_they_are_and_occupied_from_the_threshold_on(tmp_path):
    read = ros_map(tmp_path, [[0, 64, 65, 100, 101, 255]], mode="raw", negate="1")
    np.testing.assert_array_equal(read.occupancy, [[0, 64, 65, 100, -1, -1]])
    np.testing.assert_array_equal(read.occupied, [[False, False, True, True, False, False]])
    np.testing.assert_array_equal(read.unknown, [[False, False, False, False, True, True]])


def test_raw_value_on_the_threshold_is_occupied_whatever_its_rounding(tmp_path):
    assert ros_map(tmp_path, [[7]], mode="raw", occupied_thresh="0.07", free_thresh="0").occupied.all()


@pytest.mark.parametrize(("mode", "expected"), [("trinary", [100, -1, 0]), ("scale", [100, -1, 0]),
                                                ("raw", [0, 0, -1])])
def test_transparent_pixels_are_unknown_in_trinary_and_scale(tmp_path, mode, expected):
    read = ros_map(tmp_path, [[[0, 0, 0, 255], [0, 0, 0, 254], [255, 255, 255, 255]]], mode=mode)
    np.testing.assert_array_equal(read.occupancy, [expected])


def test_colours_count_by_the_mean_of_their_channels(tmp_path):
    # Means 51 (p = 0.8) and 204 (p = 0.2).
    read = ros_map(tmp_path, [[[153, 0, 0], [255, 255, 102]]], occupied_thresh="0.8", free_thresh="0.2")
    np.testing.assert_array_equal(read.occupancy, [[100, 0]])


@pytest.mark.parametrize("field", sorted(FIELDS))
def test_a_missing_field_is_named(tmp_path, field):
    message = refusal(yaml_file(tmp_path, **{field: None}))
    assert message.startswith(f": field '{field}' is missing; ")
    assert message.endswith(f"add a line '{field}: ...'")


@pytest.mark.parametrize(("changes", "found"), [
    ({"resolution": ".nan"}, ", resolution: nan; must be a finite number above 0"),
    ({"resolution": "nan"}, ", resolution: 'nan'; "), ({"resolution": ".inf"}, ", resolution: inf; "),
    ({"resolution": "0"}, ", resolution: 0; "), ({"resolution": "-0.05"}, ", resolution: -0.05; "),
    ({"resolution": "wide"}, ", resolution: 'wide'; "), ({"resolution": "true"}, ", resolution: True; "),
    ({"resolution": "[0.05]"}, ", resolution: [0.05]; "), ({"resolution": ""}, ", resolution: None; "),
    ({"origin": "[0, 0]"}, ", origin: [0, 0]; must be three finite numbers"),
    ({"origin": "[0, 0, .nan]"}, ", origin: nan; "), ({"origin": "0"}, ", origin: 0; "),
    ({"occupied_thresh": "1.5"}, ", occupied_thresh: 1.5; must be a number from 0 to 1"),
    ({"free_thresh": "-0.1"}, ", free_thresh: -0.1; must be a number from 0 to 1"),
    ({"free_thresh": "low"}, ", free_thresh: 'low'; must be a number from 0 to 1"),
    ({"free_thresh": "0.7"}, ", free_thresh: 0.7; must be at most occupied_thresh 0.65"),
    ({"mode": "binary"}, ", mode: 'binary'; must be one of trinary, scale, raw"), ({"mode": "3"}, ", mode: 3; "),
    ({"negate": "2"}, ", negate: 2; must be 0 or 1"), ({"negate": "0.5"}, ", negate: 0.5; "),
    ({"image": "none.png"}, ", image: 'none.png'; there is no file "), ({"image": '""'}, ", image: ''; "),
    ({"image": "[m.png]"}, ", image: ['m.png']; must be the name of an image file"),
])
def test_a_bad_field_is_refused_with_its_value(tmp_path, changes, found):
    Image.fromarray(np.array([[255]], np.uint8)).save(tmp_path / "m.png")
    assert refusal(yaml_file(tmp_path, **changes)).startswith(found)


@pytest.mark.parametrize(("content", "where", "found"), [
    ("", "", "0 bytes"), ("just words", "", "holds 'just words'; a ROS map YAML is a list of lines"),
    ("[1, 2]", "", "holds [1, 2]"), ("# nothing", "", "holds None"),
    ("image: m.png\nresolution: [0.05\norigin: 1\n", ":3", "is not YAML ("),
    ("image: m.png\n\tresolution: 1\n", ":2", "is not YAML ("),
    ("image: m.png\nresolution: 2020-99-99\n", "", "is not YAML"),
    ("[" * 5000, "", "is not YAML"), ("image: \0\n", "", "byte 7 is not text"),
])
def test_what_is_not_a_yaml_mapping_is_refused(tmp_path, content, where, found):
    path = tmp_path / "m.yaml"
    path.write_text(content)
    message = refusal(path)
    assert message.startswith(f"{where}: ")
    assert found in message


def test_a_missing_yaml_and_a_folder_are_refused(tmp_path):
    assert "no such file" in refusal(tmp_path / "none.yaml")
    assert "is a folder" in refusal(tmp_path)


def test_a_bad_image_is_named_itself(tmp_path):
    yaml_path = yaml_file(tmp_path)
    Image.fromarray(np.array([[300]], np.uint16)).save(tmp_path / "m.png")
    with pytest.raises(InputError, match=r"m\.png: more than 8 bits a channel .*; convert it to 8-bit grey"):
        load_ros_map(yaml_path)
    (tmp_path / "m.png").write_text("no picture")
    with pytest.raises(InputError, match=r"m\.png: cannot be read as an image"):
        load_ros_map(yaml_path)


@pytest.mark.realdata
@pytest.mark.parametrize("image", ["testmap.png", "testmap.pgm"])
def test_nav2_oracle_is_met_cell_for_cell(data_folder, tmp_path, image):
    folder = data_folder / "ros_maps" / "nav2_testmap"
    expected = json.loads((folder / "EXPECTED.json").read_text())
    text = (folder / "testmap.yaml").read_text().replace("testmap.png", str(folder / image))
    (tmp_path / "m.yaml").write_text(text)
    read = load_map(tmp_path / "m.yaml")
    shape = expected["height"], expected["width"]
    np.testing.assert_array_equal(read.occupancy, np.reshape(expected["data_row_major_lower_left_first"], shape))
    assert (read.resolution, [*read.origin, read.yaw]) == (expected["resolution"], expected["origin"])


@pytest.mark.realdata
def test_nav2_invalid_image_is_refused(data_folder):
    assert "'invalid.png'" in refusal(data_folder / "ros_maps" / "nav2_testmap" / "invalid_image.yaml")


@pytest.mark.realdata
def test_every_real_map_loads_with_a_free_cell(data_folder):
    paths = [path for path in (data_folder / "ros_maps").glob("*/*.yaml") if path.name != "invalid_image.yaml"]
    shares = {path.parent.name + "/" + path.stem: load_map(path).unknown_share for path in paths
              if not load_map(path).grid().occupied.all()}
    assert len(shares) == len(paths) >= 10
    assert shares["nav2/depot"] == 0.0
    assert shares["turtlebot3/map"] == pytest.approx(0.94, abs=0.005)
