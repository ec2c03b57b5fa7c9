"""Verdicts, the registry and the report, without computing anything slow."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from lean_yaw_env.paper import report
from lean_yaw_env.paper.checks import Check, Printed, Result, Section, assess, compare
from lean_yaw_env.paper.registry import CLASSICS, NAMES, PAPER, PIECES, Piece, pieces_named
from lean_yaw_env.paper.report import (
    Reproduced,
    Reproduction,
    as_html,
    as_markdown,
    reproduce,
    write_columns,
    write_report,
)

_NUMBER = Printed("speed", "0.36", "Figure 13", "critical speed")
_STATEMENT = Printed("basin", "large", "section 4.1", "basin of attraction")


class _Page(HTMLParser):
    """Collects what a page refers to, and checks that its tags are closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.open_tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.sources += [values["src"] or ""] if "src" in values else []
        self.links += [values["href"] or ""] if "href" in values else []
        self.anchors |= {values["id"] or ""} if "id" in values else set()
        if tag not in ("meta", "img"):
            self.open_tags.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open_tags.pop() == tag


@pytest.mark.parametrize(
    ("ours", "verdict"),
    [
        (0.36, "agrees within rounding"),
        (0.355, "agrees within rounding"),  # half a unit of the last digit belongs to it
        (0.3551, "agrees within rounding"),
        (0.3651, "differs"),
        (-0.36, "differs"),
        (math.nan, "differs"),
    ],
)
def test_a_number_agrees_within_half_a_unit_of_its_last_printed_digit(
    ours: float, verdict: str
) -> None:
    assert compare(_NUMBER, ours).verdict == verdict


def test_an_approximate_number_agrees_within_its_stated_room_and_says_so() -> None:
    about = Printed("x", "0.72", "Figure 13", "critical speed", 0.02, "read off a figure")
    check = compare(about, 0.705)
    assert check.verdict == "agrees"
    assert check.allowed == "± 0.02: read off a figure"
    assert compare(about, 0.69).verdict == "differs"


def test_a_tolerance_of_its_own_leaves_a_number_no_room_from_its_digits() -> None:
    ratio = Printed("ratio", "1", "section 4.3", "ratio", 0.1, "one of four data points")
    assert compare(ratio, 0.93).verdict == "agrees"
    assert compare(ratio, 0.54).verdict == "differs"
    # A printed 0 among values of two decimals is no 0.4
    zero = Printed("λ3", "0", "Table 3", "zero", 0.005, "the others have two decimals")
    assert compare(zero, 0.4).verdict == "differs"
    assert compare(Printed("r", "0.5", "Table 1", "r", 0.0, "exact"), 0.5).verdict == "agrees"


def test_a_tolerance_needs_a_reason_and_a_reason_a_tolerance() -> None:
    for tolerance, reason in ((0.1, ""), (None, "about")):
        with pytest.raises(ValueError, match="speed"):
            compare(Printed("speed", "1", "here", "speed", tolerance, reason), 1.0)


def test_every_disagreement_says_something() -> None:
    assert "0.36" in compare(_NUMBER, 0.5).remark
    assert compare(replace(_NUMBER, is_open=True), 0.5).verdict == "open"
    assert assess(_STATEMENT, False, "small").remark == "It does not hold."
    assert compare(replace(_NUMBER, remark="A", otherwise="B."), 0.5).remark == "A B."
    with pytest.raises(ValueError, match="basin"):
        Check("basin", "b", "c", "d", "e", None, "f", "differs")
    with pytest.raises(ValueError, match="verdict must be one of"):
        Check("a", "b", "c", "d", "e", None, "f", "agrees a bit")  # pyright: ignore[reportArgumentType]


def test_ours_is_shown_with_two_digits_more_than_the_paper() -> None:
    assert compare(_NUMBER, 0.3638912).ours == "0.3639"
    assert compare(Printed("z", "0", "Table 3", "zero"), 3e-17).ours == "0"
    assert compare(Printed("z", "0", "Table 3", "small"), 3.1e-4).ours == "3.1e-04"


def test_pieces_are_unique_complete_and_in_the_papers_order() -> None:
    assert len(set(NAMES)) == len(NAMES)
    wanted = {f"table{i}" for i in (1, 2, 3)} | {f"figure{i}" for i in (4, *range(7, 16))}
    assert wanted <= set(NAMES)
    paper, classics = pieces_named(["all"]), pieces_named(["classics"])
    assert {piece.group for piece in paper} == {PAPER}
    assert {piece.group for piece in classics} == {CLASSICS}
    assert pieces_named(["classics", "all"]) == paper + classics == PIECES
    assert [p.name for p in pieces_named(["table2", "table1", "table2"])] == ["table1", "table2"]


@pytest.mark.parametrize("names", [["figure5"], ["all", "nothing"], []])
def test_unknown_pieces_are_named_before_anything_is_written(
    names: list[str], tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match="figure13") as raised:
        reproduce(names, tmp_path / "out")
    assert all(name in str(raised.value) for name in names)
    assert not (tmp_path / "out").exists()


def test_a_file_in_the_folders_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("precious")
    with pytest.raises(ValueError, match="out"):
        reproduce(["table1"], tmp_path / "out")
    assert (tmp_path / "out").read_text() == "precious"


def test_columns_of_different_lengths_leave_no_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="shorter"):
        write_columns(tmp_path / "x.csv", {"a": [1, 2], "b": [1]})
    assert list(tmp_path.iterdir()) == []


def _sample(tmp_path: Path) -> Reproduction:
    picture = tmp_path / "one.png"
    picture.write_bytes(b"\x89PNG")
    checks = (
        compare(_NUMBER, 0.5, otherwise="5 < 6 & |λ| differ"),
        assess(_STATEMENT, True, "large"),
    )
    piece = Piece("one", "The <first>", lambda: Result(checks))
    section = Section("What was <tried>", "Nothing helped.", {"tried": ["r | α"], "λ": ["0.5"]})
    result = Result(checks, {"one": {"a": [1]}}, sections=(section,))
    return Reproduction((Reproduced(piece, result, picture),))


def test_the_page_is_well_formed_and_needs_no_other_file(tmp_path: Path) -> None:
    text = as_html(_sample(tmp_path))
    page = _Page()
    page.feed(text)
    assert page.open_tags == []
    assert page.sources == ["data:image/png;base64,iVBORw=="]
    assert {link.removeprefix("#") for link in page.links} <= page.anchors
    assert "The &lt;first&gt;" in text
    assert "5 &lt; 6 &amp; |λ| differ" in text
    assert "What was &lt;tried&gt;" in text
    assert "<td>r | α</td>" in text


def test_the_markdown_has_a_row_for_each_check_and_one_more_for_each_disagreement(
    tmp_path: Path,
) -> None:
    text = as_markdown(_sample(tmp_path))
    rows = [line for line in text.splitlines() if line.startswith(("| speed", "| basin"))]
    assert len(rows) == 3
    # A bar within a cell would split it
    assert all(len(re.findall(r"(?<!\\)\|", row)) == 9 for row in rows)
    assert "### What was <tried>" in text
    assert "| r \\| α | 0.5 |" in text
    assert "2 checks: 1 agrees, 0 agrees within rounding, 1 differs, 0 open." in text


def test_a_reproduction_leaves_report_pictures_and_numbers_and_no_scraps(tmp_path: Path) -> None:
    done = reproduce(["table1", "figure4", "skateboard"], tmp_path)
    write_report(done, tmp_path)
    assert [each.piece.name for each in done.pieces] == ["skateboard", "figure4", "table1"]
    assert {path.name for path in tmp_path.iterdir()} == {
        "figure4.png",
        "skateboard.png",
        "figure4.csv",
        "table1.csv",
        "checks.csv",
        "report.md",
        "report.html",
        ".finished",
    }
    with (tmp_path / "checks.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(done.checks)
    assert sum(done.counts().values()) == len(done.checks)


def test_a_reproduction_goes_on_where_it_was_and_gives_the_same_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def piece(name: str) -> Piece:
        def make() -> Result:
            if made == ["first"] and name == "second":
                made.append("interruption")
                raise KeyboardInterrupt
            made.append(name)
            return Result((assess(_STATEMENT, True, "large"),), {name: {"a": [1]}})

        return Piece(name, name, make)

    monkeypatch.setattr(report, "pieces_named", lambda names: (piece("first"), piece("second")))
    with pytest.raises(KeyboardInterrupt):
        reproduce([], tmp_path)
    texts = [as_markdown(reproduce([], tmp_path)) for _ in range(2)]
    assert made == ["first", "interruption", "second"]
    assert texts[0] == texts[1]
    (tmp_path / "first.csv").unlink()
    (tmp_path / ".finished" / "second.json").write_text("{")
    assert as_markdown(reproduce([], tmp_path)) == texts[0]
    assert made[3:] == ["first", "second"]  # what is missing or damaged is computed again
    monkeypatch.setattr(report, "_code_digest", lambda: "another")
    reproduce([], tmp_path)
    assert made[5:] == ["first", "second"]
