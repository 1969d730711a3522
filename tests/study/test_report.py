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
    assert len(parser.found) == 5  # the sample's figures
    assert all(one.startswith("data:image/svg+xml;base64,") for one in parser.found)
    style = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert not re.search(r"@import|url\(|http", " ".join(style))
    assert "<script" not in text


def test_html_has_every_section_and_escapes_what_users_wrote(report):
    text = (report / "report.html").read_text()
    for heading in ("Model", "Fixture", "Muscle", "What the model lacks", "Limits"):
        assert re.search(rf"<h2[^>]*>[^<]*{heading}</h2>", text), heading
    assert "A sample <study> & more" in unescape(text)
    assert "<study" not in text
    assert "<math" in text
    assert "These data are synthetic." in text


def test_every_caption_of_synthetic_data_says_so(report):
    captions = re.findall(
        r"<figcaption>(.*?)</figcaption>", (report / "report.html").read_text(), re.DOTALL
    )
    assert len(captions) > 15
    assert all("Synthetic data." in caption for caption in captions)


def test_html_opens_from_disk_without_request_or_complaint(report, tmp_path):
    if executable() is None:
        pytest.skip("there is no Chromium here (`apt-get install chromium`)")
    requests, complaints, text = opened(report / "report.html", tmp_path)
    fetched = [url for url in requests if not url.startswith("data:")]
    assert fetched == [(report / "report.html").as_uri()]
    assert complaints == []
    assert "These data are synthetic." in text
