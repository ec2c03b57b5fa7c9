"""Serves the built page on the loopback interface, and nothing else.

The page is static: it runs the kernel in the browser and works from any static host. Browsers do not load a page's modules from a file
on disk, which is all that this server is for.
"""

from __future__ import annotations

import io
import shutil
import webbrowser
from collections.abc import Mapping, Sequence
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import BinaryIO
from urllib.parse import urlencode, urlsplit

from lean_yaw_env.files import json_text, read_json, require_path, write_json
from lean_yaw_env.registration import ENV_IDS, TASK_VERSIONS
from lean_yaw_env.validation import require_choice
from lean_yaw_env.viewer.shipped import CARD, WEIGHTS, agent_index, trained_folder

PAGE = Path(__file__).parent / "page"
"""The folder with the built page."""

LOOPBACK = "127.0.0.1"
_NAMES = {LOOPBACK, "localhost"}
# Paths of the page's address, relative to it, of what is not in the folder of the page
_WALK, _AGENTS, _INDEX, _OWN = "walk.json", "agents", "agents/index.json", "own"
_WITHOUT_FILES = ("you", "fixed")
"""Walkers of a task that are no trained agents: the visitor, and the paper's controller."""


def require_built() -> None:
    """Raise ``FileNotFoundError`` if there is no built page."""
    if not (PAGE / "index.html").is_file():
        raise FileNotFoundError(f"{PAGE} holds no built page: run npm run build in web")


class _Handler(SimpleHTTPRequestHandler):
    """Files of the page, and others at places of their own. Lists no folders, and answers only to this machine's own names."""

    extensions_map = {  # noqa: RUF012 - the base class has it so
        **SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".css": "text/css",
        ".html": "text/html; charset=utf-8",
        ".wasm": "application/wasm",
    }

    def __init__(self, *args: object, places: Mapping[str, Path], **kwargs: object) -> None:
        self._places = places
        super().__init__(*args, directory=str(PAGE), **kwargs)  # pyright: ignore[reportArgumentType]

    def send_head(self) -> BinaryIO | io.BytesIO | None:
        # Another site's name that leads here (DNS rebinding) gets nothing
        name = urlsplit(f"//{self.headers.get('Host', '')}").hostname
        if name not in _NAMES:
            self.send_error(403, "this server answers to its own machine only")
            return None
        return (
            self._send_index() if urlsplit(self.path).path == f"/{_INDEX}" else super().send_head()
        )

    def _send_index(self) -> io.BytesIO:
        content = json_text(agent_index(), indent=None).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        return io.BytesIO(content)

    def translate_path(self, path: str) -> str:
        found = Path(super().translate_path(path))
        for name, place in self._places.items():
            if found.is_relative_to(PAGE / name):
                return str(place / found.relative_to(PAGE / name))
        return str(found)

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
    task : str, optional
        The name of a task, as Slalom, which the page opens instead.
    agents : names
        Who walks that task, side by side: algorithms of trained agents, as ppo; ``linear``, the linear law; ``fixed``, the paper's controller; ``you``,
        the visitor.
    policy : path, optional
        A folder with a trained policy, which walks too. It says which task it is for.
    port : [0, 65535]
        0 takes any free one.

    Raises
    ------
    FileNotFoundError
        If the walk, the policy or the built page is not there.
    ValueError
        If there is no such task or agent, or a walk is asked for together with a task.
    OSError
        If the port is taken.
    """

    def __init__(
        self,
        walk: str | Path | None = None,
        *,
        task: str | None = None,
        agents: Sequence[str] = (),
        policy: str | Path | None = None,
        port: int = 0,
    ) -> None:
        require_built()
        places: dict[str, Path] = {}
        settings: dict[str, str] = {}
        trained = trained_folder()
        if trained is not None:
            places[_AGENTS] = trained
        if policy is not None:
            folder = require_path(policy, "policy").resolve()
            own = _task_of(folder)
            if task not in (None, own):
                raise ValueError(f"the policy in {folder} is for {own}, and task is {task!r}")
            task = own
            places |= {f"{_OWN}/{name}": folder / name for name in (CARD, WEIGHTS)}
            settings = {"policy": f"{_OWN}/policy"}
            agents = (*agents, _OWN)
        if agents and task is None:
            raise ValueError("agents walk a task: give task too")
        if task is not None:
            settings = {"tab": "tasks", **_walkers(task, agents), **settings}
        if walk is not None:
            if task is not None:
                raise ValueError("walk and task are shown one at a time: give one of them")
            place = require_path(walk, "walk").resolve()
            if not place.is_file():
                raise FileNotFoundError(f"no walk at {place}")
            places[_WALK] = place
            settings = {"walk": f"./{_WALK}"}
        self._server = ThreadingHTTPServer((LOOPBACK, port), partial(_Handler, places=places))
        self._server.daemon_threads = True
        opened = f"#{urlencode(settings, safe='./,')}" if settings else ""
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


def _task_of(folder: Path) -> str:
    """The task that the policy in a folder was trained for."""
    for name in (CARD, WEIGHTS):
        if not (folder / name).is_file():
            raise FileNotFoundError(
                f"no {name} in {folder}: policy must be a folder that train.py has written"
            )
    card = read_json(folder / CARD)
    env_id = str(card.get("env_id") if isinstance(card, dict) else None)
    ids = dict(zip(ENV_IDS, TASK_VERSIONS, strict=True))
    if env_id not in ids:
        raise ValueError(
            f"the policy in {folder} is for {env_id}, and the page has {', '.join(ids)}"
        )
    return ids[env_id]


def _walkers(task: str, agents: Sequence[str]) -> dict[str, str]:
    """The page's settings for a task and who walks it."""
    version = TASK_VERSIONS[require_choice("task", task, TASK_VERSIONS)]
    index = agent_index()
    known = [*_WITHOUT_FILES, *index["agents"].get(f"{task}-v{version}", {}), _OWN]
    known += ["linear"] if task in index["laws"] else []
    for agent in agents:
        require_choice("agent", agent, known)
    return {"task": task, **({"walkers": ",".join(agents)} if agents else {})}


def view(
    walk: str | Path | None = None,
    *,
    task: str | None = None,
    agents: Sequence[str] = (),
    policy: str | Path | None = None,
    port: int = 0,
    open_browser: bool = True,
) -> PageServer:
    """Serve the page on this machine only, and open it in the browser. Arguments and errors as for ``PageServer``."""
    server = PageServer(walk, task=task, agents=agents, policy=policy, port=port)
    if open_browser:
        webbrowser.open(server.address)
    return server


def write_page(folder: str | Path) -> None:
    """Copy the page and the trained agents into a folder, for any static host.

    Raises
    ------
    FileNotFoundError
        If there is no built page.
    """
    require_built()
    place = require_path(folder, "folder")
    shutil.copytree(PAGE, place, dirs_exist_ok=True)
    trained = trained_folder()
    if trained is not None:
        shutil.copytree(trained, place / _AGENTS, dirs_exist_ok=True)
    (place / _AGENTS).mkdir(exist_ok=True)
    write_json(place / _INDEX, agent_index(), indent=None)
