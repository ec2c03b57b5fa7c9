"""Bad input to every public function and method raises an error that names the argument and the value.

``ROWS`` has a row for each public callable with the kind of each of its arguments. A kind is a tuple of bad values.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import math
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import xarray

import agents
import lean_yaw_env
from agents import datasets, references
from lean_yaw_env import (
    Walker,
    WalkerParameters,
    analysis,
    batch,
    envs,
    find_limit_cycle,
    multibody,
    passive,
    registration,
    rendering,
    vehicles,
)
from lean_yaw_env.analysis import storage
from lean_yaw_env.envs import hindsight, sb3

NAN, INF = math.nan, math.inf
DATES = np.array(["2020-01-01"], dtype="datetime64[D]")
OTHERS: tuple[Any, ...] = (None, True, "3", 1j, [0.1, 0.2], {"a": 1}, DATES[0], object)
"""What is neither a number nor a count."""
LISTS: tuple[Any, ...] = (
    None,
    3.0,
    "word",
    {"a": 1},
    ["a", "b"],
    [[0.1], [0.1, 0.2]],
    [1j, 2j],
    [None, None],
    DATES,
)
"""What is no array of numbers."""


def number(*outside: float) -> tuple[Any, ...]:
    return (*OTHERS, NAN, *outside)


def count(*outside: int) -> tuple[Any, ...]:
    return (*OTHERS, NAN, 1.5, 2.0, -1, *outside)


def array(n: int, *outside: float) -> tuple[Any, ...]:
    """Of n numbers."""
    return (
        *LISTS,
        [],
        [0.1] * (n + 1),
        [[0.1] * n] * 2,
        [NAN] * n,
        [True] * n,
        [INF] * n,
        *([each] * n for each in outside),
    )


def optional(kind: tuple[Any, ...]) -> tuple[Any, ...]:
    return tuple(each for each in kind if each is not None)


POSITIVE = number(0.0, -1.0)
FINITE = number(INF)
FLAG = (None, 1, 0.0, "no", [], np.array([True, False]))
NAME = (None, 3, "no-such-name", b"left", ["left"], "")
MAPPING = (3, "word", [1, 2])
PATH = (None, 3, 1.5, "", ["a"], b"a")
OBJECT = (None, 3, "word", [], {"a": 1})
FOOT = {"stance": NAME}
ANGLE = number(0.0, -0.1, 1.6)
OFFSET = number(-1.1, 1.1)
PAIR = (*OTHERS[:4], {"a": 1}, NAN, 1.1, [0.1], [0.1, 0.1, 0.1], ["a", "b"], [NAN, 0.0])
COMMAND = {"inter_leg_angle": ANGLE, "mass_offset": OFFSET, "previous_offset": optional(OFFSET)}
PAIR_COMMAND = {"inter_leg_angle": ANGLE, "mass_offset": PAIR}
STATE, PASSIVE_STATE = array(5, 2.0), array(6, 2.0)
SAMPLES = count(0, 1)
DURATION = number(0.0, -1.0, 101.0)
TASK = (None, 3, "", "Heding", ["Heading"], b"Heading")
SEED = (True, 1.5, "3", -1, NAN, {"a": 1})
ACTION = (
    None, 3.0, "word", True, {"a": 1}, ["a", "b"], [True, False], [1j, 0j], [NAN, 0.0], [0.0], [0.0] * 3,
    [[0.0], [0.0, 1.0]], [None, None], np.array(["2020-01-01"] * 2, dtype="datetime64[D]"),
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """A public callable, good values of the arguments that it must have, and the bad values of each argument."""

    get: Callable[[], Callable[..., Any]]
    good: Mapping[str, Any] | Callable[[], Mapping[str, Any]] = field(default_factory=dict)
    bad: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    free: tuple[str, ...] = ()
    """Arguments of which no value is bad, or which another row covers."""


GAIT = np.array([0.00154, 0.155, -0.0041, -0.415, -0.0701])
PASSIVE_GAIT = np.array([0.0, 0.2, 0.0, -0.2, 0.0, -0.005])
BODY = WalkerParameters()
WALKER = Walker()
PASSIVE = passive.PassiveWalker(WalkerParameters(0.0, 0.0, 0.5, 0.004), planar=True)
BICYCLE = vehicles.benchmark_bicycle()
MULTIBODY = multibody.MultibodyWalker(0.3, 0.5, 0.55, 0.01)
ACTIVE_MAP = analysis.ActiveMap(WALKER)
PASSIVE_MAP = analysis.PassiveMap(PASSIVE)
MAPS = {"SectionMap": PASSIVE_MAP, "ActiveMap": ACTIVE_MAP}
POSE = rendering.Pose(GAIT)
SCENE = rendering.Scene(BODY, POSE)
MATRIX = (*LISTS, np.eye(3), [0.1, 0.2], np.full((2, 2), NAN))
GOALS = np.zeros((4, 2))


@functools.cache
def cycle() -> analysis.LimitCycle:
    return find_limit_cycle(WALKER)


@functools.cache
def atlas() -> analysis.Atlas:
    gaits = analysis.stability_map(WALKER, {"slope": [0.01, 0.02]})
    return analysis.Atlas(gaits, analysis.basin_sizes(gaits, every=1, n_steps=2))


@functools.cache
def branch() -> analysis.Branch:
    return analysis.continue_gait(WALKER, "slope", (0.009, 0.011), most_points=3)


@functools.cache
def env() -> envs.WalkerEnv:
    made = envs.WalkerEnv("Heading")
    made.reset(seed=0)
    return made


@functools.cache
def vector_env() -> envs.WalkerVectorEnv:
    made = envs.WalkerVectorEnv(2, "Heading")
    made.reset(seed=0)
    return made


@functools.cache
def goal_env() -> envs.WaypointGoalEnv:
    made = envs.WaypointGoalEnv()
    made.reset(seed=0)
    return made


@functools.cache
def vec_env() -> sb3.WalkerVecEnv:
    made = sb3.WalkerVecEnv(2, "Heading")
    made.reset()
    return made


@functools.cache
def policy() -> agents.Policy:
    return agents.load("LeanYaw/Heading-v1")


def step_sb3(actions: Any) -> Any:
    vec_env().step_async(actions)
    return vec_env().step_wait()


def constant(value: Any) -> Callable[[], Any]:
    return lambda: value


OPTIONS = {
    "parameters": (3, "word", [0.1], {"hip": 0.3}, {"slope": "steep"}, {3: 0.1}),
    "inter_leg_angle_range": number(-0.1, 0.3), "mass_offset_range": number(-0.1, 1.1),
    "max_offset_change": optional(number(-0.1, 2.1)), "horizon": optional(POSITIVE),
    "start_disturbance": number(-0.1, 5.1), "mirror": FLAG, "slope": optional(number(0.6)),
    "friction_limit": optional(POSITIVE), "sensor_noise": number(-0.1, 11.0), "action_delay": FLAG,
    "hidden_rates": optional(FLAG), "random_body": optional(NAME), "push_level": optional(number(-0.1, 11.0)),
    "show_body": FLAG,
}  # fmt: skip
PARAMETERS = {
    "hip_width": number(-0.1, 2.1), "foot_radius": number(-0.1, 1.0), "ankle_tilt": number(0.0, 1.6),
    "slope": number(-0.6, 0.6), "ankle_stiffness": number(-0.1, 101.0),
    "ankle_damping": number(-0.1, 101.0), "slope_turns": FLAG, "early_contact": NAME,
    "shift_time": number(0.0, 11.0), "friction_limit": POSITIVE, "max_step_duration": DURATION,
}  # fmt: skip
RESET = {
    "seed": SEED,
    "options": (
        3,
        "word",
        ["state"],
        {"speed": 1.0},
        {3: 1},
        {"state": [0.1]},
        {"stance": "up"},
        {"command": "left"},
    ),
}
SET_STATE = {"state": (*OBJECT[1:], {}, {"walkers": 3}, {"walkers": np.zeros(3)})}
GOAL = {
    "achieved_goal": (None, 3.0, "word", {"a": 1}, ["a", "b"], [0.1] * 3, [[0.1], [0.1, 0.2]]),
    "info": OBJECT[:3],
}
GOAL["desired_goal"] = GOAL["achieved_goal"]
REWARD = {"achieved_goal": GOALS, "desired_goal": GOALS, "info": {}}
VECTOR = {
    "num_envs": count(0), "task": TASK, "autoreset_mode": NAME, "copy": FLAG, "step_info": FLAG,
    "threads": count(0), "max_episode_steps": optional(count(0)), "render_mode": optional(NAME),
}  # fmt: skip
OBSERVATIONS = (
    None,
    3.0,
    "word",
    {"a": 1},
    ["a"] * 7,
    [NAN] * 7,
    [0.1] * 3,
    [[0.1], [0.1, 0.2]],
    [1j] * 7,
)
PREDICT = {"observation": OBSERVATIONS, "deterministic": FLAG}
AXES = (
    *OBJECT,
    {},
    {"hip": [0.1]},
    {"slope": 0.1},
    {"slope": []},
    {"slope": ["a"]},
    {"slope": [0.2, 0.1]},
    {"slope": [NAN]},
)
AXIS = (
    None,
    3,
    "ab",
    [0.1],
    ("no", [0.1]),
    ("heading", 0.1),
    ("stance_pitch", ["a"]),
    ("stance_pitch", [0.2, 0.1]),
    ("stance_pitch", []),
)
LIMITS = (*OTHERS[:4], {"a": 1}, (0.1,), (0.1, "a"), (0.1, NAN), (0.1, 0.1))
SIZE = (*OBJECT, (640,), (640, 360.5), (0, 360), ("640", 360), (True, 360))

ROWS = {
    "Walker": Row(constant(Walker), {}, {"parameters": OBJECT}),
    "Walker.step": Row(constant(WALKER.step), {"state": GAIT}, {"state": STATE, **FOOT, **COMMAND}),
    "Walker.walk": Row(
        constant(WALKER.walk),
        {"n_steps": 1, "state": GAIT},
        {
            "n_steps": count(0),
            "state": STATE,
            **FOOT,
            **COMMAND,
            "samples_per_step": count(1),
        },
    ),
    "Walker.stance_motion": Row(
        constant(WALKER.stance_motion),
        {"state": GAIT, "duration": 0.1},
        {"state": STATE, "duration": DURATION, "samples": SAMPLES, **FOOT, **COMMAND},
    ),
    "Walk.save": Row(
        lambda: WALKER.walk(1, state=GAIT).save,
        {},
        {"path": (*PATH, "walk.txt", "no/such/walk.json")},
    ),
    "WalkerParameters": Row(constant(WalkerParameters), {}, PARAMETERS),
    "find_limit_cycle": Row(
        constant(find_limit_cycle), {"walker": WALKER}, {"walker": OBJECT, **PAIR_COMMAND}
    ),
    # --- passive walkers and batches
    "PassiveWalker": Row(
        constant(passive.PassiveWalker),
        {"parameters": BODY},
        {"parameters": OBJECT, "planar": FLAG},
    ),
    "PassiveWalker.step": Row(
        constant(PASSIVE.step),
        {"state": PASSIVE_GAIT},
        {"state": PASSIVE_STATE, **FOOT, "inter_leg_angle": optional(number(-1.6, 1.6))},
    ),
    "PassiveWalker.walk": Row(
        constant(PASSIVE.walk),
        {"n_steps": 1, "state": PASSIVE_GAIT},
        {"n_steps": count(0), "state": PASSIVE_STATE, **FOOT},
    ),
    "PassiveWalker.motion": Row(
        constant(PASSIVE.motion),
        {"state": PASSIVE_GAIT, "duration": 0.1},
        {
            "state": PASSIVE_STATE,
            "duration": DURATION,
            "samples": SAMPLES,
            **FOOT,
            "inter_leg_angle": optional(number(-1.6, 1.6)),
        },
    ),
    "require_passive_state": Row(
        constant(passive.require_passive_state),
        {},
        {"state": PASSIVE_STATE},
        free=("planar", "name"),
    ),
    "bodies_of": Row(
        constant(batch.bodies_of),
        {},
        {"parameters": (*OBJECT, [BODY, 3], np.zeros((1, 3)), np.full((1, 11), NAN))},
    ),
    "step_batch": Row(
        constant(batch.step_batch),
        {"parameters": BODY, "states": [GAIT], "sides": 1.0},
        {
            "parameters": (*OBJECT, [BODY, BODY], [BODY, 3]),
            "states": (*LISTS, [[0.1] * 4], [[NAN] * 5], [[2.0] * 5]),
            "sides": number(0.0, 2.0),
            "inter_leg_angles": ANGLE,
            "mass_offsets": OFFSET,
            "previous_offsets": optional(OFFSET),
            "threads": count(0, 2000),
            "device": NAME,
        },
    ),
}

WALK_OF = {"walker": OBJECT, **PAIR_COMMAND}
N_STEPS = count(0)
CAPTURE = {
    **WALK_OF, "states": (*LISTS, [[0.1] * 4]), "choices": OBJECT[1:], "most_steps": count(99), "settle_steps": count(0),
    "threads": count(0, 2000),
}  # fmt: skip
ROWS |= {
    "ActiveMap": Row(
        constant(analysis.ActiveMap),
        {"walker": WALKER},
        {"walker": OBJECT, **PAIR_COMMAND, "n_steps": N_STEPS},
    ),
    "PassiveMap": Row(
        constant(analysis.PassiveMap), {"walker": PASSIVE}, {"walker": OBJECT, "n_steps": N_STEPS}
    ),
    "ActiveMap.require_state": Row(constant(ACTIVE_MAP.require_state), {}, {"state": STATE}),
    "PassiveMap.require_state": Row(
        constant(PASSIVE_MAP.require_state), {}, {"state": PASSIVE_STATE}
    ),
    **{
        f"{kind}.value": Row(constant(section_map.value), {}, {"parameter": NAME})
        for kind, section_map in MAPS.items()
    },
    **{
        f"{kind}.moved": Row(
            constant(section_map.moved), {"value": 0.1}, {"parameter": NAME}, free=("value",)
        )
        for kind, section_map in MAPS.items()
    },
    "SectionMap.over": Row(constant(ACTIVE_MAP.over), {}, {"n_steps": N_STEPS}),
    **{
        f"{kind}.along": Row(constant(section_map.along), {}, {"parameter": NAME})
        for kind, section_map in MAPS.items()
    },
    "SectionMap.linearise": Row(
        constant(ACTIVE_MAP.linearise),
        {"state": GAIT},
        {"state": STATE, "parameter": optional(NAME)},
    ),
    "SectionMap.derivative": Row(constant(ACTIVE_MAP.derivative), {}, {"state": STATE}),
    "SectionMap.sensitivity": Row(
        constant(ACTIVE_MAP.sensitivity),
        {"state": GAIT, "parameter": "slope"},
        {"state": STATE, "parameter": optional(NAME)},
    ),
    "basin": Row(
        constant(analysis.basin),
        {
            "walker": WALKER,
            "x": ("stance_pitch", [0.1]),
            "y": ("ankle_angle", [0.0]),
            "centre": GAIT,
            "n_steps": 1,
        },
        {
            **WALK_OF,
            "x": AXIS,
            "y": AXIS,
            "centre": optional(STATE),
            "n_steps": N_STEPS,
            "path": optional(PATH),
            "engine": OBJECT,
            "progress": FLAG,
        },
    ),
    "Atlas": Row(
        constant(analysis.Atlas),
        lambda: {"gaits": atlas().gaits},
        {"gaits": (*OBJECT, xarray.Dataset()), "basins": (*OBJECT[1:], xarray.Dataset())},
    ),
    "Atlas.nearest_stable": Row(lambda: atlas().nearest_stable, {}, {"slope": FINITE}),
    "Atlas.fastest_stable": Row(
        lambda: atlas().fastest_stable,
        {},
        {"slope": (*OBJECT, (0.01,), ("a", 0.1), (NAN, 0.1), (0.5, 0.6)), "hip": ((0.1, 0.2),)},
    ),
    "Atlas.largest_basin": Row(lambda: atlas().largest_basin, {}, {"speed": number(-0.1)}),
    "basin_sizes": Row(
        constant(analysis.basin_sizes),
        lambda: {"gaits": atlas().gaits},
        {
            "gaits": (*OBJECT, xarray.Dataset()),
            "every": count(0),
            "n_steps": N_STEPS,
            "path": optional(PATH),
            "engine": OBJECT,
            "progress": FLAG,
        },
    ),
    "Engine": Row(
        constant(analysis.Engine),
        {},
        {
            "threads": count(0, 2000),
            "workers": optional(count(0, 2000)),
            "scheduler": (3, b"tcp://host", [], ""),
        },
    ),
    "Engine.started": Row(lambda: analysis.Engine().started, free=("says_where",)),
    "continue_gait": Row(
        constant(analysis.continue_gait),
        {"walker": WALKER, "parameter": "slope", "limits": (0.009, 0.011), "most_points": 2},
        {
            **WALK_OF,
            "parameter": NAME,
            "limits": LIMITS,
            "state": optional(STATE),
            "n_steps": optional(N_STEPS),
            "upward": FLAG,
            "longest_step": POSITIVE,
            "most_points": count(0),
            "progress": FLAG,
        },
    ),
    "find_gait": Row(constant(analysis.find_gait), {"walker": WALKER}, WALK_OF),
    "find_passive_gaits": Row(constant(analysis.find_passive_gaits), {}, {"walker": OBJECT}),
    "find_periodic_gait": Row(
        constant(analysis.find_periodic_gait),
        {"walker": WALKER, "n_steps": 2},
        {**WALK_OF, "n_steps": N_STEPS},
    ),
    "floor_demand": Row(
        constant(analysis.floor_demand), {"walker": WALKER}, {**WALK_OF, "samples": SAMPLES}
    ),
    "largest_disturbance": Row(
        constant(analysis.largest_disturbance),
        {
            "walker": WALKER,
            "coordinate": "stance_pitch",
            "n_steps": 1,
            "most": 0.1,
            "tolerance": 0.1,
        },
        {
            **WALK_OF,
            "coordinate": NAME,
            "upward": FLAG,
            "relative": FLAG,
            "most": POSITIVE,
            "tolerance": POSITIVE,
            "n_steps": N_STEPS,
        },
    ),
    "largest_pushes": Row(
        constant(analysis.largest_pushes),
        lambda: {"cycle": cycle(), "n_steps": 1, "directions": 1, "most": 0.1},
        {"cycle": OBJECT, "directions": count(0), "most": POSITIVE, "n_steps": N_STEPS},
    ),
    "load_dataset": Row(
        constant(analysis.load_dataset), {}, {"path": (*PATH, "no-such-file.nc", __file__)}
    ),
    "save_dataset": Row(
        constant(analysis.save_dataset),
        lambda: {"dataset": xarray.Dataset(), "path": "x.nc"},
        {"dataset": OBJECT, "path": PATH},
    ),
    "modes": Row(constant(analysis.modes), {}, {"cycle": OBJECT}),
    "planar_gait_rate": Row(
        constant(analysis.planar_gait_rate),
        {"walker": WALKER, "inter_leg_angle": 0.3},
        {"walker": OBJECT, "inter_leg_angle": ANGLE, "heading": FINITE},
    ),
    "section_map_of": Row(constant(analysis.section_map_of), {"walker": WALKER}, WALK_OF),
    "stability_map": Row(
        constant(analysis.stability_map),
        {"walker": WALKER, "axes": {"slope": [0.01]}},
        {
            **WALK_OF,
            "axes": AXES,
            "path": optional(PATH),
            "engine": OBJECT,
            "progress": FLAG,
        },
    ),
    "map_cost": Row(
        constant(analysis.map_cost),
        {"walker": WALKER, "axes": {"slope": [0.01]}},
        {**WALK_OF, "axes": AXES},
    ),
    "stable_speeds": Row(
        constant(analysis.stable_speeds),
        {"walker": WALKER},
        {"walker": OBJECT, "inter_leg_angle": ANGLE},
    ),
    "require_axis": Row(
        constant(storage.require_axis),
        {"name": "values"},
        {"values": (*LISTS, [], [0.2, 0.1], [NAN])},
        free=("name", "low", "high"),
    ),
    "LimitCycle.show": Row(lambda: cycle().show, {}, {"n_steps": N_STEPS, "height": count(0)}),
    "LimitCycle.stance_motion": Row(
        lambda: cycle().stance_motion,
        lambda: {"step": cycle().steps[0]},
        {"step": OBJECT, "samples": SAMPLES},
    ),
    "Walk.show": Row(lambda: WALKER.walk(1, state=GAIT).show, {}, {"height": count(0)}),
    "Choices": Row(
        constant(analysis.Choices),
        {},
        {
            "inter_leg_angles": (*LISTS[:1], *LISTS[2:], [0.2, 0.1], [-0.1], [NAN]),
            "mass_offsets": (*LISTS[:1], *LISTS[2:], [0.2, 0.1], [0.1], [NAN]),
            "largest_change": number(-0.1),
        },
    ),
    "capture": Row(
        constant(analysis.capture),
        {"walker": WALKER, "states": [GAIT], "settle_steps": 1},
        CAPTURE | {"known": OBJECT[1:]},
    ),
    "refine_capture": Row(
        constant(analysis.refine_capture),
        {"walker": WALKER, "states": [GAIT], "settle_steps": 1, "most_steps": 0, "most_levels": 1},
        CAPTURE | {"tolerance": number(-0.1, 1.1), "most_levels": count(0, 7)},
    ),
    "capture_map": Row(
        constant(analysis.capture_map),
        {
            "walker": WALKER,
            "axes": {"stance_pitch": [0.15]},
            "centre": GAIT,
            "settle_steps": 1,
            "most_steps": 0,
        },
        {name: kind for name, kind in CAPTURE.items() if name not in ("states", "threads")}
        | {
            "axes": AXES,
            "centre": optional(STATE),
            "path": optional(PATH),
            "engine": OBJECT,
            "progress": FLAG,
        },
    ),
    "Branch.cycle": Row(lambda: branch().cycle, {}, {"index": (None, True, "3", 1.5, 1000, [1])}),
    # --- environments
    "EnvOptions": Row(constant(envs.EnvOptions), {}, OPTIONS),
    "EnvOptions.of": Row(
        constant(envs.EnvOptions.of),
        {},
        {"arguments": (None, 3, "word", {"mirorr": True}, {3: 1})},
        ("others",),
    ),
    **{
        f"EnvOptions.{name}": Row(
            functools.partial(getattr, envs.EnvOptions(), name), {}, {"task": OBJECT}
        )
        for name in ("for_task", "walker_parameters", "observation_names", "observation_space")
    },
    "Task": Row(
        constant(envs.Task),
        {"name": "Mine", "reward": len, "metrics": {}, "summary": "", "reward_text": ""},
        {
            "metrics": (None, 3, "word", {"x": envs.Metric("no-such-field")}),
            "fields": (3, [3], (envs.Field("heading", "", ""),)),
            "commands": (3, "word", {"x": envs.Command(("no-such-field",), 0.0, 1.0, "")}),
            "heading_field": ("no-such-field", 3),
            "goal_fields": (("no-such-field", "time"), 3),
            "parameters": OBJECT,
            "horizon": POSITIVE,
            "max_offset_change": number(-0.1, 2.1),
            "push_level": number(-0.1, 11.0),
            "pumping": OFFSET,
            "goal_radius": POSITIVE,
            "is_ranked": FLAG,
            "hidden_rates": FLAG,
            "random_body": NAME,
            "body_reach": ("word", (0.1,), (NAN, 0.1, 0.1, 0.1), (-0.1, 0.1, 0.1, 0.1)),
            "slope_varies": FLAG,
        },
        free=(
            "name",
            "reward",
            "summary",
            "reward_text",
            "history",
            "start",
            "update",
            "refresh",
            "features",
            "observed",
            "ends",
            "reference_path",
            "headline",
        ),
    ),
    "task_named": Row(constant(envs.task_named), {}, {"task": TASK}),
    "register_task": Row(
        constant(envs.register_task),
        {"task": envs.task_named("Walk"), "env_id": "Mine/Walk-v0"},
        {
            "task": OBJECT,
            "env_id": (None, 3, "", "no version"),
            "reward_threshold": optional(FINITE),
        },
    ),
    "register_id": Row(
        constant(registration.register_id),
        {"env_id": "Mine/Walk-v0", "task": "Walk"},
        {"env_id": (None, 3, "", "no version"), "reward_threshold": optional(FINITE)},
        free=("task",),
    ),
    "name_of_task": Row(constant(registration.name_of_task), free=("task",)),
    "Simulation": Row(
        constant(envs.Simulation),
        {"task": envs.task_named("Walk"), "options": envs.EnvOptions(), "n": 1},
        {"task": OBJECT, "options": OBJECT, "n": count(0), "max_episode_steps": optional(count(0))},
    ),
    "WalkerEnv": Row(
        constant(envs.WalkerEnv),
        {},
        {"task": TASK, "render_mode": optional(NAME), "options": ()} | OPTIONS,
    ),
    "WalkerEnv.reset": Row(lambda: env().reset, {}, RESET),
    "WalkerEnv.step": Row(lambda: env().step, {}, {"action": ACTION}),
    "WalkerEnv.set_state": Row(lambda: env().set_state, {}, SET_STATE),
    "WalkerEnv.picture": Row(lambda: env().picture, {}, {"share": number(-0.1, 1.1)}),
    "RealTime": Row(
        constant(envs.RealTime),
        lambda: {"env": envs.WalkerEnv(render_mode="rgb_array")},
        {"env": OBJECT, "fps": count(0, 121), "speed": number(0.0, 11.0)},
    ),
    "WalkerVectorEnv": Row(constant(envs.WalkerVectorEnv), {}, VECTOR, free=("options",)),
    "WalkerVectorEnv.reset": Row(
        lambda: vector_env().reset,
        {},
        {
            "seed": (*SEED, [1], [1, 2, 3], [1, "3"], [1, 1.5], [1, True]),
            "options": (
                *RESET["options"],
                {"reset_mask": [True, True]},
                {"reset_mask": np.zeros(2, bool)},
                {"reset_mask": 3},
            ),
        },
    ),
    "WalkerVectorEnv.step": Row(
        lambda: vector_env().step,
        {},
        {
            "actions": (
                *ACTION,
                [[0.0, 0.0]] * 3,
                [["a", "b"]] * 2,
                [[NAN, 0.0]] * 2,
                [[1j, 0j]] * 2,
                [[True, False]] * 2,
            )
        },
    ),
    "WalkerVectorEnv.set_state": Row(lambda: vector_env().set_state, {}, SET_STATE),
    "WaypointGoalEnv": Row(
        constant(envs.WaypointGoalEnv),
        {},
        {"render_mode": optional(NAME), "mirror": FLAG},
        free=("options",),
    ),
    "WaypointGoalVectorEnv": Row(
        constant(envs.WaypointGoalVectorEnv), {}, {**VECTOR, "task": ()}, free=("arguments",)
    ),
    "WaypointGoalEnv.reset": Row(lambda: goal_env().reset, {}, RESET),
    "WaypointGoalEnv.step": Row(lambda: goal_env().step, {}, {"action": ACTION}),
    **{
        f"GoalRules.{name}": Row(lambda name=name: getattr(goal_env(), name), REWARD, GOAL)
        for name in ("compute_reward", "compute_terminated", "compute_truncated")
    },
    "WalkerVecEnv": Row(
        constant(sb3.WalkerVecEnv),
        {"num_envs": 1},
        {
            name: VECTOR[name]
            for name in ("num_envs", "task", "step_info", "threads", "render_mode")
        },
        free=("options",),
    ),
    "WalkerVecEnv.step_async": Row(
        constant(step_sb3),
        {},
        {"actions": (None, 3.0, "word", {"a": 1}, [["a", "b"]] * 2, [[NAN, 0.0]] * 2, [[0.0]] * 2)},
    ),
    "WalkerVecEnv.restore": Row(
        lambda: vec_env().restore, {}, {"snapshot": (*OBJECT, {}, {"episode_returns": 3})}
    ),
    "WalkerVecEnv.get_attr": Row(
        lambda: vec_env().get_attr,
        {"attr_name": "task"},
        {"attr_name": (3, None), "indices": (2, "a", 1.5, [5])},
    ),
    "WalkerVecEnv.set_attr": Row(
        lambda: vec_env().set_attr,
        {"attr_name": "mine", "value": 1},
        {"attr_name": (3, None), "indices": (0, "a", 1.5, [5])},
        free=("value",),
    ),
    "WalkerVecEnv.env_method": Row(
        lambda: vec_env().env_method,
        {"method_name": "get_state"},
        {"method_name": (3, None), "indices": (2, "a", 1.5, [5])},
        free=("method_args", "method_kwargs"),
    ),
    "WalkerVecEnv.env_is_wrapped": Row(
        lambda: vec_env().env_is_wrapped,
        {"wrapper_class": gym.Wrapper},
        {"indices": (2, "a", 1.5, [5])},
        free=("wrapper_class",),
    ),
    "GoalFromWalker": Row(
        constant(hindsight.GoalFromWalker),
        {"observation_space": envs.WaypointGoalEnv().observation_space},
        {"observation_space": OBJECT, "mirror": FLAG},
    ),
}

WHEEL = {"radius": 0.3, "mass": 2.0, "inertia_xx": 0.06, "inertia_yy": 0.12}
FRAME = {
    "mass": 4.0,
    "x": 0.9,
    "z": -0.7,
    "inertia_xx": 0.05,
    "inertia_xz": 0.0,
    "inertia_yy": 0.06,
    "inertia_zz": 0.01,
}
SPEEDS = (None, "word", True, 1j, {"a": 1}, ["a"], [], [NAN], [[0.1], [0.1, 0.2]], [[0.1, 0.2]] * 2)
MATRICES = {
    name: np.eye(2)
    for name in ("mass_matrix", "damping_matrix", "static_stiffness", "dynamic_stiffness")
}
MULTIBODY_STEP = {
    "stance": NAME,
    "inter_leg_angle": number(0.0, 3.2),
    "mass_offset": FINITE,
    "previous_offset": optional(FINITE),
}
ROWS |= {
    "Skateboard": Row(
        constant(vehicles.Skateboard),
        {},
        {
            **{name: number(0.0, -1.0, INF) for name in ("mass", "rider_height", "wheelbase", "gravity")},
            "steering_tilt": number(0.0, 1.6), "spring_stiffness": number(-1.0, INF), "damping": number(-1.0, INF),
        },
    ),
    "Skateboard.eigenvalues": Row(constant(vehicles.Skateboard().eigenvalues), {}, {"speeds": SPEEDS}),
    "Skateboard.equation_of_motion": Row(constant(vehicles.Skateboard().equation_of_motion), {}, {"speed": FINITE}),
    "Skateboard.lateral_acceleration": Row(
        constant(vehicles.Skateboard().lateral_acceleration), {"lean": 0.1, "speed": 1.0}, {"lean": SPEEDS[:-1], "speed": SPEEDS[:-1]}
    ),
    "Skateboard.motion": Row(
        constant(vehicles.Skateboard().motion),
        {"speed": 1.0, "times": [0.0, 1.0]},
        {"speed": FINITE, "times": SPEEDS, "lean": FINITE, "lean_rate": FINITE},
    ),
    "Wheel": Row(constant(vehicles.Wheel), WHEEL, {name: number(-1.0, INF) for name in WHEEL}),
    "FrameBody": Row(constant(vehicles.FrameBody), FRAME, {name: FINITE for name in FRAME}),
    "BicycleParameters": Row(
        constant(vehicles.BicycleParameters),
        {},
        {
            "wheelbase": POSITIVE, "trail": FINITE, "steer_axis_tilt": number(1.6), "gravity": POSITIVE,
            **{name: OBJECT for name in ("rear_wheel", "rear_frame", "front_frame", "front_wheel")},
        },
    ),
    "LinearBicycle": Row(constant(vehicles.LinearBicycle), MATRICES, {name: MATRIX for name in MATRICES}),
    "LinearBicycle.eigenvalues": Row(constant(BICYCLE.eigenvalues), {}, {"speeds": SPEEDS}),
    "LinearBicycle.state_matrix": Row(constant(BICYCLE.state_matrix), {}, {"speeds": SPEEDS}),
    "LinearBicycle.modes": Row(constant(BICYCLE.modes), {}, {"speed": FINITE}),
    "LinearBicycle.motion": Row(
        constant(BICYCLE.motion),
        {"speed": 1.0, "times": [0.0, 1.0]},
        {"speed": FINITE, "times": SPEEDS, **{name: FINITE for name in ("lean", "steer", "lean_rate", "steer_rate")}},
    ),
    "benchmark_bicycle": Row(constant(vehicles.benchmark_bicycle), {}, {"parameters": OBJECT}),
    "canonical_matrices": Row(constant(vehicles.canonical_matrices), {}, {"parameters": OBJECT}),
    "critical_speed": Row(constant(vehicles.critical_speed), {}, {"vehicle": OBJECT}),
    "stable_speed_range": Row(constant(vehicles.stable_speed_range), {}, {"vehicle": OBJECT}),
    "follow_eigenvalues": Row(
        constant(vehicles.follow_eigenvalues), {"bicycle": BICYCLE, "speeds": [1.0]}, {"bicycle": OBJECT, "speeds": (*SPEEDS, [-1.0])}
    ),
    "CharacteristicPolynomial.of_matrices": Row(
        constant(vehicles.CharacteristicPolynomial.of_matrices),
        {name: np.eye(2) for name in ("mass", "damping", "static", "dynamic")},
        {name: MATRIX for name in ("mass", "damping", "static", "dynamic")},
    ),
    "MultibodyWalker": Row(
        constant(multibody.MultibodyWalker),
        {"hip_width": 0.3, "foot_radius": 0.5, "ankle_tilt": 0.55, "slope": 0.01},
        {
            "hip_width": number(-0.1, INF), "foot_radius": number(-0.1, 1.0), "ankle_tilt": number(0.0, 1.6), "slope": number(1.6),
            "foot_mass": POSITIVE, "shift_time": POSITIVE, "tolerance": number(0.0, 0.1),
        },
    ),
    "MultibodyWalker.step": Row(
        constant(MULTIBODY.step),
        {"state": GAIT},
        {"state": array(5), **MULTIBODY_STEP, "swing": NAME, "swing_rate": optional(FINITE), "trajectory": FLAG},
    ),
    "MultibodyWalker.contact_forces": Row(constant(MULTIBODY.contact_forces), {"state": GAIT}, {"state": array(5), **MULTIBODY_STEP}, free=("options",)),
    "MultibodyWalker.stance_accelerations": Row(
        constant(MULTIBODY.stance_accelerations), {"state": GAIT}, {"state": array(5), **MULTIBODY_STEP}, free=("options",)
    ),
    "find_passive_gait": Row(
        constant(multibody.find_passive_gait),
        {"walker": MULTIBODY, "guess": [*PASSIVE_GAIT, -0.3]},
        {"walker": OBJECT, "guess": array(7), "difference": POSITIVE, "residual": POSITIVE, "max_iterations": count(0)},
    ),
    "table3_c_eigenvalues": Row(
        constant(multibody.table3_c_eigenvalues),
        {"foot_mass": 0.001},
        {"foot_mass": POSITIVE, "ankle_tilt": number(0.0, 1.6), "slope": number(1.6), "difference": POSITIVE},
    ),
    # --- pictures
    "Pose": Row(
        constant(rendering.Pose),
        {"state": GAIT},
        {"state": array(5), **FOOT, "inter_leg_angle": number(1.6), "mass_offset": OFFSET, "contact": array(2)},
    ),
    "Scene": Row(
        constant(rendering.Scene),
        {"parameters": BODY, "pose": POSE},
        {
            "parameters": OBJECT, "pose": OBJECT, "footprints": LISTS, "headings": (3.0, "word", ["a"]), "feet": (3, ["left"]),
            "path": LISTS, "commanded_heading": optional(FINITE), "goals": (3, [3], [(0.0, 0.0, -1.0, True)]),
            "reference_path": optional(LISTS), "lines": (3,),
        },
    ),
    "Renderer": Row(constant(rendering.Renderer), {}, {"size": SIZE}),
    "Renderer.frame": Row(lambda: rendering.Renderer().frame, {}, {"scene": OBJECT}),
    "Renderer.show": Row(lambda: rendering.Renderer().show, {"scene": SCENE}, {"scene": OBJECT, "fps": POSITIVE}),
    "draw_walker": Row(
        constant(rendering.draw_walker), {"parameters": BODY, "path": "x.png"}, {"parameters": OBJECT, "path": (*PATH, "x.doc", "no/such/x.png")}
    ),
    "save_footprints": Row(
        constant(rendering.save_footprints),
        lambda: {"walks": {"one": WALKER.walk(1, state=GAIT)}, "path": "x.png"},
        {"walks": (*OBJECT[:-1], {"a": 1}), "path": (*PATH, "x.doc", "no/such/x.png"), "foot_radius": number(-0.1, 1.0)},
    ),
    "draw_footprints": Row(
        constant(rendering.draw_footprints),
        lambda: {"walks": {"one": WALKER.walk(1, state=GAIT)}, "axes": ()},
        {"walks": (*OBJECT[:-1], {"a": 1}), "foot_radius": number(-0.1, 1.0), "places": (3.0, "word", [[0.1] * 3])},
        free=("axes",),
    ),
    "film": Row(
        constant(rendering.film),
        {"walker": WALKER, "n_steps": 1, "path": "x.gif", "state": GAIT, "progress": False},
        {
            "walker": OBJECT, "n_steps": count(0), "path": (*PATH, "x.doc", "no/such/x.gif"), "state": STATE, **FOOT, **COMMAND,
            "commanded_heading": optional(FINITE), "fps": number(0, 121), "seconds_per_time_unit": number(0.0, 101.0),
            "swing_share": number(-0.1, 1.1), "size": SIZE, "progress": FLAG,
        },
    ),
    "status_lines": Row(
        constant(rendering.status_lines),
        {"step": 1, "time": 1.0},
        {
            "step": count(), "time": FINITE, "speed": optional(FINITE), "heading": optional(FINITE),
            "commanded_heading": optional(FINITE), "status": (None, 3, ["a"]),
        },
    ),
    "walker_shape": Row(constant(rendering.walker_shape), {"parameters": BODY, "pose": POSE}, {"parameters": OBJECT, "pose": OBJECT}),
    # --- agents
    "load": Row(
        constant(agents.load),
        {"source": "LeanYaw/Heading-v1"},
        {
            "source": (None, 3, "", ["a"]), "env_id": (3, "LeanYaw/Walk-v1", ["a"]), "algorithm": (3, "sca", ["a"], ""),
            "seed": optional((*SEED, 10**6)),
        },
    ),
    "save": Row(
        constant(agents.save), lambda: {"policy": policy(), "folder": Path("x")}, {"policy": OBJECT, "folder": (None, 3, ["a"])}
    ),
    "shipped_seeds": Row(
        constant(agents.shipped_seeds), {"env_id": "LeanYaw/Heading-v1"}, {"env_id": (None, 3, "", ["a"]), "algorithm": (None, 3, "Sca!", ["a"])}
    ),
    "make_agent": Row(
        constant(agents.make_agent), {"name": "fixed", "request": agents.AgentRequest("LeanYaw/Walk-v1", envs.EnvOptions())}, {"name": NAME, "request": OBJECT}
    ),
    "AgentRequest": Row(
        constant(agents.AgentRequest),
        {"env_id": "LeanYaw/Walk-v1", "options": envs.EnvOptions()},
        {
            "env_id": (None, 3, "", ["a"]), "options": OBJECT, "seed": (None, *SEED), "path": (3, ["a"]), "runs": (3, ["a"]),
        },
    ),
    "RandomController": Row(constant(agents.RandomController), {}, {"seed": (None, *SEED)}, free=("layout",)),
    "FixedController": Row(constant(agents.FixedController), free=("layout",)),
    "HeadingFeedback": Row(
        constant(agents.HeadingFeedback), {}, {"task": (None, 3, "", "Walk"), "options": OBJECT[1:], "gains": OBJECT[1:]}
    ),
    "HeadingGains": Row(
        constant(agents.HeadingGains),
        {},
        {
            **{
                name: FINITE
                for name in ("proportional", "ankle", "ankle_rate", "feedforward", "inter_leg_angle", "speed", "speed_error", "pumping_by_speed")
            },
            "pumping": OBJECT,
        },
    ),
    "MemorylessController.predict": Row(
        constant(agents.HeadingFeedback().predict),
        {"observation": np.zeros(7)},
        {"observation": OBSERVATIONS},
        free=("state", "episode_start", "deterministic"),
    ),
    "make_dataset": Row(
        constant(datasets.make_dataset),
        {"task": "Heading", "kind": "random", "out": Path("made")},
        {
            "task": TASK, "kind": NAME, "out": PATH, "expert": NAME, "episodes": count(0, 2**13), "seed": count(2**19), "progress": FLAG,
        },
    ),
    "normalised": Row(constant(references.normalised), {"task": "Heading", "value": 1.0}, {"task": TASK, "value": OTHERS}),
    "read_references": Row(constant(references.read_references), {}, {"file": PATH}),
    "references": Row(constant(references.references)),
    "Policy.predict": Row(lambda: policy().predict, {"observation": np.zeros(7)}, PREDICT, free=("state", "episode_start")),
}  # fmt: skip


RESULTS = {
    "Agent", "BatchResult", "BicycleMotion", "Branch", "CanonicalMatrices", "CharacteristicPolynomial", "ClosedLoopMap", "Command",
    "ContactForces", "ControlInterface", "Disturbance", "DoubleRoot", "EigenvalueBranches", "EnergyLedger", "Event", "Fall", "FallCode",
    "Feature", "FellError", "Field", "FloorDemand", "ForceExtremes", "Goal", "HindsightReplay", "LargestPushes", "LeanEquation",
    "LeanYawError", "Reference", "LegShape", "LimitCycle", "Metric", "Mode", "MultibodyStep", "NoGaitError", "PassiveGait", "PassiveStep",
    "PassiveWalk", "Policy", "PolicyCard", "PolicyFileError", "Capture", "SectionMap", "SkateboardMotion", "SolverError",
    "SpeedRange", "StepDemand", "StepResult", "Table3Column", "Trajectory", "Walk", "WalkerShape",
}  # fmt: skip
"""Classes that the package makes, not its user: results, errors, tables of a task; and protocols."""
INSIDE = {
    "fall_of", "formula", "normal", "step_passive_rows", "uniform",
    "Simulation", "CharacteristicPolynomial.derivative", "CharacteristicPolynomial.eigenvalue_rate", "ControlInterface", "ClosedLoopMap",
    "Agent", "Engine.started", "GoalFromWalker.forward", "progress_bar", "require_memory", "Capture.share", "Body.ankle_rotation", "LegShape.axis_ends",
    "RealTime.reset", "RealTime.step", "SectionMap.step_commanded", "ActiveMap.step_commanded", "Task.measure", "SectionMap.image",
    *(f"{kind}.{name}" for kind in ("SectionMap", "ActiveMap", "PassiveMap") for name in ("linear_step", "results", "step_many")),
    "SectionMap.require_state",
}  # fmt: skip
"""Functions, methods, or all methods of a class, that take what the package itself has checked: they run in inner loops."""

MODULES = (
    "lean_yaw_env", "lean_yaw_env.analysis", "lean_yaw_env.analysis.storage", "lean_yaw_env.batch", "lean_yaw_env.envs",
    "lean_yaw_env.envs.hindsight", "lean_yaw_env.envs.sb3", "lean_yaw_env.multibody", "lean_yaw_env.passive",
    "lean_yaw_env.engine", "lean_yaw_env.registration", "lean_yaw_env.rendering", "lean_yaw_env.vehicles", "agents", "agents.datasets",
    "agents.references",
)  # fmt: skip
"""Modules whose functions and classes are for users; of a package, those that it exports."""
BEHIND = (
    # commands, whose table is in test_bad_commands.py, and what they call
    "agents.__main__", "agents.command_line", "agents.evaluation", "agents.learning", "agents.options", "agents.shipping", "agents.tuning",
    "lean_yaw_env.cli", "lean_yaw_env.compile", "lean_yaw_env.paper", "lean_yaw_env.plots", "lean_yaw_env.viewer",
    # what the modules above are made of
    "agents.agent", "agents.controllers", "agents.observations", "agents.policies", "agents.registry", "agents.seeds", "agents.settings",
    "lean_yaw_env.errors", "lean_yaw_env.extras", "lean_yaw_env.files", "lean_yaw_env.kernel", "lean_yaw_env.parameters",
    "lean_yaw_env.lazy", "lean_yaw_env.reporting", "lean_yaw_env.tables", "lean_yaw_env.threads", "lean_yaw_env.validation", "lean_yaw_env.walker",
)  # fmt: skip
"""Modules and packages that users reach through a command, or through a module of the list above."""


def public_callables() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Functions and classes that the modules export, and the public methods of those classes, by qualified name."""
    for place in MODULES:
        module = importlib.import_module(place)
        own = [name for name, it in vars(module).items() if getattr(it, "__module__", "") == place]
        for name in getattr(module, "__all__", own):
            exported = getattr(module, name)
            if name.startswith("_") or not callable(exported):
                continue
            yield getattr(exported, "__name__", name), exported
            for method in dir(exported) if inspect.isclass(exported) else ():
                function = inspect.getattr_static(exported, method)
                function = getattr(function, "__func__", function)
                home = getattr(function, "__module__", None) or ""
                is_own = home.startswith(("lean_yaw_env", "agents"))
                is_method = inspect.isfunction(function) and "." in function.__qualname__
                if is_method and is_own and not method.startswith("_"):
                    yield function.__qualname__, function


def arguments_of(function: Callable[..., Any]) -> list[str]:
    parameters = inspect.signature(function).parameters.values()
    gathered = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return [
        each.name
        for each in parameters
        if each.kind not in gathered and each.name not in ("self", "cls")
    ]


def test_every_argument_of_every_public_callable_is_in_the_table() -> None:
    missing, known = [], set[str]()
    for name, function in public_callables():
        known.add(name)
        if name in RESULTS | INSIDE or name.split(".")[0] in INSIDE:
            continue
        covered = {*ROWS[name].bad, *ROWS[name].free} if name in ROWS else set[str]()
        missing += [f"{name}({each})" for each in arguments_of(function) if each not in covered]
    assert not missing
    assert {*ROWS, *RESULTS, *INSIDE} <= known


def test_every_module_is_in_the_table_or_behind_what_is() -> None:
    known = {*MODULES, *BEHIND}
    new = []
    for root in (lean_yaw_env, agents):
        for module in pkgutil.iter_modules(root.__path__, f"{root.__name__}."):
            new += [module.name] if module.name not in known else []
    assert not new


def shown(value: Any) -> tuple[str, ...]:
    """What of a value a message may show: the value, or of a collection a part of it or its shape."""
    if isinstance(value, (str, bytes, int, float, complex, type(None))):
        return (repr(value),)
    return ("got", *map(repr, value if isinstance(value, (dict, list, tuple)) else ()))


def names_in(argument: str, value: Any) -> list[str]:
    """How a message may name an argument: by its name, or by that of the part of the value which is bad; a name, by what has it."""
    parts = value if isinstance(value, (dict, list, tuple)) else ()
    named = [argument, argument.rstrip("s"), *(["agent"] if argument == "name" else [])]
    return [*named, *(str(each) for each in parts if isinstance(each, (str, int)) and each)]


CASES = [
    (name, argument) for name, row in ROWS.items() for argument in row.bad if row.bad[argument]
]


def test_the_table_has_five_hundred_bad_inputs() -> None:
    assert sum(len(ROWS[name].bad[argument]) for name, argument in CASES) >= 500


@pytest.mark.parametrize(("name", "argument"), CASES)
def test_bad_input_raises_an_error_that_names_argument_and_value(
    name: str, argument: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    row, wrong = ROWS[name], []
    call, good = row.get(), row.good() if callable(row.good) else row.good
    first = next(iter(inspect.signature(call).parameters.values()))
    for value in row.bad[argument]:
        named = {**good, argument: value}
        is_positional = first.kind is not first.KEYWORD_ONLY and first.name in named
        positional = (named.pop(first.name),) if is_positional else ()
        try:
            call(*positional, **named)
        except (ValueError, TypeError) as error:
            message = str(error)
            is_named = any(each in message for each in names_in(argument, value))
            if not (is_named and any(text in message for text in shown(value))):
                wrong.append(f"{value!r}: unclear {type(error).__name__}: {message}")
        except Exception as error:
            wrong.append(f"{value!r}: {type(error).__name__}: {error}")
        else:
            wrong.append(f"{value!r}: accepted")
    assert not wrong, f"{name}({argument}=...)\n" + "\n".join(wrong)
    assert not list(tmp_path.iterdir())
