"""The page in a notebook: one HTML document with the kernel and a walk in it, which needs no server and stays in a saved notebook."""

from __future__ import annotations

import base64
import gzip
import html
import json
from dataclasses import dataclass
from pathlib import Path

from lean_yaw_env.viewer.server import PAGE, require_built

_TEXTS = {".js": "text/javascript", ".css": "text/css"}
# The page's files become blobs, first those that others name. Then the page itself takes this document's place, and is given the walk.
_DOCUMENT = """<!doctype html>
<meta charset="utf-8" />
<script type="module">
const unpacked = (packed) => {
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
};
const blobs = [];
const withBlobs = (text) => blobs.reduce((so, [name, blob]) => so
  .replace(new RegExp("new URL\\\\(`" + name + "`,import\\\\.meta\\\\.url\\\\)\\\\.href"), () => JSON.stringify(blob))
  .replace("./assets/" + name, blob), text);
for (const [name, type, packed] of %(files)s) {
  const content = unpacked(packed);
  const part = type ? withBlobs(await content.text()) : await content.arrayBuffer();
  blobs.push([name, URL.createObjectURL(new Blob([part], { type }))]);
}
const page = withBlobs(await unpacked(%(page)s).text());
history.replaceState = () => {};  // this document has no address to keep settings in
document.open();
document.write(page);
document.close();
const wait = setInterval(() => {
  if (!document.documentElement.dataset.ready) return;
  clearInterval(wait);
  leanYaw.active().open(%(walk)s);
}, 50);
</script>
"""


@dataclass(frozen=True)
class PageDisplay:
    """A saved walk on the web page, which notebooks show.

    Parameters
    ----------
    walk : str
        JSON as ``Walk.save`` writes it.
    height : int
        Of the picture, pixels.
    """

    walk: str
    height: int = 620

    @property
    def document(self) -> str:
        """The page and the walk as one HTML document, of about half a megabyte.

        Raises
        ------
        FileNotFoundError
            If there is no built page.
        """
        require_built()
        # Scripts name binary files; the page's own script names the worker too, and comes last
        files = sorted(
            (PAGE / "assets").iterdir(), key=lambda file: (file.suffix in _TEXTS, "index" in file.name)
        )  # fmt: skip
        packed = [[file.name, _TEXTS.get(file.suffix, ""), _packed(file)] for file in files]
        return _DOCUMENT % {
            "files": json.dumps(packed),
            "page": json.dumps(_packed(PAGE / "index.html")),
            "walk": self.walk.replace("<", "\\u003c"),
        }

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return (
            f'<iframe srcdoc="{html.escape(self.document)}" title="The walk in three dimensions" width="100%" '
            f'height="{self.height}" style="border: 0" allow="fullscreen"></iframe>'
        )


def _packed(file: Path) -> str:
    return base64.b64encode(gzip.compress(file.read_bytes(), mtime=0)).decode()
