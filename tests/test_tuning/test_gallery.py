from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.patches import Circle
from PIL import Image

from adwa_jax.episode import Outcome
from adwa_jax.presets import jackal, paper
from adwa_jax.rollout import RobotState
from adwa_jax.scenario import UnknownSquares
from tests.test_tuning.worlds import mixed_suite, part_of
from tuning import gallery
from tuning.evaluate import evaluate
from tuning.gallery import Cause, Group, cause_by_result, grouped, sheet, turned_back, write_gallery
from tuning.replay import replay
from tuning.results import Results

SUITE = part_of(mixed_suite(), [1, 2, 3, 4, 5])  # those of one padded shape


@pytest.fixture(scope="module")
def results():
    return evaluate(SUITE, paper())


@pytest.fixture(scope="module")
def replayed():
    return {name: replay(SUITE.scenarios[SUITE.names.index(name)], paper()) for name in ("brief", "walled", "detour")}


def ended_by(*velocities, track_length=0, mover=(1.0, 0.0)):
    """A robot at (0, 0) after as many steps of 0.5 s as velocities are given, those of the mover beside it; a second
    mover, nearer to the centre than to the outline of a robot of two discs, goes straight on.
    """
    steps = len(velocities)
    velocity = np.stack([np.array(velocities, np.float32), np.tile(np.float32([0.0, 1.0]), (steps, 1))], axis=1)
    position = np.tile(np.float32([mover, (0.0, 0.9)]), (steps, 1, 1))
    zero = np.zeros(steps, np.float32)
    movers = SimpleNamespace(radius=np.float32([0.3, 0.3]), track_length=np.array([track_length, 0]))
    return SimpleNamespace(
        scenario=SimpleNamespace(movers=movers, start=np.zeros(3)),
        robot=replace(jackal(), radius=0.25, disc_offsets=(-0.5, 0.5)),
        episode=SimpleNamespace(measures=SimpleNamespace(time=np.float32(0.5 * steps))),
        trace=SimpleNamespace(
            length=np.int32(steps), robot=RobotState(zero, zero, zero, zero, zero),
            movers=SimpleNamespace(position=position, velocity=velocity, present=np.ones((steps, 2), bool))),
    )  # fmt: skip


def test_a_mover_that_was_mirrored_shortly_before_turned_back():
    ahead, back, along = (1.0, 0.2), (-1.0, 0.2), (0.0, 0.5)
    assert turned_back(ended_by(ahead, ahead, back, back))
    assert turned_back(ended_by(ahead, back, back, back, back))
    assert not turned_back(ended_by(ahead, back, back, back, back, back, back))  # longer ago
    assert not turned_back(ended_by(along, along, along))
    assert not turned_back(ended_by(back))


def test_only_the_mover_that_was_touched_counts_and_only_one_without_a_track():
    turning = ((1.0, 0.0), (-1.0, 0.0))
    assert turned_back(ended_by(*turning, mover=(1.0, 0.0)))  # 0.5 m from the disc ahead
    assert not turned_back(ended_by(*turning, mover=(0.0, -2.0)))  # the other one is nearer
    assert not turned_back(ended_by(*turning, track_length=4))


def test_causes_follow_from_the_outcome_but_for_a_moving_robots_hits():
    outcomes = list(Outcome)[1:]
    stopped = np.array([outcome == Outcome.HIT_MOVER for outcome in outcomes] + [False])
    outcomes = np.array([*outcomes, Outcome.HIT_MOVER], np.int32)
    found = Results("some", tuple(map(str, outcomes)), outcomes, {"hit_while_stopped": stopped})
    causes = [cause_by_result(found, index) for index in range(len(outcomes))]
    assert causes[:-1] == [Cause.KNOWN, Cause.UNKNOWN, Cause.STANDING, Cause.STUCK, Cause.TIMEOUT, Cause.NO_PATH]
    assert causes[-1] is None
    assert len({cause.file for cause in Cause}) == len({cause.heading for cause in Cause}) == len(Cause)


def test_failures_are_grouped_in_the_suites_order(results, monkeypatch):
    outcomes = dict(zip(SUITE.names, map(Outcome, results.outcome), strict=True))
    failing = {name for name, outcome in outcomes.items() if outcome != Outcome.REACHED}
    calls = []
    groups = grouped(SUITE, results, paper(), lambda *counts: calls.append(counts))
    assert calls == [(count, len(failing)) for count in range(1, len(failing) + 1)]
    assert {SUITE.names[index] for group in groups.values() for index in group.indices} == failing
    assert list(groups) == [cause for cause in Cause if cause in groups]
    assert all(group.indices == sorted(group.indices) for group in groups.values())
    assert all(len(group.shown) == len(group.indices) for group in groups.values())
    for group in groups.values():
        for index, driven in zip(group.indices, group.shown, strict=True):
            assert driven.outcome == outcomes[SUITE.names[index]]

    monkeypatch.setattr(gallery, "MOST_SHOWN", 1)
    few = grouped(SUITE, results, paper())
    assert {cause: group.indices for cause, group in few.items()} == {
        cause: group.indices for cause, group in groups.items()}  # fmt: skip
    assert all(len(group.shown) == 1 for group in few.values())


def test_the_gallery_is_an_index_and_a_picture_a_cause(results, tmp_path):
    written = write_gallery(tmp_path / "new", SUITE, results, paper())
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == sorted(path.name for path in written)
    text = (tmp_path / "new" / "gallery.md").read_text()
    assert text.startswith(f"# Failures on mixed: {int((~results.reached).sum())} of 5 scenarios\n")
    for cause in (Cause.NO_PATH, Cause.TIMEOUT):
        assert cause.sentence in text
        with Image.open(tmp_path / "new" / f"{cause.file}.png") as picture:
            assert min(picture.size) > 100
    assert "walled (index 2)" in text


def test_a_gallery_of_no_failures_says_so(results, tmp_path):
    reached = results.reached.nonzero()[0].tolist()
    good = part_of(SUITE, reached)
    written = write_gallery(tmp_path, good, evaluate(good, paper()), paper())
    assert [path.name for path in written] == ["gallery.md"]
    assert written[0].read_text() == f"# Failures on mixed: 0 of {len(reached)} scenarios\n"


def the(ax, label):
    (found,) = (line for line in ax.lines if line.get_label() == label)
    return found.get_xydata()


def test_the_last_seconds_are_shown_around_the_robot(replayed):
    driven = replayed["detour"]
    figure = sheet(Cause.TIMEOUT, Group([0], [driven]), SUITE, seconds=2.0)
    ax, steps = figure.axes[0], int(driven.trace.length)
    path = np.stack([driven.trace.robot.x, driven.trace.robot.y], axis=-1)[:steps]
    (line,) = (drawn for drawn in ax.collections if drawn.get_label() == "driven path")
    segments = np.array(line.get_segments())
    np.testing.assert_allclose(segments[:, 1], path[-20:], atol=1e-6)
    np.testing.assert_allclose(line.get_array(), np.arange(-19, 1) * 0.1, atol=1e-4)
    assert np.ptp(ax.get_xlim()) == pytest.approx(np.ptp(ax.get_ylim()))
    assert ax.get_xlim()[0] < segments[..., 0].min() < segments[..., 0].max() < ax.get_xlim()[1]
    assert the(ax, "local target").tolist() == [driven.trace.target[steps - 1].tolist()]
    (robot,) = (patch for patch in ax.patches if isinstance(patch, Circle) and patch.get_label() == "robot, end")
    assert robot.get_center() == pytest.approx(path[-1].tolist())
    assert ax.get_title().startswith(f"{SUITE.names[0]}, ")


def test_of_a_robot_that_stood_the_last_of_its_way_is_shown_however_long_ago(replayed):
    driven = replayed["detour"]
    robot, steps = driven.trace.robot, int(driven.trace.length)
    stood = np.minimum(np.arange(len(robot.x)), steps - 40)  # for the last 39 steps, 3.9 s
    robot = robot._replace(x=np.asarray(robot.x)[stood], y=np.asarray(robot.y)[stood])
    standing = replace(driven, trace=driven.trace._replace(robot=robot))
    ax = sheet(Cause.STUCK, Group([0], [standing]), SUITE, seconds=2.0).axes[0]
    (line,) = (drawn for drawn in ax.collections if drawn.get_label() == "driven path")
    segments = np.array(line.get_segments())
    ways = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
    assert ways.sum() == pytest.approx(0.4, abs=ways.max())
    assert (ways[-39:] == 0).all()


def test_a_drive_shorter_than_that_is_shown_whole_and_none_as_the_map(replayed):
    ax = sheet(Cause.TIMEOUT, Group([3], [replayed["brief"]]), SUITE).axes[0]
    (line,) = (drawn for drawn in ax.collections if drawn.get_label() == "driven path")
    assert len(line.get_segments()) == 3
    ax = sheet(Cause.NO_PATH, Group([2], [replayed["walled"]]), SUITE).axes[0]
    assert ax.get_xlim() == (0.0, 8.0)
    assert not [drawn for drawn in ax.collections if drawn.get_label() == "driven path"]


def test_maps_with_y_downwards_stay_so(replayed):
    for name in ("brief", "walled"):
        ax = sheet(Cause.TIMEOUT, Group([0], [replayed[name]]), SUITE, y_down=True).axes[0]
        assert ax.yaxis_inverted()


def test_movers_have_trails_and_arrows(replayed):
    ax = sheet(Cause.TIMEOUT, Group([0], [replayed["detour"]]), SUITE).axes[0]
    (arrows,) = (drawn for drawn in ax.collections if type(drawn).__name__ == "Quiver")
    speeds = np.hypot(arrows.U, arrows.V)
    assert speeds == pytest.approx([0.5, 0.5])  # one second's way of the two movers drawn


def test_the_legend_lists_what_is_in_view_only(replayed):
    driven = replayed["detour"]
    figure = sheet(Cause.TIMEOUT, Group([0], [driven]), SUITE)
    (ax,) = figure.axes[:1]
    low, high = np.sort([ax.get_xlim(), ax.get_ylim()], axis=1).T
    listed = [text.get_text() for text in figure.legends[0].get_texts()]
    ends = {"start": np.asarray(driven.scenario.start)[:2], "goal": np.asarray(driven.scenario.goal)}
    within = {name: bool(((place > low) & (place < high)).all()) for name, place in ends.items()}
    assert {name: name in listed for name in ends} == within
    assert not all(within.values())
    assert {"driven path", "robot, end"} <= set(listed)


def test_squares_beyond_the_view_are_neither_drawn_nor_listed(replayed):
    driven = replayed["detour"]
    squares = UnknownSquares(np.float32([[-50.0, -50.0]]), np.float32([0.3]), np.float32([0.0]), np.array([True]))
    far = replace(driven, scenario=replace(driven.scenario, squares=squares))
    figure = sheet(Cause.TIMEOUT, Group([0], [far]), SUITE)
    assert not {text.get_text() for text in figure.legends[0].get_texts()} & {"unknown square", "square never sensed"}


@pytest.mark.parametrize(("count", "rows", "columns"), [(3, 1, 3), (5, 2, 3), (6, 2, 3), (9, 3, 3), (12, 3, 4)])
def test_the_last_row_of_a_sheet_is_filled_where_it_can_be(count, rows, columns, replayed):
    figure = sheet(Cause.NO_PATH, Group([2] * count, [replayed["walled"]] * count), SUITE)
    layout = figure.axes[0].get_subplotspec().get_gridspec()
    assert (layout.nrows, layout.ncols) == (rows, columns)
