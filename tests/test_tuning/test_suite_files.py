"""Which kind of suite a file or folder holds."""

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.suite import save_suite
from tests.test_tuning.worlds import mixed_suite, part_of
from tuning.suite_files import suite_in

KEY_FRAMES = """\
world,obstacle,plugin,period_s,k,t_s,x_m,y_m
3,0,a,4.0,0,0.0,1,2
3,0,a,4.0,1,4.0,3,2
25,0,a,2.0,0,0.0,1,2
25,0,a,2.0,1,2.0,3,2
"""


@pytest.fixture
def barn(tmp_path):
    """Two worlds without obstacles."""
    np.savez(tmp_path / "some.npz", world=np.array([4, 0]), full=np.zeros((2, 30, 64), np.uint8))
    for world in (4, 0):
        np.save(tmp_path / f"path_{world}.npy", [[15, 0]])
    return tmp_path / "some.npz"


@pytest.fixture
def people(tmp_path):
    folder = tmp_path / "people"
    folder.mkdir()
    for name in ("a", "b"):
        rows = (f"{10 * step} {person} {0.5 * step} {2 * person}" for person in range(3) for step in range(20))
        (folder / f"{name}.txt").write_text("\n".join(rows) + "\n")
    return folder


def test_a_saved_suite_comes_back_whole_whatever_the_count(tmp_path):
    saved = part_of(mixed_suite(), [3, 4])
    save_suite(saved, tmp_path / "some.npz")
    assert suite_in(tmp_path / "some.npz").names == suite_in(tmp_path / "some.npz", count=1).names == saved.names


def test_an_archive_of_barn_grids_is_told_by_its_arrays(barn):
    assert suite_in(barn).names == ("world_4", "world_0")
    assert suite_in(barn, count=1).names == ("world_4", "world_0")
    more = suite_in(barn, seed=1, count=5)
    assert more.names == ("world_4", "world_0", "world_4-start01", "world_0-start01", "world_4-start02")


def test_key_frames_are_worlds_from_more_and_more_times_on(tmp_path):
    path = tmp_path / "keyframes.CSV"
    path.write_text(KEY_FRAMES)
    assert suite_in(path).names == ("world_3-tier1-start00", "world_25-tier2-start00")
    more = suite_in(path, seed=2, count=3).names  # whole rounds
    assert more == (*suite_in(path).names, "world_3-tier1-start01", "world_25-tier2-start01")


def test_tracks_are_a_file_or_a_folder_of_them(people):
    assert suite_in(people, seed=7, count=3).names == ("a-7-00000", "b-7-00001", "a-7-00002")
    assert suite_in(people / "b.txt", count=1).names == ("b-0-00000",)


@pytest.mark.parametrize(("name", "found"), [
    ("gone.npz", "no such file or folder; it must be a saved suite, "),
    ("empty", "no .world, .world.gz or .txt file; it must be a saved suite, "),
    ("table.csv", "table.csv:1: no column 'world'"),
    ("words.txt", "words.txt:1"),
    ("other.npz", "an archive without a suite's header"),
    ("half.npz", "an archive without a suite's header"),
    ("letter", "no zip archive"),
])  # fmt: skip
def test_what_holds_no_suite_is_refused_with_what_was_expected(tmp_path, name, found):
    (tmp_path / "empty").mkdir()
    (tmp_path / "table.csv").write_text("name,length\na,1\n")
    (tmp_path / "words.txt").write_text("Dear all\n")
    (tmp_path / "letter").write_text("Dear all\n")
    np.savez(tmp_path / "other.npz", some=np.zeros(3))
    np.savez(tmp_path / "half.npz", world=np.zeros(3))
    with pytest.raises(InputError) as caught:
        suite_in(tmp_path / name)
    assert found in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("numbers", "field"), [({"seed": -1}, "seed: -1; "), ({"seed": 2**32}, "seed: 4294967296; "),
                                                ({"count": 0}, "count: 0; ")])  # fmt: skip
def test_bad_numbers_are_refused(people, numbers, field):
    with pytest.raises(InputError, match=f"^{field}must be "):
        suite_in(people, **numbers)


@pytest.mark.realdata
def test_the_real_files_make_a_thousand_scenarios_each(data_folder):
    for name, count in (("barn/grids.npz", 1000), ("dynabarn/keyframes.csv", 1000), ("pedestrians/ucy", 20)):
        made = suite_in(data_folder / name, count=count)
        assert len(made.scenarios) >= count
        assert len(set(made.names)) == len(made.names)
