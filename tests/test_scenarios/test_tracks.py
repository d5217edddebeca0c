"""Pedestrian tracks and the movers made of them."""

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.formats import load_tracks, movers_from_tracks


def written(tmp_path, *rows):
    path = tmp_path / "tracks.txt"
    path.write_text("\n".join(rows) + "\n")
    return path


def refusal(path):
    with pytest.raises(InputError) as caught:
        load_tracks(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.split("; ")) == 3, "found; rule; remedy"
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


def test_tracks_are_per_person_in_time_from_the_first_frame(tmp_path):
    path = written(tmp_path, "# frame id x y", "110.0\t2.0\t5\t6", "100\t2\t4\t6", "50\t1\t0\t0", "", "60 1 1 0.5")
    first, second = load_tracks(path)
    np.testing.assert_allclose(first, [[0.0, 0.0, 0.0], [0.4, 1.0, 0.5]], rtol=1e-12)
    np.testing.assert_allclose(second, [[2.0, 4.0, 6.0], [2.4, 5.0, 6.0]], rtol=1e-12)


def test_the_frame_rate_scales_time(tmp_path):
    track, = load_tracks(written(tmp_path, "0 1 0 0", "10 1 1 0"), frames_per_second=5.0)
    np.testing.assert_array_equal(track[:, 0], [0.0, 2.0])


def test_a_gap_beyond_three_sample_intervals_parts_a_track(tmp_path):
    frames = [0, 10, 20, 50, 60, 100, 110]  # gaps of three intervals (kept) and four (cut)
    path = written(tmp_path, *(f"{frame} 1 {frame} 0" for frame in frames))
    assert [track[:, 1].tolist() for track in load_tracks(path)] == [[0, 10, 20, 50, 60], [100, 110]]
    assert len(load_tracks(path, largest_gap=5.0)) == 1


def test_a_person_seen_once_is_left_out(tmp_path):
    path = written(tmp_path, "0 1 0 0", "0 2 0 0", "10 2 1 0", "20 2 2 0", "100 2 9 9")
    assert [track[:, 1].tolist() for track in load_tracks(path)] == [[0, 1, 2]]


@pytest.mark.parametrize("row", ["10 1 2", "10 1 2 3 4", "10 1 x 3", "10 1 nan 3", "inf 1 2 3", "10,1,2,3"])
def test_a_bad_row_is_refused_with_its_line(tmp_path, row):
    message = refusal(written(tmp_path, "0 1 0 0", row))
    assert message.startswith(f":2: {row!r}; a row is four finite numbers")


def test_a_second_row_of_one_frame_and_person_is_refused(tmp_path):
    message = refusal(written(tmp_path, "0 1 0 0", "0 2 0 0", "0.0 1 5 5"))
    assert message.startswith(":3: frame 0 and id 1 as in line 1; ")


def test_files_without_tracks_are_refused(tmp_path):
    assert "no row" in refusal(written(tmp_path, "# nothing"))
    assert "no track of two rows" in refusal(written(tmp_path, "0 1 0 0", "0 2 0 0"))
    assert "no such file" in refusal(tmp_path / "none.txt")
    (tmp_path / "empty.txt").touch()
    assert "0 bytes" in refusal(tmp_path / "empty.txt")


@pytest.mark.parametrize("options", [{"frames_per_second": 0.0}, {"frames_per_second": np.nan}, {"largest_gap": -1}])
def test_bad_rates_and_gaps_are_refused(tmp_path, options):
    name, = options
    with pytest.raises(InputError, match=f"{name}: .*; must be a finite number above 0"):
        load_tracks(written(tmp_path, "0 1 0 0", "10 1 1 0"), **options)


def test_movers_repeat_the_last_row_of_shorter_tracks():
    short, long = [[1.0, 0.0, 0.0], [2.0, 3.0, 4.0]], [[0.0, 9.0, 9.0], [1.0, 8.0, 8.0], [2.0, 7.0, 7.0]]
    movers = movers_from_tracks([np.array(short), np.array(long)], radius=0.3)
    np.testing.assert_array_equal(movers.track, np.array([[*short, short[-1]], long], np.float32))
    np.testing.assert_array_equal(movers.track_length, [2, 3])
    np.testing.assert_array_equal(movers.radius, np.full(2, 0.3, np.float32))
    np.testing.assert_array_equal(movers.period, [0.0, 0.0])
    assert np.asarray(movers.valid).all()
    for name in ("position", "velocity", "low", "high"):
        np.testing.assert_array_equal(getattr(movers, name), np.zeros((2, 2)))


@pytest.mark.parametrize("count", [0, 2])
def test_mover_leaves_are_numpy_of_the_declared_types(count):
    movers = movers_from_tracks([np.array([[0.0, 1.0, 1.0], [1.0, 2.0, 2.0]])] * count, radius=0.3)
    points = 2 if count else 0
    assert {name: (value.dtype.name, value.shape) for name, value in vars(movers).items()} == {
        "radius": ("float32", (count,)), "position": ("float32", (count, 2)), "velocity": ("float32", (count, 2)),
        "low": ("float32", (count, 2)), "high": ("float32", (count, 2)), "track": ("float32", (count, points, 3)),
        "track_length": ("int32", (count,)), "period": ("float32", (count,)), "valid": ("bool", (count,))}
    assert all(isinstance(value, np.ndarray) for value in vars(movers).values())


@pytest.mark.parametrize("track", [
    [[0.0, 1.0, 1.0]], [[0.0, 1.0], [1.0, 2.0]], [0.0, 1.0, 2.0], [[0.0, 1.0, 1.0], [0.0, 2.0, 2.0]],
    [[0.0, 1.0, np.nan], [1.0, 2.0, 2.0]], [[0.0, 1.0, 1e300], [1.0, 2.0, 2.0]],
    [[1e9, 0.0, 0.0], [1e9 + 1, 1.0, 1.0]]])
def test_a_track_that_cannot_be_run_is_refused(track):
    good = np.array([[0.0, 1.0, 1.0], [1.0, 2.0, 2.0]])
    with pytest.raises(InputError, match=r"tracks\[1\]: .*; a track is an array \[J, 3\]"):
        movers_from_tracks([good, np.array(track)], radius=0.3)


@pytest.mark.parametrize("radius", [0.0, -0.3, float("nan")])
def test_a_radius_that_is_no_length_is_refused(radius):
    with pytest.raises(InputError, match=r"radius: .*; must be a finite number above 0"):
        movers_from_tracks([], radius=radius)


@pytest.mark.realdata
@pytest.mark.parametrize(("name", "rows"), [("crowds_zara01.txt", 5153), ("crowds_zara03.txt", 5005)])
def test_real_tracks_hold_every_row_and_walk_at_human_speed(data_folder, name, rows):
    tracks = load_tracks(data_folder / "pedestrians" / "ucy" / name)
    assert sum(len(track) for track in tracks) == rows
    movers = movers_from_tracks(tracks, radius=0.3)
    assert int(np.asarray(movers.track_length).sum()) == rows
    for track in tracks:
        step = np.diff(track, axis=0)
        np.testing.assert_allclose(step[:, 0], 0.4)
        assert (np.hypot(step[:, 1], step[:, 2]) / step[:, 0]).mean() < 3.0
