"""The film at the top of the README: an agent steers the walker on the page's stage, and it recovers from a push.

``python web/film.py`` writes ``docs/images/walking.webp`` in a few minutes. It needs Playwright and Chromium (``pip install -e '.[web]'``).
"""

from __future__ import annotations

import argparse
import base64
import io
import math
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from playwright.sync_api import sync_playwright
from tqdm import tqdm

import agents
import lean_yaw_env  # noqa: F401 - registers the environments
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.rendering.motion import SECONDS_PER_TIME_UNIT
from lean_yaw_env.rendering.palette import FLOOR, INK
from lean_yaw_env.viewer import PageServer
from lean_yaw_env.walker import Walk

OUT = Path(__file__).parents[1] / "docs" / "images" / "walking.webp"
ENV_ID = "LeanYaw/Heading-v1"
STEPS = 27
PUSHES = {4: -0.3}
"""What is added to the ankle rate at the heel strike before a step: below zero, a push to the left."""
HEADINGS = {10: -0.8}
"""What is commanded from a step on, rad; straight downhill before."""
CAPTIONS = {0: "It stays up by steering", 4: "A push to the left", 6: "It turns into its fall, and recovers", 10: "Now it is told to turn right"}  # fmt: skip

SIZE = (800, 450)
FPS = 16
SPEED = 0.75
"""Times real time for legs of a metre on earth."""
DISTANCE, HEIGHT = (1.9, 2.6), (0.42, 1.15)
"""Of the camera from what it looks at, leg lengths: along the floor and up, in the middle of the film and at its ends."""
START_ANGLE, TURN = 2.5, 1.75
"""Of the camera from downhill, to the right, rad: at the start and end, and how far it goes forward between."""
_BROWSER = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]  # fmt: skip
_STAGE_ALONE = """
#bar, #panel, #transport, #hud, #notice, #touch, #labels { display: none !important }
#main { display: block !important } #view { position: fixed !important; inset: 0 }
"""
_PREPARE = """
requestAnimationFrame = () => 0;
leanYaw.stage.setCovered(0, 0);
leanYaw.stage.resize();
leanYaw.stage.setQuality(0);
"""
_FRAME = """([duration, seconds, [ahead, up, right], pushes]) => {
  const { stage } = leanYaw, exhibit = leanYaw.active(), before = exhibit.walk.records.length;
  exhibit.frame(duration, seconds);
  const step = exhibit.walk.records.length;
  if (step > before && pushes[step]) exhibit.arrow.show(Math.sign(pushes[step]), 0, 1.6);
  const { x, y, z } = stage.controls.target;
  stage.camera.position.set(x + ahead, y + up, z + right);
  stage.controls.update();
  stage.render();
  return [step, stage.canvas.toDataURL("image/png").split(",")[1]];
}"""


def walk_of(agent_name: str) -> Walk:
    """The walk of an agent that follows the headings and is pushed."""
    env: Any = gym.make(ENV_ID, horizon=1e6, max_episode_steps=None).unwrapped
    agent = agents.make_agent(agent_name, agents.AgentRequest(ENV_ID, EnvOptions()))
    observation, info = env.reset(seed=0, options={"stance": "left", "command": 0.0})
    starts, ends, memory = [], [], None
    for step in range(STEPS):
        state = env.get_state()
        state["walkers"]["ankle_rate"] += PUSHES.get(step, 0.0)
        state["tasks"]["command"] = HEADINGS.get(step, state["tasks"]["command"])
        env.set_state(state)
        starts.append({**info, "state": np.array(env.simulation.states[0])})
        action, memory = agent.predict(observation, memory, np.array(step == 0), True)
        observation, _, terminated, _, info = env.step(action)
        ends.append(info)
        if terminated:
            raise RuntimeError(f"{agent_name} fell in step {step}: choose another push")
    strikes = [*starts, info]
    return Walk(
        states=np.array([each["state"] for each in strikes]),
        stances=tuple("left" if each["stance_side"] > 0.0 else "right" for each in strikes),
        footprints=np.array([each["footprint"] for each in strikes]),
        durations=np.array([each["duration"] for each in ends]),
        mass_offsets=np.array([each["mass_offset"] for each in strikes]),
        commands=np.array([[each["inter_leg_angle"], each["commanded_offset"]] for each in ends]),
        energies=(),
        path=np.empty((0, 4)),
        fall=None,
        parameters=env.simulation.body_parameters(0),
    )


def frames(walk: Walk) -> Iterator[Image.Image]:
    """The walk as the page draws it, twice as fine and averaged, with captions."""
    count = math.floor(walk.durations.sum() * SECONDS_PER_TIME_UNIT / SPEED * FPS)
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    pushes = {str(step): push for step, push in PUSHES.items()}
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        saved = Path(folder) / "walk.json"
        walk.save(saved)
        browser = running.chromium.launch(executable_path=chromium, args=_BROWSER)
        viewport: Any = dict(zip(("width", "height"), SIZE, strict=True))
        page = browser.new_page(viewport=viewport, device_scale_factor=2)
        with PageServer(saved) as server:
            page.goto(server.address)
            page.wait_for_function("document.documentElement.dataset.ready")
            page.add_style_tag(content=_STAGE_ALONE)
            page.evaluate(_PREPARE)
            page.evaluate("leanYaw.active().start()")
            for k in tqdm(range(count), unit="frame"):
                share = math.sin(math.pi * k / count) ** 2
                angle = START_ANGLE - TURN * share
                distance, up = (
                    near * share + far * (1.0 - share) for near, far in (DISTANCE, HEIGHT)
                )
                place = [distance * math.cos(angle), up, distance * math.sin(angle)]
                duration = SPEED / FPS / SECONDS_PER_TIME_UNIT
                step, picture = page.evaluate(_FRAME, [duration, 1.0 / FPS, place, pushes])
                drawn = Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB")
                yield _with_caption(drawn.resize(SIZE, Image.Resampling.LANCZOS), step)
        browser.close()


def _with_caption(picture: Image.Image, step: int) -> Image.Image:
    words = CAPTIONS[max(first for first in CAPTIONS if first <= step)]
    place = (0.04 * picture.width, 0.93 * picture.height)
    font = ImageFont.load_default(0.055 * picture.height)
    pen = ImageDraw.Draw(picture)
    pen.text(place, words, INK, font, anchor="ls", stroke_width=3, stroke_fill=FLOOR)
    pen.text(place, words, INK, font, anchor="ls")
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--agent", default="lqr", help="who steers (default: lqr)")
    parser.add_argument("--out", type=Path, default=OUT, help="the film, a .webp or a .gif")
    arguments = parser.parse_args()
    first, *rest = frames(walk_of(arguments.agent))
    how = {"duration": round(1000 / FPS), "loop": 0, "quality": 72, "method": 5}
    first.save(arguments.out, save_all=True, append_images=rest, **how)
    print(f"{arguments.out}: {arguments.out.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
