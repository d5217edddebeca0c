import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pytest

from tests.test_tuning.findings_by_hand import VALUES, agreement, evaluations, findings, job
from tuning import report_interactive
from tuning.failures import FailurePicture
from tuning.outputs import save_figure
from tuning.report import write_report
from tuning.report_figures import hypervolume_figure

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
NAME = "office </script><script>alert(1)</script> $seed"
HEADINGS = ["Summary", "Front", "Choice", "Trade-offs", "Sweeps", "Progress", "Importance", "Training and held-out",
            "Failures", "Gradients", "Settings and provenance"]  # fmt: skip


def write(folder, **changes):
    drawn = save_figure(lambda: hypervolume_figure(findings().hypervolume), folder / "failure.png")
    given = {
        "folder": folder, "job": job(NAME), "findings": findings(), "training": evaluations(),
        "held_out": evaluations(seed=1), "held_out_rows": np.arange(len(VALUES)),
        "remembered": {"agreement": agreement()}, "environment": {"jax": "0.9", "<git>": {"dirty": True}},
        "gallery": [FailurePicture(drawn, "<b>crossing</b>: moving robot hit.")],
    } | changes  # fmt: skip
    return write_report(**given)


class Reader(HTMLParser):
    """Collects what tests ask about."""

    def __init__(self):
        super().__init__()
        self.tags, self.headings, self.open = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.open.append(tag)

    def handle_data(self, data):
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass


def read(path):
    reader = Reader()
    reader.feed(path.read_text())
    return reader


@pytest.fixture(scope="module")
def static(tmp_path_factory):
    """Written where plotly is not installed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_interactive, "available", lambda: False)
        return write(tmp_path_factory.mktemp("static"))


@pytest.fixture(scope="module")
def interactive(tmp_path_factory):
    pytest.importorskip("plotly", reason="plotly, the extra `report`, is not installed")
    return write(tmp_path_factory.mktemp("interactive"))


def test_the_static_report_is_complete_and_has_no_script(static):
    page = read(static)
    assert page.headings == HEADINGS
    assert [tag for tag, _ in page.tags if tag == "script"] == []
    assert "pip install" in static.read_text()
    assert static.stat().st_size < 1_500_000


def test_every_picture_is_inlined_and_has_words_for_those_who_do_not_see_it(static):
    pictures = [attributes for tag, attributes in read(static).tags if tag == "img"]
    assert len(pictures) == 8
    assert all(picture["src"].startswith("data:image/png;base64,") for picture in pictures)
    assert all(len(picture["alt"]) > 20 for picture in pictures)


def test_nothing_refers_to_another_file(static):
    for tag, attributes in read(static).tags:
        assert tag not in ("link", "iframe", "script")
        assert not attributes.get("href", "#").strip("#").startswith(("http", "//"))
    assert "url(" not in static.read_text()


def test_tables_have_captions_and_headers(static):
    text = static.read_text()
    tables = re.findall(r"<table>.*?</table>", text, re.DOTALL)
    assert len(tables) > 5
    for table in tables:
        assert "<caption>" in table
        assert '<th scope="col">' in table
        assert table.count("<tr>") - 1 == table.count('<th scope="row">')


def test_names_are_escaped(static, interactive):
    for page in (static, interactive):
        text = page.read_text()
        assert "alert(1)</script>" not in text
        assert "<h1>Tuning report: office &lt;/script&gt;&lt;script&gt;alert(1)&lt;/script&gt; $seed</h1>" in text
        assert "<b>crossing" not in text
        assert "&lt;git&gt;" in text


def test_what_there_is_not_is_left_out(tmp_path):
    found = findings(held_out=False)
    page = write(tmp_path, findings=found, training=evaluations(values=VALUES[[0, 4, 5, 6]], last_half_done=False),
                 held_out=None, held_out_rows=np.zeros(0, int), remembered={}, gallery=())  # fmt: skip
    missing = {"Sweeps", "Failures", "Gradients"}
    assert read(page).headings == [heading for heading in HEADINGS if heading not in missing]
    assert "Nothing was driven on held-out scenarios" in page.read_text()


def test_the_job_file_is_shown_as_it_was_written(tmp_path):
    (tmp_path / "job.toml").write_text('name = "office"  # <mine>\n')
    assert "name = &quot;office&quot;  # &lt;mine&gt;" in write(tmp_path).read_text()


@pytest.fixture(scope="module")
def browser():
    if CHROMIUM is None:
        pytest.skip("no chromium on the path: the page is not opened")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


def opened(browser, path, **options):
    """A page, and the list to which whatever goes wrong on it, and every request, is added."""
    page, noticed = browser.new_page(**options), []
    page.on("pageerror", lambda error: noticed.append(f"error: {error}"))
    page.on("console", lambda message: noticed.append(f"console: {message.text}"))
    page.on("dialog", lambda dialog: noticed.append("dialog"))
    page.on("request", lambda request: noticed.append(request.url) if not request.url.startswith("data:") else None)
    page.goto(path.as_uri(), wait_until="load")
    return page, noticed


def test_the_page_opens_without_error_or_request_and_all_pictures_load(browser, static, interactive):
    for path in (static, interactive):
        page, noticed = opened(browser, path)
        widths = page.evaluate("Promise.all([...document.images].map(i => i.decode().then(() => i.naturalWidth)))")
        assert len(widths) == 8
        assert min(widths) > 300
        assert noticed == [path.as_uri()]
        page.close()


def test_pointing_at_a_member_shows_its_constants(browser, interactive):
    page, noticed = opened(browser, interactive, viewport={"width": 1000, "height": 900})
    page.wait_for_selector("#front-plot .points path")
    page.locator("#front-plot").scroll_into_view_if_needed()
    star = page.locator("#front-plot .scatterlayer .trace").nth(3).locator("path.point").first
    box = star.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=4)
    page.wait_for_selector("#front-plot .hoverlayer .hovertext")
    shown = page.locator("#front-plot .hoverlayer").text_content()
    for text in ("clearance = 0.3125", "local_heading = 0.4375", "progress = 0.8125", "recommended"):
        assert text in shown
    assert noticed == [interactive.as_uri()]
    page.close()


def test_the_axes_of_the_plot_can_be_chosen(browser, interactive):
    page, _ = opened(browser, interactive)
    page.wait_for_selector("#front-plot .points path")
    page.locator("#front-plot .updatemenu-header").first.click()
    page.locator("#front-plot .updatemenu-dropdown-button").nth(3).click()
    page.wait_for_function("document.querySelector('#front-plot .xtitle').textContent.startsWith('danger points')")
    drawn = page.evaluate("document.getElementById('front-plot').data[3].x[0]")
    assert drawn == pytest.approx(findings().front[0].training.objectives[3].value)
    page.close()


def test_a_telephone_need_not_scroll_sideways(browser, static):
    page, _ = opened(browser, static, viewport={"width": 360, "height": 700}, color_scheme="dark")
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    page.close()
