"""Key frames of DynaBARN's obstacles."""

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.formats import load_dynabarn

HEADER = "world,obstacle,plugin,period_s,k,t_s,x_m,y_m"


def written(tmp_path, *rows, header=HEADER):
    path = tmp_path / "keyframes.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def refusal(path):
    with pytest.raises(InputError) as caught:
        load_dynabarn(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.split("; ")) >= 3, "found; rule; remedy"
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


def test_obstacles_of_a_world_are_tracks_and_its_tier_is_in_its_name(tmp_path):
    worlds = load_dynabarn(written(
        tmp_path, "39,0,a,4.0,0,0.0,1,2", "39,0,a,4.0,1,4.0,3,2", "39,1,b,2.5,0,0,5,5", "39,1,b,2.5,1,1,6,5",
        "39,1,b,2.5,2,2.5,7,5", "40,0,c,1,0,0,0,0", "40,0,c,1,1,1,1,1"))
    assert [name for name, _ in worlds] == ["world_39-tier2", "world_40-tier3"]
    first, second = worlds[0][1]
    np.testing.assert_array_equal(first, [[0, 1, 2], [4, 3, 2]])
    np.testing.assert_array_equal(second, [[0, 5, 5], [1, 6, 5], [2.5, 7, 5]])


def test_columns_are_found_by_name(tmp_path):
    path = written(tmp_path, "9,0,3,0,0,0", "9,0,3,7,3,0", header="y_m,world,period_s,x_m,t_s,obstacle")
    ((name, (track,)),) = load_dynabarn(path)
    assert name == "world_0-tier1"
    np.testing.assert_array_equal(track, [[0, 0, 9], [3, 7, 9]])


@pytest.mark.parametrize(("rows", "found"), [
    (["0,0,a,4,0,0,1,2", "0,0,a,4,1,x,3,2"], ":3, t_s: 'x'"),
    (["0,0,a,4,0,0,1,2", "0,0,a,4,1,4,nan,2"], ":3, x_m: 'nan'"),
    (["0.5,0,a,4,0,0,1,2"], ":2, world: '0.5'"), (["-1,0,a,4,0,0,1,2"], ":2, world: '-1'"),
    (["0,0,a,4,0,0,1"], ":2: 7 values; the header names 8"),
    (["0,0,a,4,0,0,1,2", "0,0,a,5,1,4,3,2"], ":3: period_s 5"),
    (["0,0,a,4,0,0,1,2", "0,0,a,4,1,3,3,2", "0,0,a,4,2,3,3,2"], ":4: t_s 3; key frames are in order of time"),
    (["0,0,a,4,0,0,1,2", "0,0,a,4,1,3,3,2"], ":3: 2 key frames from 0 to 3 s"),
    (["0,0,a,4,0,1,1,2", "0,0,a,4,1,4,3,2"], ":3: 2 key frames from 1 to 4 s"),
    (["0,0,a,0,0,0,1,2"], ":2: 1 key frames"), ([], ": no key frame")])
def test_bad_rows_are_refused_with_their_line(tmp_path, rows, found):
    assert refusal(written(tmp_path, *rows)).startswith(found)


def test_other_files_are_refused(tmp_path):
    assert refusal(written(tmp_path, header="world,obstacle,t_s,x_m,y_m")).startswith(":1: no column 'period_s'")
    assert "no such file" in refusal(tmp_path / "none.csv")


@pytest.mark.realdata
def test_the_benchmarks_obstacles_keep_the_speeds_of_their_tier_and_stay_between_the_walls(data_folder):
    worlds = load_dynabarn(data_folder / "dynabarn" / "keyframes.csv")
    assert len(worlds) == 30
    speeds = {"tier1": (0.5, 0.95), "tier2": (1.0, 1.45), "tier3": (1.4, 1.95)}
    for name, tracks in worlds:
        low, high = speeds[name.split("-")[1]]
        for track in tracks:
            steps = np.diff(track, axis=0)
            # Places and times are rounded to 1 cm and 10 ms, which tells on the shortest steps.
            speed = np.hypot(steps[:, 1], steps[:, 2]) / steps[:, 0]
            assert (speed > low - 0.02).all(), name
            assert (speed < high + 0.02).all(), name
            assert np.abs(track[:, 1:]).max() <= 10.0
    assert sum(len(tracks) for _, tracks in worlds) == 488
