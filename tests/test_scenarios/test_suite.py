import io
import json
import os
import zipfile

import jax
import numpy as np
import pytest

from scenarios import suite as suite_module
from scenarios.errors import InputError
from scenarios.generators import paper
from scenarios.generators.assembly import grid_of
from scenarios.generators.crowd import CrowdSpec
from scenarios.suite import (
    SUITE_NAMES,
    Suite,
    load_suite,
    make_suite,
    save_suite,
    suite_from_barn_folder,
    suite_from_barn_grids,
    suite_from_dynabarn,
    suite_from_tracks,
    suite_on_map,
    without_maps,
)


def same_bits(one, other):
    leaves = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes() for a, b in leaves)


def mixed_suite():
    """Scenarios of every kind, hence of unequal sizes, some with tracks and some without."""
    parts = [make_suite(name, seed=5, count=2) for name in SUITE_NAMES]
    scenarios = tuple(scenario for part in parts for scenario in part.scenarios)
    return Suite("mixed", scenarios, tuple(name for part in parts for name in part.names), {"parts": [1, 2.5, None]})


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "some.suite"
    save_suite(make_suite("crowd", seed=3, count=4), path)
    return path


def rewritten(path, **changes):
    """The suite file with arrays replaced, or left out where None."""
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    arrays.update(changes)
    with open(path, "wb") as file:
        np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    return path


def rewritten_header(path, **changes):
    with np.load(path) as archive:
        header = json.loads(archive["header"].tobytes())
    return rewritten(path, header=np.frombuffer(json.dumps({**header, **changes}).encode(), np.uint8))


def refusal_of(path):
    with pytest.raises(InputError) as refusal:
        load_suite(path)
    message = str(refusal.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert message.count("; ") >= 2
    return message


# Making


@pytest.mark.parametrize("name", SUITE_NAMES)
def test_a_longer_suite_begins_with_the_shorter_one(name):
    short, long = make_suite(name, seed=9, count=3), make_suite(name, seed=9, count=5)
    assert short.names == long.names[:3]
    assert all(same_bits(a, b) for a, b in zip(short.scenarios, long.scenarios[:3], strict=True))
    assert not all(
        np.array_equal(a, b) for a, b in zip(*map(jax.tree.leaves, long.scenarios[3:]), strict=True)
    )


def test_scenario_i_comes_from_the_key_folded_with_i():
    suite = make_suite("paper-20", seed=4, count=3)
    expected = paper.generate(jax.random.fold_in(jax.random.key(4), 2), paper.PaperSpec(cells=20))
    assert same_bits(suite.scenarios[2], expected)


def test_seeds_make_different_suites():
    one, other = make_suite("paper-15", seed=0, count=1), make_suite("paper-15", seed=1, count=1)
    assert not same_bits(one.scenarios[0].grid, other.scenarios[0].grid)
    assert set(one.names).isdisjoint(other.names)


def test_the_recipe_says_how_the_suite_was_made():
    recipe = make_suite("paper-15", seed=2, count=3).recipe
    assert (recipe["suite"], recipe["generator"], recipe["seed"], recipe["count"]) == ("paper-15", "paper", 2, 3)
    assert (recipe["spec"]["cells"], recipe["spec"]["density"]) == (15, 0.2)
    assert recipe["package"]


def test_progress_is_told_after_each_scenario():
    told = []
    make_suite("crowd", seed=0, count=3, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (("paper-30", 0, 1), "suite: 'paper-30'; must be one of paper-15, paper-20, paper-25, blocks, rooms, maze"),
        (("barn", 0, 0), "count: 0; must be a whole number from 1"),
        (("barn", 0, 2.0), "count: 2.0"),
        (("barn", -1, 1), "seed: -1; must be a whole number from 0 to 4294967295"),
        (("barn", 2**32, 1), "seed: 4294967296"),
    ],
)
def test_suites_that_cannot_be_made_are_refused(arguments, found):
    with pytest.raises(InputError) as refusal:
        make_suite(*arguments)
    assert found in str(refusal.value)


def test_a_suite_on_a_map_shares_the_map_and_has_the_prefix_too(tmp_path):
    grid = grid_of(np.zeros((40, 60), np.bool_), 0.2, (1.0, -1.0))
    short = suite_on_map("hall", grid, seed=1, count=2, squares=2, movers=1)
    long = suite_on_map("hall", grid, seed=1, count=4, squares=2, movers=1)
    assert all(same_bits(a, b) for a, b in zip(short.scenarios, long.scenarios[:2], strict=True))
    assert len({id(scenario.grid) for scenario in long.scenarios}) == 1
    assert all(same_bits(scenario.grid, grid) for scenario in long.scenarios)
    save_suite(long, tmp_path / "hall")
    again = load_suite(tmp_path / "hall")
    assert len({id(scenario.grid) for scenario in again.scenarios}) == 1
    assert all(same_bits(a, b) for a, b in zip(again.scenarios, long.scenarios, strict=True))


def test_a_suite_on_a_map_refuses_bad_numbers():
    grid = grid_of(np.zeros((40, 60), np.bool_), 0.2)
    with pytest.raises(InputError, match="squares: -1; must be a whole number"):
        suite_on_map("hall", grid, seed=1, count=2, squares=-1)


def test_names_must_fit_the_scenarios():
    with pytest.raises(ValueError, match="names: 1; must be one for each of the 0 scenarios"):
        Suite("odd", (), ("one",), {})


@pytest.mark.realdata
def test_a_folder_of_barn_worlds_is_a_suite(data_folder):
    suite = suite_from_barn_folder(data_folder / "barn" / "world_files")
    assert len(suite.scenarios) == 2
    assert suite.recipe["count"] == 2
    assert all(scenario.reference_length > 0 for scenario in suite.scenarios)


@pytest.mark.realdata
def test_all_barn_worlds_make_a_suite_and_its_twin_without_maps(data_folder):
    known, sensed = (suite_from_barn_grids(data_folder / "barn" / "grids.npz", only) for only in (False, True))
    assert known.names == sensed.names
    assert len(known.names) == 125
    assert (known.name, sensed.name) == ("barn-grids", "barn-grids-sensed")
    for one, other in zip(known.scenarios, sensed.scenarios, strict=True):
        assert one.hidden.shape == (0, 0)
        np.testing.assert_array_equal(other.hidden, one.grid.occupied)
        assert not other.grid.occupied.any()
        assert other.reference_length == one.reference_length > 0


KEY_FRAMES = """world,obstacle,period_s,t_s,x_m,y_m
4,0,10,0,-10,0
4,0,10,10,5,8
22,0,5,0,3,-10
22,0,5,5,3,10
22,1,7,0,0,-10
22,1,7,7,3,9
"""


@pytest.fixture
def key_frames(tmp_path):
    path = tmp_path / "keyframes.csv"
    path.write_text(KEY_FRAMES)
    return path


def test_each_dynabarn_world_begins_at_its_beginning_and_then_at_other_times(key_frames):
    short, long = (suite_from_dynabarn(key_frames, seed=1, starts=starts) for starts in (2, 4))
    assert short.names == ("world_4-tier1-start00", "world_22-tier2-start00", "world_4-tier1-start01",
                           "world_22-tier2-start01")
    assert short.names == long.names[:4]
    assert all(same_bits(a, b) for a, b in zip(short.scenarios, long.scenarios[:4], strict=True))
    np.testing.assert_array_equal(short.scenarios[0].movers.position, [[-10.0, 0.0]])
    np.testing.assert_array_equal(short.scenarios[1].movers.position, [[3.0, -10.0], [0.0, -10.0]])
    beginnings = {tuple(scenario.movers.position[0].tolist()) for scenario in long.scenarios[::2]}
    assert len(beginnings) == 4
    other = suite_from_dynabarn(key_frames, seed=2, starts=2)
    assert same_bits(other.scenarios[0], short.scenarios[0])
    assert not same_bits(other.scenarios[2], short.scenarios[2])


def test_dynabarn_refuses_bad_numbers(key_frames):
    for starts in (0, 1.5, True):
        with pytest.raises(InputError, match=f"starts: {starts}; must be a whole number from 1"):
            suite_from_dynabarn(key_frames, seed=1, starts=starts)
    with pytest.raises(InputError, match="seed: -1; must be a whole number"):
        suite_from_dynabarn(key_frames, seed=-1)


@pytest.mark.realdata
def test_the_dynabarn_worlds_make_a_thousand_scenarios(data_folder):
    suite = suite_from_dynabarn(data_folder / "dynabarn" / "keyframes.csv", seed=0)
    assert len(suite.scenarios) == len(set(suite.names)) == 1020
    assert [sum(f"tier{tier}" in name for name in suite.names) for tier in (1, 2, 3)] == [340, 340, 340]
    gaps = [np.hypot(*(scenario.movers.position - scenario.start[:2]).T).min() for scenario in suite.scenarios]
    assert min(gaps) >= 1.0  # those from the beginning of a world
    assert min(gaps[30:]) > 1.3


@pytest.fixture
def recordings(tmp_path):
    folder = tmp_path / "people"
    folder.mkdir()
    for name, y in (("b", 9), ("a", 5)):
        rows = [f"{frame} {person} {frame / 50 + person} {y}" for frame in range(0, 500, 10) for person in range(3)]
        (folder / f"{name}.txt").write_text("\n".join([*rows, "0 9 0 0", "10 9 0 0.5"]))
    return folder


def test_recordings_are_taken_in_turn_and_a_longer_suite_begins_with_the_shorter_one(recordings):
    short, long = (suite_from_tracks(recordings, seed=3, count=count) for count in (3, 5))
    assert short.names == ("a-3-00000", "b-3-00001", "a-3-00002")
    assert short.names == long.names[:3]
    assert all(same_bits(a, b) for a, b in zip(short.scenarios, long.scenarios[:3], strict=True))
    # The place is the box of all recorded points with 1 m around it, in cells of half a metre.
    assert [scenario.grid.occupied.shape[0] for scenario in short.scenarios] == [14, 22, 14]
    assert long.recipe["files"] == [str(recordings / "a.txt"), str(recordings / "b.txt")]


def test_files_are_taken_in_the_order_given_with_the_spec_given(recordings):
    files = [recordings / "b.txt", recordings / "a.txt"]
    suite = suite_from_tracks(files, seed=3, count=2, spec=CrowdSpec(time_limit=4.0, mover_radius=(0.3, 0.3)))
    assert suite.names == ("b-3-00000", "a-3-00001")
    assert all(scenario.time_limit == 4.0 for scenario in suite.scenarios)
    assert all((scenario.movers.radius == np.float32(0.3)).all() for scenario in suite.scenarios)
    assert suite_from_tracks(files[0], seed=3, count=1).names == ("b-3-00000",)


def test_sources_without_recordings_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"no \.txt file; recordings are files of rows"):
        suite_from_tracks(tmp_path, seed=0, count=1)
    with pytest.raises(InputError, match="no such file"):
        suite_from_tracks(tmp_path / "none.txt", seed=0, count=1)


@pytest.mark.realdata
def test_real_people_make_scenarios_with_room_at_the_start(data_folder):
    suite = suite_from_tracks(data_folder / "pedestrians" / "ucy", seed=0, count=40)
    assert {name.split("-")[0] for name in suite.names} == {"crowds_zara01", "crowds_zara03"}
    for scenario in suite.scenarios:
        first = scenario.movers.track[:, 0]
        gaps = np.hypot(*(first[:, 1:] - scenario.start[:2]).T)[first[:, 0] <= 0.0]
        assert (gaps > 2.0).all()
        assert len(scenario.movers.valid) > 10


def test_a_suite_without_maps_keeps_names_tasks_and_shared_maps():
    grid = grid_of(np.pad(np.ones((4, 4), np.bool_), 20), 0.2)
    suite = suite_on_map("hall", grid, seed=1, count=3)
    twin = without_maps(suite)
    assert (twin.name, twin.names) == ("hall-sensed", suite.names)
    assert len({id(scenario.hidden) for scenario in twin.scenarios}) == 1
    assert all(scenario.hidden.sum() == 16 for scenario in twin.scenarios)
    assert twin.recipe["of"] == suite.recipe


# The file


def test_a_suite_comes_back_bit_for_bit(tmp_path):
    suite = mixed_suite()
    save_suite(suite, tmp_path / "mixed.npz")
    again = load_suite(tmp_path / "mixed.npz")
    assert (again.name, again.names, again.recipe) == (suite.name, suite.names, suite.recipe)
    assert len(again.scenarios) == len(suite.scenarios) == 2 * len(SUITE_NAMES)
    assert all(same_bits(a, b) for a, b in zip(again.scenarios, suite.scenarios, strict=True))


def test_hidden_cells_and_discs_come_back_and_shared_ones_are_kept_once(tmp_path):
    grid = grid_of(np.pad(np.ones((4, 4), np.bool_), 20), 0.2)
    hidden = without_maps(suite_on_map("hall", grid, seed=1, count=2)).scenarios
    disc = paper.generate(jax.random.key(0), paper.PaperSpec(cells=15, unknown_shape="disc"))
    save_suite(Suite("some", (*hidden, disc), ("a", "b", "c"), {}), tmp_path / "some")
    again = load_suite(tmp_path / "some").scenarios
    assert all(same_bits(a, b) for a, b in zip(again, (*hidden, disc), strict=True))
    assert again[0].hidden is again[1].hidden
    with np.load(tmp_path / "some") as archive:
        assert archive["hidden"].size == 44 * 44


def test_an_empty_suite_comes_back(tmp_path):
    save_suite(Suite("none", (), (), {}), tmp_path / "none")
    assert load_suite(tmp_path / "none").scenarios == ()


def test_a_failed_save_leaves_the_old_file_and_nothing_else(saved, monkeypatch):
    def out_of_room(file, **arrays):
        file.write(b"half a suite")
        raise OSError(28, "No space left on device")

    before = saved.read_bytes()
    monkeypatch.setattr(suite_module.np, "savez_compressed", out_of_room)
    with pytest.raises(InputError, match="cannot be written \\(No space left on device\\)"):
        save_suite(make_suite("crowd", seed=0, count=1), saved)
    assert saved.read_bytes() == before
    assert [path.name for path in saved.parent.iterdir()] == [saved.name]


def test_saving_into_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        save_suite(Suite("none", (), (), {}), tmp_path / "absent" / "none")


@pytest.mark.parametrize("kind", ["pipe", "link", "broken link", "folder"])
def test_what_is_no_regular_file_is_not_replaced(tmp_path, kind):
    path, other = tmp_path / "odd", tmp_path / "other"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to(other)
        if kind == "link":
            other.write_text("kept")
    before = os.lstat(path)
    with pytest.raises(InputError, match="odd: is no regular file; a suite replaces a file or makes one; "):
        save_suite(Suite("none", (), (), {}), path)
    assert os.lstat(path) == before
    assert [file.name for file in tmp_path.iterdir() if file != other] == ["odd"]


def test_a_leaf_of_the_wrong_type_is_not_saved(tmp_path):
    scenario = make_suite("crowd", seed=0, count=1).scenarios[0]
    wrong = jax.tree.map(lambda leaf: leaf.astype(np.float64), scenario)
    with pytest.raises(ValueError, match="occupied: a leaf is not bool"):
        save_suite(Suite("wrong", (wrong,), ("one",), {}), tmp_path / "wrong")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_file_is_refused(tmp_path):
    assert "no such file" in refusal_of(tmp_path / "absent")


def test_an_empty_file_is_refused(tmp_path):
    (tmp_path / "empty").touch()
    assert "0 bytes" in refusal_of(tmp_path / "empty")


def test_a_file_that_is_no_archive_is_refused(tmp_path):
    (tmp_path / "text").write_text("version 1\n")
    assert "no zip archive" in refusal_of(tmp_path / "text")


def test_an_array_file_is_refused(tmp_path):
    np.save(tmp_path / "array.npy", np.zeros(3))
    assert "no zip archive" in refusal_of(tmp_path / "array.npy")


def test_an_archive_without_header_is_refused(saved):
    assert "without a suite's header" in refusal_of(rewritten(saved, header=None))


def test_an_archive_of_other_things_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("notes.txt", "nothing")
    assert "without a suite's header" in refusal_of(tmp_path / "other.zip")


@pytest.mark.parametrize("share", [0.02, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_refused(saved, share):
    content = saved.read_bytes()
    saved.write_bytes(content[: int(len(content) * share)])
    refusal_of(saved)


def test_a_damaged_file_never_loads_as_something_else(saved):
    content, suite = saved.read_bytes(), load_suite(saved)
    rng = np.random.default_rng(0)
    refusals = []
    for _ in range(40):
        damaged = bytearray(content)
        damaged[rng.integers(len(content))] ^= 1 << rng.integers(8)
        saved.write_bytes(damaged)
        try:
            loaded = load_suite(saved)
        except InputError as refusal:
            refusals.append(str(refusal))
        else:  # a bit that says nothing, as in a time stamp
            assert loaded.names == suite.names
            assert all(same_bits(a, b) for a, b in zip(loaded.scenarios, suite.scenarios, strict=True))
    assert len(refusals) > 20
    assert not any("\n" in refusal for refusal in refusals)


def test_another_version_is_refused_with_the_way_to_remake_it(saved):
    message = refusal_of(rewritten_header(saved, version=7))
    assert "suite format version 7; this program reads version 2" in message
    assert "make_suite('crowd', seed=3, count=4)" in message


def test_another_version_with_an_unknown_recipe_shows_the_recipe(saved):
    assert 'its recipe is {"by": "hand"}' in refusal_of(rewritten_header(saved, version=0, recipe={"by": "hand"}))


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"goal": None}, "array 'goal' is missing"),
        ({"movers.track.shape": None}, "array 'movers.track.shape' is missing"),
        ({"goal": np.zeros(8, np.float64)}, "array 'goal' is float64 with 1 dimensions, not float32 with 1"),
        ({"goal": np.zeros((4, 2), np.float32)}, "array 'goal' is float32 with 2 dimensions"),
        ({"goal": np.zeros(7, np.float32)}, "array 'goal' holds 7 values, its shapes ask for 8"),
        ({"goal.shape": np.full((4, 1), 3)}, "array 'goal.shape' holds sizes other than 2"),
        ({"start.shape": np.full((3, 1), 3)}, "array 'start.shape' does not hold 4 shapes of 1 sizes"),
        ({"movers.radius.shape": np.full((4, 1), -1)}, "array 'movers.radius.shape' does not hold 4 shapes"),
        ({"movers.valid.shape": np.full((4, 1), 11)}, "array 'movers.valid.shape' holds sizes other than M"),
        ({"grid": np.array([0, 1, 2, 9], np.int32)}, "array 'grid' does not give one of the 4 grids"),
        ({"goal": np.array([None] * 8)}, "allow_pickle=False"),
        ({"hidden": np.zeros(4, np.bool_), "hidden.shape": np.ones((4, 2), int)}, "array 'hidden.shape' holds sizes"),
        ({"squares.rounding": None}, "array 'squares.rounding' is missing"),
    ],
)
def test_arrays_that_do_not_make_scenarios_are_refused(saved, changes, found):
    assert found in refusal_of(rewritten(saved, **changes))


def test_a_header_that_is_no_json_is_refused(saved):
    refusal_of(rewritten(saved, header=np.frombuffer(b"{", np.uint8)))


def test_names_that_do_not_fit_the_arrays_are_refused(saved):
    refusal_of(rewritten_header(saved, names=["one"]))


def test_nothing_in_a_suite_file_is_a_pickle(saved):
    with zipfile.ZipFile(saved) as archive:
        for name in archive.namelist():
            assert np.load(io.BytesIO(archive.read(name)), allow_pickle=False).dtype != object
