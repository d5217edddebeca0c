import jax
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Circle, Rectangle

from adwa_jax.scenario import UnknownSquares
from scenarios.drawing import (
    OCCUPIED,
    contact_sheet,
    draw_hidden,
    draw_map,
    draw_scenario,
    draw_squares,
    extent,
    mover_ways,
)
from scenarios.errors import InputError
from scenarios.generators import toy
from scenarios.generators.assembly import grid_of, walkers_of
from scenarios.hiding import hide
from scenarios.padding import pad, padded_shape
from scenarios.suite import Suite

KEY = jax.random.key(0)
OCCUPIED_CELLS = np.array([[True, False, False], [False, False, True]])
DRAWING = """
S..o
.##.
>..G
"""


@pytest.fixture(scope="module")
def scenario():
    return toy.generate(KEY, toy.ToySpec(drawing=DRAWING))


def lines_named(ax, label):
    return [line for line in ax.lines if line.get_label() == label]


def test_the_picture_of_a_map_is_the_map():
    ax = draw_map(grid_of(OCCUPIED_CELLS, 0.5, (-1.0, 2.0)))
    (image,) = ax.images
    np.testing.assert_array_equal(image.get_array(), OCCUPIED_CELLS)
    assert image.get_extent() == [-1.0, 0.5, 2.0, 3.0]
    assert image.origin == "lower"
    assert to_hex(image.to_rgba(1.0)) == OCCUPIED.lower()
    assert to_hex(image.to_rgba(0.0)) == "#ffffff"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "y [m]")


def test_y_points_up_unless_the_map_says_down():
    grid = grid_of(OCCUPIED_CELLS, 1.0)
    assert draw_map(grid).get_ylim() == (0.0, 2.0)
    assert draw_map(grid, y_down=True).get_ylim() == (2.0, 0.0)


def test_padding_is_not_drawn(scenario):
    bare, padded = (draw_scenario(world) for world in (scenario, pad(scenario, padded_shape(scenario))))
    assert padded.images[0].get_array().shape == (3, 4)
    assert len(padded.patches) == len(bare.patches) == 2
    assert len(padded.lines) == len(bare.lines)


def test_a_scenario_shows_its_ends_squares_and_movers_to_scale(scenario):
    ax = draw_scenario(scenario, seconds=2.0)
    assert lines_named(ax, "start")[0].get_xydata().tolist() == [[0.5, 2.5]]
    assert lines_named(ax, "goal")[0].get_xydata().tolist() == [[3.5, 0.5]]
    (square,) = (patch for patch in ax.patches if isinstance(patch, Rectangle))
    assert square.get_center() == pytest.approx((3.5, 2.5))
    assert square.get_width() == pytest.approx(0.6)
    (mover,) = (patch for patch in ax.patches if isinstance(patch, Circle))
    assert mover.get_center() == pytest.approx((0.5, 0.5))
    assert mover.get_radius() == pytest.approx(0.3)
    (way,) = lines_named(ax, "way of a mover")
    assert way.get_xydata()[[0, -1]] == pytest.approx(np.array([[0.5, 0.5], [1.5, 0.5]]))  # 0.5 m/s for 2 s


def test_hidden_cells_are_hatched_cells_and_known_ones_are_not(scenario):
    drawn = hide(scenario)
    ax = draw_scenario(pad(drawn, padded_shape(drawn)))
    (cells,) = (drawn for drawn in ax.collections if drawn.get_hatch())
    assert [path.vertices[:4].tolist() for path in cells.get_paths()] == [
        [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]], [[2.0, 1.0], [3.0, 1.0], [3.0, 2.0], [2.0, 2.0]]]
    assert not ax.images[0].get_array().any()
    assert "hidden cell" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_hidden_cells_lie_where_the_map_does():
    hidden = np.array([[False, True]])
    (cells,) = draw_hidden(grid_of(~hidden, 0.5, (-1.0, 2.0)), hidden, draw_map(grid_of(~hidden, 0.5, (-1.0, 2.0))))
    assert cells.get_paths()[0].vertices[:4].tolist() == [[-0.5, 2.0], [0.0, 2.0], [0.0, 2.5], [-0.5, 2.5]]


def test_unknown_discs_and_rounded_squares_are_drawn_to_scale(scenario):
    centre = np.float32([(0.5, 1.5), (3.5, 1.5), (2.5, 2.5)])
    unknown = UnknownSquares(centre, np.float32([0.0, 0.2, 0.3]), np.float32([0.4, 0.1, 0.0]), np.ones(3, bool))
    disc, rounded, sharp = draw_squares(unknown, draw_map(scenario.grid))
    assert (disc.get_center(), disc.get_radius()) == (pytest.approx((0.5, 1.5)), pytest.approx(0.4))
    outline = rounded.get_path().get_extents()
    assert (outline.p0, outline.p1) == (pytest.approx([3.2, 1.2]), pytest.approx([3.8, 1.8]))
    assert not rounded.get_path().contains_point((3.22, 1.22))
    assert isinstance(sharp, Rectangle)
    labels = [patch.get_label() for patch in (disc, rounded, sharp)]
    assert labels == ["unknown disc", "unknown square", "_"]
    assert all(patch.get_hatch() for patch in (disc, rounded, sharp))


def test_an_arrowhead_points_where_its_mover_goes():
    def heads(mark, y_down):
        drawn = draw_scenario(toy.generate(KEY, toy.ToySpec(drawing=DRAWING.replace(">", mark))), None, y_down, 1.0)
        return [line.get_marker()[2] % 360.0 for line in drawn.lines if isinstance(line.get_marker(), tuple)]

    # a triangle's tip points up at 0 and turns with the angle
    assert heads(">", False) == heads(">", True) == [pytest.approx(270.0)]
    assert heads("^", False) == [pytest.approx(0.0)]
    assert heads("^", True) == [pytest.approx(180.0)]


def test_a_way_is_broken_while_its_mover_is_absent():
    track = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 3.0]])
    ways = mover_ways(walkers_of([0.3], [track], [0.0]), 3.0)
    assert ways.shape == (31, 1, 2)
    present = np.isfinite(ways).all(axis=(1, 2))
    assert present.nonzero()[0].tolist() == list(range(10, 21))
    assert ways[15, 0] == pytest.approx((3.0, 3.0))


def test_a_way_is_broken_where_its_mover_is_put_elsewhere():
    track = np.array([[0.0, 0.0, 3.0], [1.0, 5.0, 3.0]])  # 5 m in 1 s, then back at once
    way = mover_ways(walkers_of([0.3], [track], [1.0]), 1.5)[:, 0]
    assert np.isfinite(way).all(axis=1).tolist() == [True] * 9 + [False] + [True] * 6
    assert way[[8, 10], 0] == pytest.approx([4.0, 0.0], abs=1e-4)


def test_the_legend_names_each_kind_once(scenario):
    texts = [text.get_text() for text in draw_scenario(scenario).get_legend().get_texts()]
    assert texts == ["start", "goal", "unknown square", "mover", "way of a mover"]
    assert draw_scenario(scenario, legend=False).get_legend() is None


def test_a_contact_sheet_has_a_tile_for_each_scenario_up_to_the_limit(scenario, tmp_path):
    suite = Suite("toys", (scenario,) * 5, tuple("abcde"), {})
    path = tmp_path / "sheet.png"
    figure = contact_sheet(suite, path=path, limit=3)
    titles = [ax.get_title() for ax in figure.axes if ax.axison]
    assert titles == ["a\n4 m × 3 m", "b\n4 m × 3 m", "c\n4 m × 3 m"]
    assert figure.get_suptitle() == "toys: 3 of 5"
    assert path.read_bytes().startswith(b"\x89PNG")


def test_a_contact_sheet_turns_maps_whose_y_points_down(scenario):
    for y_down in (False, True):
        tiles = [ax for ax in contact_sheet([scenario] * 2, y_down=y_down).axes if ax.axison]
        assert [ax.yaxis_inverted() for ax in tiles] == [y_down] * 2


def test_a_contact_sheet_of_a_list_takes_the_names_given(scenario):
    figure = contact_sheet([scenario, scenario], names=["one", "two"])
    assert [ax.get_title().split("\n")[0] for ax in figure.axes] == ["one", "two"]
    with pytest.raises(InputError, match="both must be ≥ 1"):
        contact_sheet([])


def test_nothing_drawn_reaches_pyplot_or_its_settings(scenario):
    import matplotlib
    import matplotlib.pyplot as plt

    before = dict(matplotlib.rcParams)
    contact_sheet([scenario])
    assert plt.get_fignums() == []
    assert dict(matplotlib.rcParams) == before


def test_no_texts_of_a_sheet_overlap(scenario):
    figure = contact_sheet([scenario] * 7)
    figure.canvas.draw()
    titles = [ax.title.get_window_extent() for ax in figure.axes if ax.axison]
    frames = [ax.get_window_extent() for ax in figure.axes if ax.axison]
    legend = figure.legends[0].get_window_extent()
    boxes = [*titles, *frames, legend]
    for index, box in enumerate(boxes):
        assert not any(box.padded(-1).overlaps(other.padded(-1)) for other in boxes[index + 1 :])


def test_the_extent_is_that_of_the_unpadded_map():
    assert extent(grid_of(OCCUPIED_CELLS, 2.0, (1.0, -1.0))) == (1.0, 7.0, -1.0, 3.0)
