"""The report: the same bytes for the same results, whole in one file, and readable in a browser."""

import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import pytest
from browser import executable, opened
from sample_report import sample

from muscle_bayes.study.steps.report import typeset


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> Path:
    """A folder with report.json of a sample, and its HTML."""
    folder = tmp_path_factory.mktemp("report")
    content = sample(folder)
    (folder / "report.html").write_bytes(typeset(content, folder, "html"))
    return folder


class References(HTMLParser):
    """Everything that a browser would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("src", "href", "srcset", "data", "poster", "action"):
                self.found.append(value or "")


def test_pdf_and_html_are_the_same_to_the_byte(report):
    content = report / "results" / "report.json"
    for kind in ("pdf", "html"):
        assert typeset(content, report, kind) == typeset(content, report, kind)


def test_pdf_names_no_day(report):
    made = typeset(report / "results" / "report.json", report, "pdf")
    assert made.startswith(b"%PDF")
    assert not re.search(rb"/(CreationDate|ModDate)", made)


def test_html_holds_all_that_it_shows(report):
    text = (report / "report.html").read_text()
    parser = References()
    parser.feed(text)
    shown = [one for one in parser.found if not one.startswith("#")]
    assert len(shown) == 5  # the sample's figures
    assert all(one.startswith("data:image/svg+xml;base64,") for one in shown)
    style = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert not re.search(r"@import|url\(|http", " ".join(style))
    assert not re.search(
        r"(import|fetch|src)\s*\(", " ".join(re.findall(r"<script>(.*?)</script>", text, re.DOTALL))
    )


def test_html_has_every_section_and_escapes_what_users_wrote(report):
    text = (report / "report.html").read_text()
    for heading in ("Model", "Fixture", "Muscle", "What the model lacks", "Limits"):
        assert re.search(rf"<h2[^>]*>[^<]*{heading}</h2>", text), heading
    assert "A sample <study> & more" in unescape(text)
    assert "<study" not in text
    assert "<math" in text
    assert "These data are synthetic." in text


def test_the_first_page_answers_and_says_synthetic_once(report):
    text = unescape((report / "report.html").read_text())
    first = text[: text.index("What was measured</h2>")]
    for answer in ("How sure?", "What was missing?", "Does it creep while cold?", "Which gains?"):
        assert answer in first
    assert text.count("These data are synthetic.") == 1


def test_contents_are_links(report):
    text = (report / "report.html").read_text()
    places = set(re.findall(r'href="#([^"]+)"', text))
    assert len(places) >= 10
    assert places <= set(re.findall(r'id="([^"]+)"', text))


def test_html_opens_from_disk_without_request_or_complaint(report, tmp_path):
    if executable() is None:
        pytest.skip("there is no Chromium here (`apt-get install chromium`)")
    requests, complaints, text = opened(report / "report.html", tmp_path)
    fetched = [url for url in requests if not url.startswith("data:")]
    assert fetched == [(report / "report.html").as_uri()]
    assert complaints == []
    assert "These data are synthetic." in text


ZOOM = """(() => {
  const svg = document.querySelector(".residuals svg");
  const texts = () => [...svg.querySelectorAll(".time")].at(-1).textContent;
  const before = texts();
  const box = svg.getBoundingClientRect();
  svg.dispatchEvent(new WheelEvent("wheel", {deltaY: -100, clientX: box.left + box.width / 2, bubbles: true,
    cancelable: true}));
  document.querySelector("figure img").click();
  return {before, after: texts(), points: svg.querySelectorAll("circle").length,
    zoomed: document.querySelectorAll("figure.zoomed").length,
    wider: document.documentElement.scrollWidth - window.innerWidth};
})()"""


@pytest.mark.parametrize("width", [400, 1200])
def test_residuals_zoom_in_a_browser_and_nothing_is_wider_than_the_window(report, tmp_path, width):
    if executable() is None:
        pytest.skip("there is no Chromium here (`apt-get install chromium`)")
    _, complaints, found = opened(report / "report.html", tmp_path, width, ZOOM)
    assert complaints == []
    assert float(found["before"]) == 2.0
    assert float(found["after"]) < 2.0
    assert found["points"] == 1
    assert found["zoomed"] == 1
    assert found["wider"] <= 0
