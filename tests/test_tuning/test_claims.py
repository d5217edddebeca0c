"""The paper's experiments, on one size of map and few of them."""

import pytest

from tuning import animation, claims
from tuning.table1 import QUANTITIES


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("claims")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims, "SIZES", (15,))
        patch.setattr(animation, "MOST_FRAMES", 3)
        (report,) = claims.run_claims(folder, count=4, seed=0, quiet=True)
    return folder, report


def test_the_summary_holds_table_1_and_the_success_rate(made):
    folder, report = made
    text = (folder / "summary.md").read_text()
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| 15 x 15 | ")]
    assert [row[1] for row in rows] == [*QUANTITIES, f"{report.results.reached.sum()} of 4"]
    length = sum(plan.key_point_length for plan in report.maps.improved) / 4
    assert rows[0][2].startswith(f"{length:.2f} ±")
    assert rows[0][5] == "18.828"


def test_pictures_results_and_a_film_are_written(made):
    folder, report = made
    pictures = {"fig3.png", "fig4.png", "success.png", "paper-15.png", "drive.png", "drive.gif"}
    assert {path.name for path in folder.iterdir()} == pictures | {"summary.md", "paper-15"}
    assert (folder / "paper-15" / "results.csv").read_text().count("\n") == 1 + report.results.count
