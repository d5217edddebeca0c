"""BARN worlds in one archive of grids."""

import csv

import jax
import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.formats import load_barn_folder, load_barn_grids


def written(folder, worlds=(7, 2), **arrays):
    """An archive in which world i has one occupied cell, column i of row 40, with path files beside it."""
    full = np.zeros((len(worlds), 30, 64), np.uint8)
    for place, world in enumerate(worlds):
        full[place, world, 40] = 1
        np.save(folder / f"path_{world}.npy", [[15, 0], [15, world]])
    arrays = {"world": np.array(worlds), "full": full} | arrays
    np.savez(folder / "grids.npz", **{name: array for name, array in arrays.items() if array is not None})
    return folder / "grids.npz"


def refusal(path):
    with pytest.raises(InputError) as caught:
        load_barn_grids(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.split("; ")) >= 3, "found; rule; remedy"
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


def test_worlds_come_in_the_archives_order_with_x_along_the_columns(tmp_path):
    (first, scenario), (second, _) = load_barn_grids(written(tmp_path))
    assert (first, second) == ("world_7", "world_2")
    expected = np.zeros((96, 30), bool)
    expected[40, 7] = True
    expected[64:, [0, 29]] = True
    np.testing.assert_array_equal(scenario.grid.occupied, expected)
    assert scenario.hidden.shape == (0, 0)
    # From (-2.25, 3) to (-2.325, 5.075), 7 cells on to (-2.325, 6.125), and to the goal (-2.25, 13).
    assert float(scenario.reference_length) == pytest.approx(np.hypot(0.075, 2.075) + 1.05 + np.hypot(0.075, 6.875))


def test_a_world_without_path_file_is_refused(tmp_path):
    path = written(tmp_path)
    (tmp_path / "path_2.npy").unlink()
    assert refusal(path).startswith(", world 2: no path file path_2.npy; ")


@pytest.mark.parametrize(("arrays", "found"), [
    ({"full": None}, "cannot be read"), ({"world": None}, "cannot be read"),
    ({"world": np.array([1.0, 2.0])}, "array 'world' is float64 of shape (2,)"),
    ({"world": np.array([1])}, "array 'full' is uint8 of shape (2, 30, 64)"),
    ({"full": np.zeros((2, 64, 30), np.uint8)}, "array 'full' is uint8 of shape (2, 64, 30)"),
    ({"full": np.full((2, 30, 64), 3)}, "or holds other values than 0 and 1"),
    ({"full": np.zeros((2, 30, 64))}, "array 'full' is float64"),
    ({"world": np.array([7, 7])}, "world 7 is there twice"),
    ({"world": np.zeros(0, int), "full": np.zeros((0, 30, 64), int)}, "array 'world' is int64 of shape (0,)"),
    ({"full": np.array([None, {}])}, "cannot be read")])
def test_other_archives_are_refused(tmp_path, arrays, found):
    assert found in refusal(written(tmp_path, **arrays))


def test_what_is_no_archive_is_refused(tmp_path):
    (tmp_path / "grids.npz").write_text("0 1 1 0")
    assert "cannot be read" in refusal(tmp_path / "grids.npz")
    np.save(tmp_path / "one.npy", np.zeros((30, 64)))
    assert "cannot be read" in refusal(tmp_path / "one.npy")
    assert "no such file" in refusal(tmp_path / "none.npz")
    path = written(tmp_path)
    path.write_bytes(path.read_bytes()[:-40])
    assert "cannot be read" in refusal(path)


@pytest.mark.realdata
def test_grids_and_gazebo_worlds_are_the_same_scenarios(data_folder):
    by_name = dict(load_barn_grids(data_folder / "barn" / "grids.npz"))
    for name, from_world in load_barn_folder(data_folder / "barn" / "world_files"):
        for one, other in zip(jax.tree.leaves(by_name[name]), jax.tree.leaves(from_world), strict=True):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)


@pytest.mark.realdata
def test_all_worlds_have_the_reference_lengths_of_the_benchmark(data_folder):
    with (data_folder / "barn" / "worlds.csv").open() as file:
        listed = {f"world_{row['world']}": float(row["path_len_run_py_m"]) for row in csv.DictReader(file)}
    found = {name: float(each.reference_length) for name, each in load_barn_grids(data_folder / "barn" / "grids.npz")}
    assert len(found) == 125
    assert found == pytest.approx(listed, abs=1e-4)
