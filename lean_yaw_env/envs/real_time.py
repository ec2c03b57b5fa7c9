"""An environment in which a step is a frame, not a walking step, so that what records, shows or plays environments shows motion."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.pictures import FRAMES_PER_SECOND
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.rendering.filming import HOLD_SECONDS
from lean_yaw_env.rendering.motion import SECONDS_PER_TIME_UNIT
from lean_yaw_env.validation import require_count, require_instance, require_number


class RealTime(gym.Wrapper[Any, Any, Any, Any], gym.utils.RecordConstructorArgs):
    """One step is one frame of the walk, for ``RecordVideo``, ``HumanRendering`` and ``gymnasium.utils.play``.

    The action that is given when a walking step begins counts for all of it. Its observation, reward, end and info come with the last of its
    frames; the frames before repeat the observation and info, with reward 0. After a fall, frames of the fallen walker follow for a second.

    Parameters
    ----------
    env : an environment of this package with ``render_mode="rgb_array"``
    fps : [1, 120]
        Frames per second.
    speed : (0, 10]
        Times real time for legs of a metre.

    Raises
    ------
    ValueError
        If the environment is another one, or a number is out of its range.
    """

    def __init__(
        self, env: gym.Env[Any, Any], fps: int = FRAMES_PER_SECOND, speed: float = 1.0
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, fps=fps, speed=speed)
        super().__init__(require_instance("env", env, gym.Env))
        if not isinstance(env.unwrapped, WalkerEnv) or env.render_mode != "rgb_array":
            raise ValueError(
                f'env must be an environment of lean_yaw_env with render_mode="rgb_array", got {env} '
                f"with render_mode={env.render_mode!r}"
            )
        fps = require_count("fps", fps, 1, 120)
        speed = require_number("speed", speed, 0.0, 10.0, "(]")
        self.metadata = {**env.metadata, "render_fps": fps}
        self._walker_env = env.unwrapped
        self._frame_time = speed / SECONDS_PER_TIME_UNIT / fps
        self._hold_time = HOLD_SECONDS * speed / SECONDS_PER_TIME_UNIT
        self._left = self._hold = self._duration = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        self._shown = self.env.reset(seed=seed, options=options)
        self._left = self._hold = self._duration = 0.0
        return self._shown

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Go on by a frame; a walking step that is over is followed by the next one."""
        if self._left <= 0.0:
            observation, self._reward, terminated, truncated, info = self.env.step(action)
            self._ends, self._next = (terminated, truncated), (observation, info)
            self._hold = self._hold_time if info["fall"] else 0.0
            self._duration = float(info["duration"])
            self._left += self._duration + self._hold
        self._left -= self._frame_time
        if self._left > 0.0:
            observation, info = self._shown
            return observation, 0.0, False, False, info
        observation, info = self._shown = self._next
        return observation, self._reward, *self._ends, info

    def render(self) -> NDArray[np.uint8]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The walker at this instant, (height, width, 3)."""
        left = max(self._left - self._hold, 0.0)
        return self._walker_env.picture(1.0 - left / self._duration if left else 1.0)
