"""Serves the built page on the loopback interface, and nothing else.

The page is static: it runs the kernel in the browser and works from any static host. Browsers do not load a page's modules from a file
on disk, which is all that this server is for.
"""

from __future__ import annotations

import webbrowser
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit

PAGE = Path(__file__).parent / "page"
"""The folder with the built page."""

LOOPBACK = "127.0.0.1"
_NAMES = {LOOPBACK, "localhost"}
_WALK = "/walk.json"


def require_built() -> None:
    """Raise ``FileNotFoundError`` if there is no built page."""
    if not (PAGE / "index.html").is_file():
        raise FileNotFoundError(f"{PAGE} holds no built page: run npm run build in web")


class _Handler(SimpleHTTPRequestHandler):
    """Files of the page, and one walk. Lists no folders, and answers only to this machine's own names."""

    extensions_map = {  # noqa: RUF012 - the base class has it so
        **SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".css": "text/css",
        ".html": "text/html; charset=utf-8",
        ".wasm": "application/wasm",
    }

    def __init__(self, *args: object, walk: Path | None, **kwargs: object) -> None:
        self._walk = walk
        super().__init__(*args, directory=str(PAGE), **kwargs)  # pyright: ignore[reportArgumentType]

    def send_head(self):
        # Another site's name that leads here (DNS rebinding) gets nothing
        name = urlsplit(f"//{self.headers.get('Host', '')}").hostname
        if name not in _NAMES:
            self.send_error(403, "this server answers to its own machine only")
            return None
        return super().send_head()

    def translate_path(self, path: str) -> str:
        if urlsplit(path).path == _WALK and self._walk is not None:
            return str(self._walk)
        return super().translate_path(path)

    def list_directory(self, path):
        self.send_error(404)

    def end_headers(self) -> None:
        self.send_header("Cache-Control", "no-cache")
        self.send_header("X-Content-Type-Options", "nosniff")
        super().end_headers()

    def log_message(self, format: str, *args: object) -> None:
        pass


class PageServer:
    """The page on a port of the loopback interface, at ``address``, served until closed; a context manager.

    Parameters
    ----------
    walk : path, optional
        A walk saved by ``Walk.save``, which the page opens.
    port : [0, 65535]
        0 takes any free one.

    Raises
    ------
    FileNotFoundError
        If the walk, or the built page, is not there.
    OSError
        If the port is taken.
    """

    def __init__(self, walk: str | Path | None = None, *, port: int = 0) -> None:
        require_built()
        place = None if walk is None else Path(walk).resolve()
        if place is not None and not place.is_file():
            raise FileNotFoundError(f"no walk at {place}")
        self._server = ThreadingHTTPServer((LOOPBACK, port), partial(_Handler, walk=place))
        self._server.daemon_threads = True
        opened = "" if place is None else f"#walk=.{_WALK}"
        self.address = f"http://{LOOPBACK}:{self._server.server_address[1]}/{opened}"
        self._thread = Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def __enter__(self) -> PageServer:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()

    def wait(self) -> None:
        """Serve until the process is interrupted."""
        self._thread.join()


def view(walk: str | Path | None = None, *, port: int = 0, open_browser: bool = True) -> PageServer:
    """Serve the page on this machine only, and open it in the browser. Arguments and errors as for ``PageServer``."""
    server = PageServer(walk, port=port)
    if open_browser:
        webbrowser.open(server.address)
    return server
