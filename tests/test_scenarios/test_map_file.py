"""MapFile: unknown-cell policies, the turned frame, and reading any map by its suffix."""

import math

import numpy as np
import pytest
from PIL import Image

from scenarios.errors import InputError
from scenarios.formats import MapFile, load_map


def map_file(occupied, unknown=None, **fields):
    occupied = np.array(occupied, bool)
    unknown = np.zeros_like(occupied) if unknown is None else np.array(unknown, bool)
    return MapFile(**{"name": "toy", "occupied": occupied, "unknown": unknown, "resolution": 0.5,
                      "origin": (1.0, -2.0), **fields})


def test_grid_holds_the_map_unpadded_in_exact_numpy_dtypes():
    grid = map_file([[0, 0, 1], [0, 0, 0]]).grid()
    leaves = {name: (value.dtype.name, value.shape) for name, value in vars(grid).items()}
    assert leaves == {"occupied": ("bool", (2, 3)), "height": ("int32", ()), "width": ("int32", ()),
                      "resolution": ("float32", ()), "origin": ("float32", (2,))}
    assert all(isinstance(value, np.ndarray) for value in vars(grid).values())
    assert (grid.height, grid.width, grid.resolution) == (2, 3, 0.5)
    np.testing.assert_array_equal(grid.origin, [1.0, -2.0])
    np.testing.assert_array_equal(grid.occupied, [[False, False, True], [False, False, False]])


@pytest.mark.parametrize(("policy", "expected"), [("occupied", [1, 1, 0]), ("free", [1, 0, 0])])
def test_unknown_cells_count_as_the_user_says(policy, expected):
    grid = map_file([[1, 0, 0]], [[0, 1, 0]]).grid(unknown=policy)
    np.testing.assert_array_equal(grid.occupied[0], np.array(expected, bool))


def test_unknown_share_is_of_all_cells():
    assert map_file([[1, 0, 0, 0]], [[0, 1, 0, 0]]).unknown_share == 0.25


def test_another_unknown_policy_is_refused():
    with pytest.raises(InputError, match=r"unknown: 'maybe'; .*'occupied' or as 'free'"):
        map_file([[0]]).grid(unknown="maybe")


def test_a_map_without_a_free_cell_is_refused_and_unknown_cells_are_named_as_the_cause():
    only_unknown = map_file([[1, 0]], [[0, 1]])
    with pytest.raises(InputError, match=r"toy: no free cell among 1 x 2, 1 of them unknown .*count as free"):
        only_unknown.grid()
    assert not only_unknown.grid(unknown="free").occupied.all()
    with pytest.raises(InputError, match=r"toy: no free cell among 1 x 2; .*check the map"):
        map_file([[1, 1]]).grid()


@pytest.mark.parametrize("resolution", [0.0, -1.0, math.nan, math.inf, 1e-60])
def test_a_resolution_that_is_no_length_is_refused(resolution):
    with pytest.raises(InputError, match=r"toy, resolution: .*; must be a finite number above 0"):
        map_file([[0]], resolution=resolution)


def test_masks_that_disagree_are_refused():
    with pytest.raises(ValueError, match="cannot be both"):
        map_file([[1]], [[1]])
    with pytest.raises(ValueError, match="one shape"):
        map_file([[1]], [[0, 0]])


def test_without_yaw_both_frames_are_one():
    points = np.array([[3.0, 4.0], [0.0, -1.0]])
    np.testing.assert_array_equal(map_file([[0]]).to_grid_frame(points), points)
    np.testing.assert_array_equal(map_file([[0]]).to_world(points), points)


def test_a_quarter_turn_about_the_origin_corner():
    turned = map_file([[0]], origin=(1.0, 1.0), yaw=math.pi / 2)
    # The map's x axis points along the world's y axis: 2 m up in the world is 2 m along the rows' x.
    np.testing.assert_allclose(turned.to_grid_frame(np.array([1.0, 3.0])), [3.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(turned.to_world(np.array([[1.0, 3.0]])), [[-1.0, 1.0]], atol=1e-12)


def test_the_frames_are_inverse_for_any_yaw_and_shape():
    turned = map_file([[0]], yaw=0.7)
    points = np.arange(12.0).reshape(2, 3, 2)
    np.testing.assert_allclose(turned.to_world(turned.to_grid_frame(points)), points, atol=1e-12)


def test_load_map_chooses_the_format_by_suffix_whatever_its_case(tmp_path):
    (tmp_path / "a.MAP").write_text("type octile\nheight 1\nwidth 2\nmap\n.@\n")
    Image.fromarray(np.array([[255, 0]], np.uint8)).save(tmp_path / "b.PNG", format="png")
    (tmp_path / "c.yml").write_text("{image: b.PNG, resolution: 0.1, origin: [0, 0, 0], negate: 0, "
                                    "occupied_thresh: 0.65, free_thresh: 0.25}")
    assert [load_map(tmp_path / name).resolution for name in ("a.MAP", "b.PNG", "c.yml")] == [1.0, 1.0, 0.1]
    assert load_map(tmp_path / "b.PNG", resolution=0.2).resolution == 0.2
    assert load_map(tmp_path / "a.MAP").y_down
    assert not load_map(tmp_path / "b.PNG").y_down


@pytest.mark.parametrize(("name", "found"), [("m.txt", "suffix '.txt'"), ("m", "no suffix"),
                                             ("m.map.gz", "suffix '.gz'")])
def test_an_unknown_suffix_is_refused_with_the_known_ones(tmp_path, name, found):
    with pytest.raises(InputError) as refusal:
        load_map(tmp_path / name)
    assert str(refusal.value).startswith(f"{tmp_path / name}: {found}; a map file ends in .map .yaml .yml .world "
                                         ".world.gz .png .pgm")


def test_a_folder_is_no_map(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        load_map(tmp_path)
