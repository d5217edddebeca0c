"""BARN worlds, their task and their reference paths."""

import csv
import gzip
import math

import numpy as np
import pytest

from adwa_jax.astar import Status
from scenarios.errors import InputError
from scenarios.formats import barn_world, load_barn_folder, load_barn_scenario, load_barn_world, load_map
from scenarios.formats.barn_world import fill_enclosed, lattice, reference_length
from tuning.planning import plan_paths, planner_constants, planner_options

MODEL = """<model name='{name}'><static>1</static><pose frame=''>{x} {y} 0 0 0 0</pose><link name='link'>
<collision name='collision'><geometry>{shape}</geometry></collision>
<visual name='visual'><geometry><box><size>9 9 9</size></box></geometry></visual></link></model>"""
CYLINDER = "<cylinder><radius>{radius}</radius><length>1</length></cylinder>"
GROUND = MODEL.format(name="ground_plane", x=0, y=0, shape="<plane><normal>0 0 1</normal></plane>")


def model(x, y, radius=0.075, shape=CYLINDER, name="unit_cylinder_0"):
    return MODEL.format(name=name, x=x, y=y, shape=shape.format(radius=radius))


def world_text(*models):
    state = "<state world_name='default'><model name='unit_cylinder_0'><pose>9 9 0 0 0 0</pose></model></state>"
    return f"<sdf version='1.6'><world name='default'>{GROUND}{''.join(models)}{state}</world></sdf>"


def at(row, column):
    return model(-4.425 + 0.15 * column, 0.075 + 0.15 * row)


def written(path, *models):
    path.write_text(world_text(*models))
    return path


def saved_path(path, cells):
    np.save(path, np.array(cells))
    return path


def refusal(loader, path):
    with pytest.raises(InputError) as caught:
        loader(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.split("; ")) >= 3, "found; rule; remedy"
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


def test_cylinders_are_cells_of_the_lattice(tmp_path):
    read = load_barn_world(written(tmp_path / "world_0.world", at(0, 0), at(63, 29), at(40, 7)))
    expected = np.zeros((64, 30), bool)
    expected[[0, 63, 40], [0, 29, 7]] = True
    np.testing.assert_array_equal(read.occupied, expected)
    assert not read.unknown.any()
    assert (read.resolution, read.origin, read.yaw, read.y_down) == (0.15, (-4.5, 0.0), 0.0, False)


def test_a_packed_world_is_the_same_world(tmp_path):
    plain = written(tmp_path / "world_0.world", at(40, 7))
    packed = tmp_path / "world_0.world.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    np.testing.assert_array_equal(load_map(packed).occupied, load_map(plain).occupied)


def test_enclosed_cells_are_filled_and_a_diagonal_gap_lets_nothing_in():
    cylinders = np.zeros((64, 30), bool)
    for row, column in [(10, 4), (11, 3), (12, 3), (11, 5), (12, 5), (13, 4)]:
        cylinders[row, column] = True
    filled = fill_enclosed(cylinders)
    np.testing.assert_array_equal(np.argwhere(filled & ~cylinders), [[11, 4], [12, 4]])
    cylinders[10, 4] = False
    np.testing.assert_array_equal(fill_enclosed(cylinders), cylinders)


def test_the_last_row_is_open_to_the_ground_beyond():
    cylinders = np.zeros((64, 30), bool)
    cylinders[63, [3, 5]] = cylinders[62, 4] = True
    np.testing.assert_array_equal(fill_enclosed(cylinders), cylinders)


def test_the_entry_stays_free_where_a_wall_closes_the_way_out():
    cylinders = np.zeros((64, 30), bool)
    cylinders[0] = cylinders[40] = cylinders[:41, 0] = cylinders[:41, 29] = True
    np.testing.assert_array_equal(fill_enclosed(cylinders), cylinders)


@pytest.mark.parametrize(("x", "y"), [(-4.425, 9.675), (0.075, 0.075), (-4.575, 0.075), (-4.4, 0.075), (-4.425, 0.15),
                                      (1e9, 0.075)])
def test_a_cylinder_off_the_lattice_is_refused(tmp_path, x, y):
    message = refusal(load_barn_world, written(tmp_path / "world_0.world", at(1, 1), model(x, y)))
    assert message.startswith(f": cylinder at ({x:g}, {y:g}); ")


def test_poses_of_six_digits_lie_on_the_lattice():
    assert lattice(np.array([[-0.075001, 9.524999]]), "here")[63, 29]


@pytest.mark.parametrize(("foreign", "found"), [
    (model(0, 0, radius=0.5), "model 'unit_cylinder_0' of radius 0.5 m"),
    (model(0, 0, shape="<box><size>1 1 1</size></box>", name="crate"), "model 'crate' of box"),
    (model(0, 0, shape="", name="ghost"), "model 'ghost' of no collision shape"),
    (model("x", 0), "model 'unit_cylinder_0' with pose or radius 'x 0 0 0 0 0'"),
    (model("nan", 0), "model 'unit_cylinder_0' with pose or radius 'nan 0 0 0 0 0'"),
    ("<include><uri>model://house</uri></include>", "include 'model://house'")])
def test_what_is_no_barn_cylinder_is_refused(tmp_path, foreign, found):
    path = written(tmp_path / "world_0.world", at(1, 1), foreign)
    assert refusal(load_barn_world, path).startswith(f": {found}; ")


def test_included_ground_and_sun_are_no_obstacles(tmp_path):
    extras = "<include><uri>model://ground_plane</uri></include><include><uri>model://sun</uri></include>"
    assert load_barn_world(written(tmp_path / "world_0.world", extras, at(1, 1))).occupied.sum() == 1


@pytest.mark.parametrize(("name", "content", "found"), [
    ("w.world", b"", "0 bytes"), ("w.world", world_text(at(1, 1)).encode()[:-9], ":5: is not XML"),
    ("w.world", b"<?xml version='1.0' encoding='none'?><sdf/>", "is not XML"),
    ("w.world", b"<sdf/>", "no <world> element"), ("w.world", world_text().encode(), "no model"),
    ("w.world.gz", b"<sdf/>", "cannot be unpacked"),
    ("w.world.gz", gzip.compress(b"<sdf/>", mtime=0)[:-5], "cannot be unpacked"),
    ("w.world.gz", gzip.compress(b"<sdf/>", mtime=0)[:10] + b"\xff\xff\xff", "cannot be unpacked")])
def test_a_broken_world_file_is_refused(tmp_path, name, content, found):
    (tmp_path / name).write_bytes(content)
    assert found in refusal(load_barn_world, tmp_path / name)


def test_a_missing_world_is_refused(tmp_path):
    assert "no such file" in refusal(load_barn_world, tmp_path / "world_3.world")


def test_the_task_has_its_goal_on_free_ground_between_continued_walls(tmp_path):
    scenario = load_barn_scenario(written(tmp_path / "world_0.world", at(0, 0), at(63, 9)))
    expected = np.zeros((96, 30), bool)
    expected[[0, 63], [0, 9]] = True
    expected[64:, [0, 29]] = True
    np.testing.assert_array_equal(scenario.grid.occupied, expected)
    assert (scenario.grid.height, scenario.grid.width) == (96, 30)
    np.testing.assert_array_equal(scenario.start, np.array([-2.25, 3.0, math.pi / 2], np.float32))
    np.testing.assert_array_equal(scenario.goal, np.array([-2.25, 13.0], np.float32))
    assert (scenario.goal_tolerance, scenario.time_limit, scenario.reference_length) == (1.0, 100.0, 0.0)
    assert scenario.heading_given
    assert len(scenario.squares.valid) == len(scenario.movers.valid) == 0


def test_reference_length_runs_from_start_through_the_path_to_the_goal(tmp_path):
    # Cell (15, 0) lies at (-2.325, 5.075), cell (15, 20) at (-2.325, 8.075).
    path = saved_path(tmp_path / "path_0.npy", [[15, 0], [15, 20]])
    expected = math.hypot(0.075, 2.075) + 3.0 + math.hypot(0.075, 4.925)
    assert reference_length(path) == pytest.approx(expected, rel=1e-12)
    world = written(tmp_path / "world_0.world", at(1, 1))
    assert load_barn_scenario(world, path).reference_length == np.float32(expected)


@pytest.mark.parametrize("cells", [[1, 2, 3], [[1, 2, 3]], np.zeros((0, 2)), [[math.nan, 1.0]], [["a", "b"]]])
def test_a_path_file_of_another_shape_is_refused(tmp_path, cells):
    assert "a BARN path file is an" in refusal(reference_length, saved_path(tmp_path / "path_0.npy", cells))


def test_a_path_file_that_is_no_array_is_refused(tmp_path):
    path = tmp_path / "path_0.npy"
    path.write_text("1 2\n")
    assert "cannot be read" in refusal(reference_length, path)
    np.save(path, np.array([{"a": 1}]), allow_pickle=True)
    assert "cannot be read" in refusal(reference_length, path)
    np.save(path, np.array([[1, 2]]))
    path.write_bytes(path.read_bytes().replace(b"}", b"(", 1))
    assert "cannot be read" in refusal(reference_length, path)
    assert "no such file" in refusal(reference_length, tmp_path / "none.npy")


@pytest.mark.parametrize("where", ["worlds", "worlds/path_files", "path_files"])
def test_a_folder_is_read_in_natural_order_with_its_path_files(tmp_path, where):
    worlds, paths = tmp_path / "worlds", tmp_path / where
    worlds.mkdir()
    paths.mkdir(exist_ok=True)
    for number in (10, 2):
        written(worlds / f"world_{number}.world", at(number, 0))
        saved_path(paths / f"path_{number}.npy", [[15, 0], [15, number]])
    (worlds / "notes.txt").write_text("not a world")
    suite = load_barn_folder(worlds)
    assert [name for name, _ in suite] == ["world_2", "world_10"]
    assert [bool(scenario.grid.occupied[number, 0]) for number, (_, scenario) in zip((2, 10), suite, strict=True)] == [
        True, True]
    assert all(scenario.reference_length > 10.0 for _, scenario in suite)


def test_a_folder_without_worlds_or_path_files_is_refused(tmp_path):
    assert "no .world or .world.gz file" in refusal(load_barn_folder, tmp_path)
    assert "no such folder" in refusal(load_barn_folder, tmp_path / "none")
    world = written(tmp_path / "world_3.world", at(1, 1))
    with pytest.raises(InputError, match=r"world_3\.world: no path file path_3\.npy; .*; put path_3\.npy there"):
        load_barn_folder(tmp_path)
    world.rename(tmp_path / "first.world")
    with pytest.raises(InputError, match=r"first\.world: no number in the name; .*; rename the world"):
        load_barn_folder(tmp_path)


def test_a_world_that_is_there_twice_is_refused(tmp_path):
    plain = written(tmp_path / "world_3.world", at(1, 1))
    (tmp_path / "world_3.world.gz").write_bytes(gzip.compress(plain.read_bytes()))
    with pytest.raises(InputError, match="world_3 is there twice"):
        load_barn_folder(tmp_path)


@pytest.mark.realdata
@pytest.mark.parametrize("world", [0, 1])
def test_real_worlds_are_the_grids_of_the_benchmark(data_folder, world):
    grids = np.load(data_folder / "barn" / "grids.npz")
    full = grids["full"][list(grids["world"]).index(world)]
    read = load_map(data_folder / "barn" / "world_files" / f"world_{world}.world.gz")
    np.testing.assert_array_equal(read.occupied, full.T.astype(bool))


@pytest.mark.realdata
def test_filling_the_cylinders_gives_the_grids_of_all_worlds(data_folder):
    grids, cylinders = (np.load(data_folder / "barn" / name) for name in ("grids.npz", "cylinders.npz"))
    full = grids["full"].astype(bool)
    for world, expected in zip(grids["world"], full, strict=True):
        filled = fill_enclosed(lattice(cylinders[f"w{world}"], f"world {world}"))
        np.testing.assert_array_equal(filled, expected.T, err_msg=f"world {world}")


@pytest.mark.realdata
def test_reference_lengths_are_those_of_the_run_script(data_folder):
    with (data_folder / "barn" / "worlds.csv").open() as file:
        listed = {row["world"]: float(row["path_len_run_py_m"]) for row in csv.DictReader(file)}
    assert len(listed) == 125
    for world, length in listed.items():
        path = data_folder / "barn" / "path_files" / f"path_{world}.npy"
        assert reference_length(path) == pytest.approx(length, abs=1e-4), world


@pytest.mark.realdata
def test_the_real_folder_is_a_suite(data_folder):
    suite = load_barn_folder(data_folder / "barn" / "world_files")
    assert [(name, round(float(scenario.reference_length), 4)) for name, scenario in suite] == [
        ("world_0", 13.5923), ("world_1", 12.4312)]


@pytest.mark.realdata
def test_every_world_has_a_path_from_start_to_goal_for_a_robot_of_30_cm(data_folder):
    worlds = np.load(data_folder / "barn" / "grids.npz")["full"].astype(bool)
    assert len(worlds) == 125
    query = np.array([[barn_world.START[:2], barn_world.GOAL]])
    for world in worlds:
        grid = barn_world.task_grid(world.T)
        (answer,) = plan_paths(grid, query, planner_constants(robot_radius=0.30), planner_options("improved"))
        assert answer.status == Status.FOUND
        assert answer.length > 9.9
