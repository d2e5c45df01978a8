import base64
import dataclasses
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.view.figures.plots import error_over_time, joint_errors, learning_curve
from mjx_hand.view.report import Film, Headline, Plot, Report, Section, Table, write_report

STEPS = np.array([1e5, 2e5])
SUCCESS = Table(("", "policy", "paper"), [("SPIDER", "99 %", ""), ("tracking error", "0.3 cm", "0.95 cm")], "Of all.")


def film(path: Path | None, missing: str = "") -> dict[str, list[Section]]:
    return {"sections": [Section("Demonstration and twin", [Film(path, "Left and right.", missing)])]}


def a_report(**change) -> Report:
    errors = np.random.default_rng(0).random((8, 20))
    counted = np.ones((8, 20), bool)
    report = Report(
        title="Precision pinch",
        task="The twin lifts a cube & holds it <still>.",
        headlines=[Headline("success", "97 %", "zero residual: 12 %")],
        sections=[
            Section("Demonstration and twin", [Film(None, "Left and right.", "no off-screen renderer")]),
            Section("Learning", [Plot(learning_curve(STEPS, np.array([0.1, 0.9]), baseline=0.1), "Three seeds.")]),
            Section("Tracking error over time", [Plot(error_over_time(50.0, {"policy": (errors, counted)}))]),
            Section("Success", [SUCCESS, Plot(joint_errors(["index1", "index2"], {"exact": errors[:, :2]}))]),
        ],
        how=[("MuJoCo", "4.0.0")],
        commands=["make demo"],
    )
    return dataclasses.replace(report, **change)


class Page(HTMLParser):
    """Collects tags, attributes and text; complains of tags that do not close."""

    VOID = frozenset({"meta", "br", "link", "img", "hr", "input"})

    def __init__(self, text: str):
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.words = ""
        self.stack: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.handle_startendtag(tag, attrs)
        if tag not in self.VOID:
            self.stack.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag

    def handle_data(self, data):
        self.words += data


def page(tmp_path, **change) -> tuple[Page, str]:
    write_report(tmp_path / "report.html", a_report(**change))
    text = (tmp_path / "report.html").read_text()
    return Page(text), text


def test_the_page_shows_everything_it_was_given(tmp_path):
    found, _ = page(tmp_path)
    assert not found.stack
    assert "The twin lifts a cube & holds it <still>." in found.words  # escaped in the file
    for words in ("97 %", "zero residual: 12 %", "Three seeds.", "Of all.", "0.95 cm", "MuJoCo", "make demo"):
        assert words in found.words
    assert found.tags.count("svg") == 3
    assert found.tags.count("th") == 5


def test_the_page_loads_nothing(tmp_path):
    video = tmp_path / "a.mp4"
    video.write_bytes(b"film")
    found, text = page(tmp_path, **film(video))
    assert "script" not in found.tags
    assert "link" not in found.tags
    for name, value in found.attributes:
        if name in ("src", "href", "xlink:href"):
            assert value is not None
            assert value.startswith(("data:", "#"))
    assert "@import" not in text
    assert not re.search(r"url\((?!#)", text)


def test_ids_are_unique(tmp_path):
    found, _ = page(tmp_path)
    ids = [value for name, value in found.attributes if name == "id"]
    assert len(ids) == len(set(ids)) > 0


def test_the_video_is_inside(tmp_path):
    video = tmp_path / "a.mp4"
    video.write_bytes(bytes(range(256)))
    found, _ = page(tmp_path, **film(video))
    (source,) = [value for name, value in found.attributes if name == "src"]
    assert source is not None
    assert base64.b64decode(source.removeprefix("data:video/mp4;base64,")) == bytes(range(256))
    assert "No video" not in found.words
    assert "Left and right." in found.words


def test_without_a_video_the_page_says_why_and_shows_the_rest(tmp_path):
    found, _ = page(tmp_path)
    assert "No video: no off-screen renderer" in found.words
    assert "video" not in found.tags
    assert "Left and right." not in found.words, "there is nothing that it could describe"
    assert "Tracking error over time" in found.words


def test_a_page_without_sections(tmp_path):
    found, _ = page(tmp_path, sections=(), how=(), commands=(), headlines=())
    assert found.tags.count("section") == 0
    assert "Precision pinch" in found.words


def test_several_figures_of_a_section_stand_in_columns(tmp_path):
    def classes(*parts: Table | Plot | Film) -> list[str | None]:
        found, _ = page(tmp_path, sections=[Section("One", parts)])
        return [value for name, value in found.attributes if name == "class" and str(value).startswith("parts")]

    absent = Film(None, "", "no renderer")
    assert classes(absent, SUCCESS) == ["parts"]
    assert classes(absent, absent) == ["parts columns"]


def test_the_same_report_is_the_same_file(tmp_path):
    assert page(tmp_path)[1] == page(tmp_path)[1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (film(None), "no video and no reason"),
        (
            {"sections": [Section("Success", [Table(("", "policy"), [("SPIDER", "1", "2")])])]},
            "'SPIDER' has 3 cells for 2 columns",
        ),
    ],
)
def test_bad_reports_are_refused_and_leave_no_file(tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        page(tmp_path, **change)
    with pytest.raises(InputError, match=r"gone\.mp4: no such video"):
        page(tmp_path, **film(tmp_path / "gone.mp4"))
    assert not list(tmp_path.iterdir())
