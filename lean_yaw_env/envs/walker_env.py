"""One walker as a Gymnasium environment; a step of it is a walking step."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import EzPickle
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions, action_space
from lean_yaw_env.envs.pictures import FRAMES_PER_SECOND, STEPS_PER_SECOND, Gallery
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.snapshots import PickledWithState, State, restore, state_of
from lean_yaw_env.envs.tasks import Task, task_named
from lean_yaw_env.rendering.filming import Frame
from lean_yaw_env.rendering.pygame_renderer import Renderer
from lean_yaw_env.validation import require_choice, require_number, require_seed

_KEYS = {
    key: np.array(action, dtype=np.float32)
    for key, action in {"w": (-1, 0), "s": (1, 0), "a": (0, -1), "d": (0, 1)}.items()
}
"""What each key adds to the action: short steps are fast ones, and the walker turns to the side of its masses."""
_ONE = np.ones(1, dtype=np.bool_)


class WalkerEnv(PickledWithState, gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """The walker of Wisse and Schwab at a task; see ``docs/environments.md`` for each task's tables.

    ## Action space
    ``Box(-1, 1, (2,), float32)``; zero is the paper's fixed controller. Numbers outside [-1, 1] are clipped.

    | number | what it sets for this step | default range |
    |---|---|---|
    | 0 | inter-leg angle: 0.3 + 0.15 a0 rad | 0.15 to 0.45 |
    | 1 | mass offset 0.05 a1, within 0.005 (or the task's largest change) of the offset in force, positive away from the stance foot's side if mirrored | +-0.05 |

    ## Observation space
    ``Box(-10, 10, float32)``: (value - centre) / scale, clipped to the box. Mirrored to a left stance by default.

    | number | quantity | centre | scale |
    |---|---|---|---|
    | 0 | heading, rad | 0 | 0.6 |
    | 1 | stance pitch, rad | 0.155 | 0.03 |
    | 2 | ankle angle, rad | 0 | 0.05 |
    | 3 | stance pitch rate | -0.42 | 0.1 |
    | 4 | ankle rate | 0 | 0.1 |
    | 5 | mass offset in force | 0 | 0.05 |
    | 6 | stance foot, +1 left, -1 right (only with ``mirror=False``) | 0 | 1 |
    | last | the task's features | | |

    ## Ends
    A fall is ``terminated``, the horizon of simulated time is ``truncated``. A failure of the integrator is ``terminated`` too, without
    reward: ``info["fall"]`` is then ``FallCode.SOLVER``, and the walker stands where the step began.

    Parameters
    ----------
    task : str or Task
        A task's name, its environment id, or a task of your own.
    render_mode : None, "rgb_array", "rgb_array_list" or "human"
        ``render`` returns the picture after the last heel strike, or a list of pictures within the steps since it was last called; "human" shows
        these in a window, in real time. Pictures need pygame, windows a display. ``RealTime`` makes films with Gymnasium's ``RecordVideo``.
    **options
        See ``EnvOptions``.

    Raises
    ------
    TypeError
        If there is no such option.
    ValueError
        If an option, an action or a reset option is bad; an environment is then unchanged.
    NoGaitError
        If the walker has no gait to start from.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium has it so
        "render_modes": ["rgb_array", "rgb_array_list", "human"],
        "render_fps": STEPS_PER_SECOND,
    }

    def __init__(
        self, task: str | Task = "Heading", render_mode: str | None = None, **options: Any
    ) -> None:
        EzPickle.__init__(self, task, render_mode, **options)
        if render_mode is not None:
            require_choice("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        if render_mode in ("rgb_array_list", "human"):
            self.metadata = {**self.metadata, "render_fps": FRAMES_PER_SECOND}
        self.options = EnvOptions.of(options, ("task", "render_mode"))
        self.task = task_named(task)
        self.simulation = Simulation(self.task, self.options, 1)
        self.observation_space = self.options.observation_space(self.task)
        self.action_space = action_space()
        self._infos = self.simulation.new_infos()
        self._views = self.simulation.info.views(self._infos[0])
        self.is_under_way = self._has_begun = False
        self._gallery = None if render_mode is None else Gallery(self.simulation, Renderer())
        self._frames: list[Frame] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode: either foot, the gait and a random deviation.

        ``options`` may hold ``state`` (a section state), ``stance`` ("left" or "right") and the commands that the task takes
        (``Task.commands``), in place of what would be drawn.
        """
        simulation = self.simulation
        options = {} if options is None else options
        simulation.check_options(options)
        super().reset(seed=require_seed("seed", seed))
        simulation.start(_ONE, [self.np_random], self._infos)
        if options:
            simulation.place(_ONE, options, self._infos)
        self._begin()
        return simulation.observations[0].copy(), self._info()

    def step(
        self, action: ArrayLike
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Walk one step."""
        if not self.is_under_way:
            raise ResetNeeded("call reset() before the first step and after the end of an episode")
        simulation = self.simulation
        chosen = simulation.require_actions("action", action, (ACTION_SIZE,))
        simulation.actions[0] = chosen
        if not simulation.step_one(self._infos):
            raise ValueError(f"action must be numbers in [-1, 1], got {chosen.tolist()}")
        (terminated,), (truncated,) = simulation.ends.tolist()
        if terminated:
            simulation.note_failures()
        self.is_under_way = not (terminated or truncated)
        if self._gallery is not None:
            self._gallery.extend(_ONE)
            self._show(self._gallery)
        return (
            simulation.observations[0].copy(),
            simulation.rewards.item(),
            terminated,
            truncated,
            self._info(),
        )

    def get_state(self) -> State:
        """Copies of all that the next step depends on, random stream included, as arrays by name.

        With ``set_state`` an environment plans: keep a state, try actions, go back. ``walkers`` and ``tasks`` are records with named fields
        (``envs.state.WALKER_FIELDS``, ``Task.fields``).
        """
        if not self.is_under_way:
            raise ResetNeeded(
                "call reset() before get_state(): the episode is over or has not begun"
            )
        return state_of(self.simulation, [self.np_random])

    def set_state(self, state: State) -> None:
        """Go on from a state of this environment or of another one with the same task and options.

        Raises
        ------
        ValueError
            If it is no such state; nothing has changed then.
        """
        (self.np_random,) = restore(self.simulation, state)
        self._begin()

    def render(self) -> Frame | list[Frame] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """A picture, (height, width, 3), or a list of them, as the render mode says."""
        if self._gallery is None:
            gym.logger.warn("render() draws nothing: make the environment with a render_mode")
            return None
        if self.render_mode == "rgb_array":
            return self.picture()
        frames, self._frames = self._frames, []
        return frames if self.render_mode == "rgb_array_list" else None

    def picture(self, share: float = 1.0) -> Frame:
        """The picture after a share of the last step, (height, width, 3): at 1, just after the heel strike or where the walker fell.

        Raises
        ------
        ResetNeeded
            Before the first episode, and without a ``render_mode``.
        """
        require_number("share", share, 0.0, 1.0)
        if self._gallery is None or not self._has_begun:
            raise ResetNeeded("call reset() before render()")
        return self._gallery.frame(share=share)

    def get_keys_to_action(self) -> dict[str, NDArray[np.float32]]:
        """Actions of keys held together, for ``gymnasium.utils.play``: "a" and "d" steer left and right, "w" and "s" walk faster and slower.

        Raises
        ------
        ValueError
            If the environment is mirrored: its actions change sides with the stance foot, and keys cannot.
        """
        if self.options.mirror:
            raise ValueError("mirror must be False for keys that steer left and right, got True")
        held = [keys for n in range(len(_KEYS) + 1) for keys in combinations(_KEYS, n)]
        still = np.zeros(ACTION_SIZE, dtype=np.float32)
        return {"".join(keys): sum((_KEYS[key] for key in keys), still) for keys in held}

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._gallery is not None:
            self._gallery.renderer.close()

    def _info(self) -> dict[str, Any]:
        return self.simulation.info.one(self._views, self.simulation.falls[0])

    def _begin(self) -> None:
        self.is_under_way = self._has_begun = True
        self._frames = []
        if self._gallery is not None:
            self._gallery.restart(_ONE)
            self._show(self._gallery)

    def _show(self, gallery: Gallery) -> None:
        """Draw what is to be seen of the last step."""
        walk = gallery.walk()
        if self.render_mode == "rgb_array_list":
            self._frames += [gallery.frame(share=share) for share in walk.shares()]
        elif self.render_mode == "human":
            for share in walk.shares():
                gallery.renderer.show(walk.scene(share), FRAMES_PER_SECOND)
