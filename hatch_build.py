"""The page of a package index: it shows README.md, whose links lead nowhere there while they are relative to the repository."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

RELATIVE_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?://|#)([^)\s]+)\)")


def page_of_index(readme: str, source: str | None) -> str:
    """The text with links below ``source``, the repository's address; without an address it has their words alone, and no images."""

    def link(found: re.Match[str]) -> str:
        image, words, target = found.groups()
        if source is None:
            return "" if image else words
        return f"{image}[{words}]({source.rstrip('/')}/{'raw' if image else 'blob'}/main/{target})"

    return RELATIVE_LINK.sub(link, readme)


class IndexPage(MetadataHookInterface):
    """Writes the page with the address ``Source`` of ``[project.urls]``."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the page to the project's metadata."""
        readme = Path(self.root, "README.md").read_text(encoding="utf-8")
        text = page_of_index(readme, metadata.get("urls", {}).get("Source"))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
