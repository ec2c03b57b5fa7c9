"""The film at the top of the README: the walker on the page's stage, steered by an agent and pushed; needs Playwright and Chromium.

``python web/film.py`` writes ``docs/images/walking.webp``.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import math
import shutil
import tempfile
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from PIL import Image

import lean_yaw_env  # noqa: F401 - registers the environments
from agents import AgentRequest, make_agent
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.rendering.motion import SECONDS_PER_TIME_UNIT
from lean_yaw_env.viewer import PageServer
from lean_yaw_env.walker import Walk

ENV_ID = "LeanYaw/Heading-v0"
OUT = Path(__file__).parents[1] / "docs" / "images" / "walking.webp"
SIZE = (720, 420)
FPS = 20
SLOW_MOTION = 0.5
"""Of real time for legs of one metre on earth."""
HEADINGS = {0: 0.0, 13: 0.55, 24: -0.45}
"""What is commanded from which step on, rad."""
PUSHES = {6: 0.16, 33: -0.18}
"""Pushes to the side at heel strikes: what they add to the ankle rate. A stance of the right foot is pushed to the other side."""
STEPS = 42
# What a browser needs to draw in software
BROWSER = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]  # fmt: skip
STAGE_ALONE = """
#bar, #panel, #transport, #hud, #notice, #touch, #labels { display: none !important }
#main { display: block !important } #view { position: fixed !important; inset: 0 }
"""
# Draws a frame and returns it; the camera goes round the walker while it follows it
FRAME = """([duration, real, [ahead, up, right], pushes]) => {
  const { stage } = leanYaw, walker = leanYaw.active();
  const index = walker.walk.records.length;
  walker.frame(duration, real);
  const now = walker.walk.records.length;
  if (now > index && pushes[now]) walker.arrow.show(Math.sign(pushes[now]), 0, 2.0);
  const target = stage.controls.target, turn = stage.heading;
  const c = Math.cos(turn), s = Math.sin(turn);
  stage.camera.position.set(target.x + c * ahead + s * right, target.y + up, target.z + c * right - s * ahead);
  stage.camera.lookAt(target);
  stage.controls.update();
  stage.render();
  return stage.canvas.toDataURL("image/png").split(",")[1];
}"""


def walk_of_agent(name: str) -> Walk:
    """The walk of an agent that follows the headings and is pushed."""
    env: Any = gym.make(ENV_ID, horizon=math.inf, max_episode_steps=None).unwrapped
    agent = make_agent(name, AgentRequest(ENV_ID, EnvOptions()))
    observation, info = env.reset(seed=0, options={"stance": "left", "command": 0.0})
    infos, state = [], None
    for step in range(STEPS):
        kept = env.get_state()
        if step in PUSHES:
            kept["walkers"]["ankle_rate"] += PUSHES[step]
        if step in HEADINGS:
            kept["tasks"]["command"] = HEADINGS[step]
        env.set_state(kept)
        print(step, info["state"], kept["walkers"]["ankle_rate"])
        infos.append(info | {"state": np.array(env.simulation.states[0])})
        action, state = agent.predict(observation, state, np.array(step == 0), True)
        observation, _, fallen, _, info = env.step(action)
        assert not fallen, f"the walker fell at step {step}"
    infos.append(info)
    return Walk(
        states=np.array([each["state"] for each in infos]),
        stances=tuple("left" if each["stance_side"] > 0.0 else "right" for each in infos),
        footprints=np.array([each["footprint"] for each in infos]),
        durations=np.array([each["duration"] for each in infos[1:]]),
        mass_offsets=np.array([each["mass_offset"] for each in infos]),
        commands=np.array([[each["inter_leg_angle"], each["commanded_offset"]] for each in infos[1:]]),
        energies=(), path=np.empty((0, 4)), fall=None, parameters=env.simulation.body_parameters(0),
    )  # fmt: skip


def frames(walk: Walk) -> list[Image.Image]:
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    pictures = []
    seconds = walk.durations.sum() * SECONDS_PER_TIME_UNIT / SLOW_MOTION
    count = int(seconds * FPS) - 1
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        saved = Path(folder) / "walk.json"
        walk.save(saved)
        browser = running.chromium.launch(executable_path=chromium, args=BROWSER)
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]}, device_scale_factor=2)
        with PageServer(saved) as server:
            page.goto(server.address)
            page.wait_for_function("document.documentElement.dataset.ready")
            page.evaluate("window.requestAnimationFrame = () => 0")
            page.add_style_tag(content=STAGE_ALONE)
            page.evaluate("leanYaw.stage.setCovered(0, 0); leanYaw.stage.resize(); leanYaw.active().start(); leanYaw.stage.setQuality(0)")
            for k in range(count):
                share = k / count
                angle = 2.35 - 1.5 * math.sin(math.pi * share)
                distance = 2.3
                place = (distance * math.cos(angle), 0.62, distance * math.sin(angle))
                duration = SLOW_MOTION / FPS / SECONDS_PER_TIME_UNIT
                data = page.evaluate(FRAME, [duration, 1 / FPS, place, {str(i): p for i, p in PUSHES.items()}])
                picture = Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")
                pictures.append(picture.resize(SIZE, Image.Resampling.LANCZOS))
                if k % 20 == 0: print(k, count, flush=True)
        browser.close()
    return pictures


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--agent", default="lqr")
    parser.add_argument("--out", type=Path, default=OUT)
    a = parser.parse_args()
    walk = walk_of_agent(a.agent)
    print(walk.headings.round(2), walk.durations.sum())
    p = frames(walk)
    import pickle; pickle.dump([np.asarray(x) for x in p], open("/tmp/draw/frames.pkl","wb"))
    p[0].save(a.out, save_all=True, append_images=p[1:], duration=1000 // FPS, loop=0, quality=60, method=4)
    print(a.out, a.out.stat().st_size)
