"""The documentation site has every page in its contents, every public name in its reference, and, once built, no link that leads nowhere."""

from __future__ import annotations

import importlib
import pkgutil
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import agents
import lean_yaw_env
from lean_yaw_env.registration import ALL_ENV_IDS

ROOT = Path(__file__).parents[1]
DOCS, BUILD = ROOT / "docs", ROOT / "docs" / "build"
sys.path.insert(0, str(DOCS))

from from_code import MARK, PACKAGES, filled  # noqa: E402  # in docs

PAGES = [
    page
    for page in sorted(DOCS.rglob("*.md"))
    if not page.is_relative_to(BUILD) and "_cache" not in page.parts
]


def _packages_with_public_names() -> list[str]:
    found = ["lean_yaw_env", "agents"]
    for package in (lean_yaw_env, agents):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            source = Path(importlib.util.find_spec(module.name).origin)
            if re.search(r"^__all__ = ", source.read_text(encoding="utf-8"), re.MULTILINE):
                found.append(module.name)
    return found


def test_the_reference_describes_every_public_name() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in (DOCS / "api").glob("*.md"))
    assert sorted(mark[2] for mark in MARK.finditer(text)) == sorted(PACKAGES)
    assert set(_packages_with_public_names()) <= set(PACKAGES)


@pytest.mark.parametrize("package", PACKAGES)
def test_each_public_name_has_a_docstring(package: str) -> None:
    pytest.importorskip("sphinx", reason="the site needs the extra docs")
    text = filled(f"<!-- from code: reference {package} -->")
    rows = re.findall(r"^   \* - :py:obj:`(\w+) <.*>`\n     - (.*)$", text, re.MULTILINE)
    assert rows and all(summary.strip() for _, summary in rows)


def test_the_code_of_the_gallery_makes_every_environment() -> None:
    text = filled("<!-- from code: gallery docs/leaderboard.csv -->")
    made = {}
    for block in re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
        exec(block, names := {})
        made[names["env"].spec.id] = names["env"].close()
    assert tuple(made) == ALL_ENV_IDS


def test_every_page_is_in_the_contents() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = "\n".join(
        re.findall(r"^```{toctree}\n.*?^```$", index, re.DOTALL | re.MULTILINE)
    ).split("\n")
    names = {str(page.relative_to(DOCS).with_suffix("")) for page in PAGES}
    assert names - {"index"} == names & set(listed)


class _Links(HTMLParser):
    """A built page's links and anchors."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src", "poster", "data") and value:
                self.targets.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def test_links_of_the_built_site_lead_somewhere() -> None:
    if not (BUILD / "index.html").exists():
        pytest.skip("the site has not been built: python docs/make_site.py")
    pages = {page: _Links(page) for page in BUILD.rglob("*.html")}
    lost = []
    for page, links in pages.items():
        for target in links.targets:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            file = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            anchor = unquote(parts.fragment)
            if not file.is_file() or (
                anchor and file in pages and anchor not in pages[file].anchors
            ):
                lost.append(f"{page.relative_to(BUILD)}: {target}")
    assert not lost
