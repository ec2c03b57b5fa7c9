"""Drawing: shapes against the kernels' formulas, cameras, pictures' contents, films, and files written whole."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from hypothesis import given, settings
from hypothesis import strategies as st

from lean_yaw_env.parameters import MIRROR, WalkerParameters
from lean_yaw_env.rendering import (
    Goal,
    Pose,
    Renderer,
    Scene,
    draw_footprints,
    draw_walker,
    film,
    save_footprints,
    status_lines,
    walker_shape,
)
from lean_yaw_env.rendering.camera import Panel, floor_camera, perspective_camera, upward
from lean_yaw_env.rendering.footprints import footprint_length, footprint_outlines
from lean_yaw_env.rendering.palette import (
    COMMAND,
    FLOOR,
    FOOT_COLOURS,
    GOAL,
    INK,
    LEFT,
    REFERENCE,
    RIGHT,
)
from lean_yaw_env.rendering.perspective import following_camera
from lean_yaw_env.rendering.picture import footprint_figure
from lean_yaw_env.walker import Walker

# Table 2's gait (left stance) to the digits that a root finder gives
GAIT = np.array([0.00153947, 0.15535772, -0.00410865, -0.41511029, -0.07015602])
# Products of a dozen rotation matrices of entries up to one: rounding, with room
ROUNDING = 1e-12
WALKERS = st.builds(
    WalkerParameters,
    hip_width=st.floats(0.0, 0.6),
    foot_radius=st.floats(0.0, 0.9),
    ankle_tilt=st.floats(0.2, 1.2),
)
STATES = st.tuples(
    st.floats(-3.0, 3.0), st.floats(-0.1, 0.4), st.floats(-0.3, 0.3), st.just(0.0), st.just(0.0)
).map(np.array)
FEET = st.sampled_from(["left", "right"])
ANGLES = st.floats(0.1, 0.5)
OFFSETS = st.floats(-0.1, 0.1)


@pytest.fixture(scope="module")
def walker() -> Walker:
    return Walker()


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer()


def scene_of(walker: Walker, n_steps: int, **more) -> Scene:
    walk = walker.walk(n_steps, state=GAIT, samples_per_step=8, **more.pop("command", {}))
    pose = Pose(
        walk.states[-1],
        walk.stances[-1],
        mass_offset=walk.mass_offsets[-1],
        contact=walk.footprints[-1],
    )
    return Scene(
        walker.parameters,
        pose,
        footprints=walk.footprints,
        headings=walk.headings,
        feet=walk.stances,
        path=walk.path[:, [1, 3]],
        **more,
    )


def coloured(frame: np.ndarray, colour: tuple[int, int, int], tolerance: int = 6) -> np.ndarray:
    """Where a picture has a colour; rows and columns, shape (n, 2)."""
    return np.argwhere(np.abs(frame.astype(int) - colour).max(axis=-1) <= tolerance)


# Shapes in space


@given(WALKERS, STATES, FEET, ANGLES, OFFSETS)
def test_legs_are_of_length_one_and_masses_a_hip_width_apart(
    parameters, state, foot, angle, offset
):
    shape = walker_shape(parameters, Pose(state, foot, angle, offset))
    for leg in (shape.stance_leg, shape.swing_leg):
        assert np.linalg.norm(leg.hip - leg.ankle) == pytest.approx(1.0, abs=ROUNDING)
        assert np.linalg.norm(leg.ankle_axis) == pytest.approx(1.0, abs=ROUNDING)
    left, right = shape.masses
    np.testing.assert_allclose(right - left, parameters.hip_width * shape.axle, atol=ROUNDING)


@given(WALKERS, STATES, FEET, ANGLES)
def test_both_feet_keep_their_cylinder_axes_horizontal_and_the_stance_foot_touches(
    parameters, state, foot, angle
):
    shape = walker_shape(parameters, Pose(state, foot, angle, contact=np.array([3.0, -2.0])))
    assert abs(shape.stance_leg.clearance) <= ROUNDING
    assert shape.contact[1] == 0.0
    for leg in (shape.stance_leg, shape.swing_leg):
        assert abs(leg.rotation[1, 2]) <= ROUNDING
    assert math.remainder(shape.stance_leg.heading - state[0], 2 * math.pi) == pytest.approx(
        0.0, abs=ROUNDING
    )
    assert shape.stance_leg.pitch == pytest.approx(state[1], abs=ROUNDING)


@given(WALKERS, STATES, FEET, ANGLES)
def test_each_ankle_axis_makes_the_tilt_with_its_leg(parameters, state, foot, angle):
    shape = walker_shape(parameters, Pose(state, foot, angle))
    for leg in (shape.stance_leg, shape.swing_leg):
        down = leg.ankle - leg.hip
        assert down @ leg.ankle_axis == pytest.approx(math.cos(parameters.ankle_tilt), abs=ROUNDING)
        # and the foot turns about it: the axis has the tilt from the foot's own vertical as well
        assert -leg.rotation[:, 1] @ leg.ankle_axis == pytest.approx(
            math.cos(parameters.ankle_tilt), abs=ROUNDING
        )


@given(WALKERS, STATES, FEET, ANGLES, OFFSETS)
def test_the_mirrored_state_on_the_other_foot_has_the_mirrored_shape(
    parameters, state, foot, angle, offset
):
    other = "right" if foot == "left" else "left"
    shape = walker_shape(parameters, Pose(state, foot, angle, offset))
    image = walker_shape(parameters, Pose(MIRROR * state, other, angle, -offset))
    flip = np.array([1.0, 1.0, -1.0])
    np.testing.assert_allclose(image.masses[::-1], shape.masses * flip, atol=ROUNDING)
    for mirrored, leg in (
        (image.stance_leg, shape.stance_leg),
        (image.swing_leg, shape.swing_leg),
    ):
        np.testing.assert_allclose(mirrored.ankle, leg.ankle * flip, atol=ROUNDING)
        np.testing.assert_allclose(mirrored.outer_arc, leg.outer_arc * flip, atol=ROUNDING)


@pytest.mark.parametrize("offset", [0.0, 0.006, -0.03])
@pytest.mark.parametrize("angle", [0.25, 0.3, 0.4])
def test_at_heel_strike_the_swing_foot_lies_on_the_floor_as_the_kernel_lands_it(
    walker, angle, offset
):
    state, stance, contact = GAIT, "left", np.zeros(2)
    for _ in range(4):
        command = {"stance": stance, "inter_leg_angle": angle, "mass_offset": offset}
        result = walker.step(state, **command)
        assert result.fall is None
        motion = walker.stance_motion(state, duration=result.duration, samples=2, **command)
        last = [state[0], motion["stance_pitch"][-1], motion["ankle_angle"][-1], 0.0, 0.0]
        leg = walker_shape(
            walker.parameters, Pose(np.array(last), stance, angle, offset, contact)
        ).swing_leg
        # the trace is integrated anew, by steps whose error is at round-off
        assert abs(leg.clearance) <= 1e-11
        assert leg.heading == pytest.approx(result.state[0], abs=1e-10)
        assert leg.pitch == pytest.approx(result.state[1], abs=1e-10)
        ahead = np.array([math.cos(leg.heading), -math.sin(leg.heading)])
        landed = leg.centre[[0, 2]] + walker.parameters.foot_radius * leg.pitch * ahead
        np.testing.assert_allclose(landed, contact + result.displacement, atol=1e-10)
        state, stance, contact = result.state, result.stance, contact + result.displacement


def test_the_shape_does_not_jump_when_the_feet_change_roles(walker):
    result = walker.step(GAIT)
    motion = walker.stance_motion(GAIT, duration=result.duration, samples=2)
    last = [GAIT[0], motion["stance_pitch"][-1], motion["ankle_angle"][-1], 0.0, 0.0]
    before = walker_shape(walker.parameters, Pose(np.array(last), "left", 0.3))
    after = walker_shape(
        walker.parameters, Pose(result.state, "right", -0.3, contact=result.displacement)
    )
    np.testing.assert_allclose(after.masses, before.masses, atol=1e-10)
    np.testing.assert_allclose(after.swing_leg.ankle, before.stance_leg.ankle, atol=1e-10)
    # even the foot behind, flat by its own ankle, lies as it stood
    np.testing.assert_allclose(after.swing_leg.rotation, before.stance_leg.rotation, atol=1e-9)


@settings(max_examples=25)
@given(STATES, FEET, OFFSETS)
def test_the_centre_of_mass_is_the_kernel_s(state, foot, offset):
    walker = Walker()
    motion = walker.stance_motion(
        state, duration=1e-3, samples=2, stance=foot, mass_offset=offset, previous_offset=offset
    )
    shape = walker_shape(walker.parameters, Pose(state, foot, mass_offset=offset))
    heading = state[0]
    ahead, right = motion["centre_x"][0], motion["centre_z"][0]
    expected = [
        math.cos(heading) * ahead + math.sin(heading) * right,
        motion["centre_y"][0],
        math.cos(heading) * right - math.sin(heading) * ahead,
    ]
    np.testing.assert_allclose(shape.centre, expected, atol=ROUNDING)


def test_a_positive_offset_moves_both_masses_to_the_walker_s_right():
    middle, moved = (
        walker_shape(WalkerParameters(), Pose(GAIT, mass_offset=offset)).masses
        for offset in (0.0, 0.05)
    )
    # the axle leans by less than 0.01 rad in the gait
    np.testing.assert_allclose((moved - middle)[:, 2], 0.05, atol=1e-4)


def test_a_leg_whose_ankle_axis_is_past_the_vertical_still_has_a_shape():
    pose = Pose(np.array([0.0, -0.3, 0.1, 0.0, 0.0]), "left", -0.5)
    shape = walker_shape(WalkerParameters(ankle_tilt=0.15), pose)
    assert np.isfinite(shape.swing_leg.outer_arc).all()


# Footprints and cameras


def test_a_right_footprint_is_the_mirror_image_of_a_left_one():
    left = footprint_outlines(np.zeros((1, 2)), np.array([0.3]), ["left"], 0.3)[0]
    right = footprint_outlines(np.zeros((1, 2)), np.array([-0.3]), ["right"], 0.3)[0]
    np.testing.assert_allclose(right, left * [1.0, -1.0], atol=ROUNDING)


def test_a_footprint_points_along_its_heading_and_has_its_length():
    heading = 0.4
    outline = footprint_outlines(np.array([[5.0, 2.0]]), np.array([heading]), ["left"], 0.3)[0]
    along = (outline - [5.0, 2.0]) @ [math.cos(heading), -math.sin(heading)]
    # the smooth outline goes through heel and toe, and bulges past them by a fraction of a percent
    assert along.max() == pytest.approx(0.15, rel=0.01)
    assert along.min() == pytest.approx(-0.15, rel=0.01)


@pytest.mark.parametrize("radius", [0.0, 0.05, 0.3, 0.5, 0.99])
def test_prints_of_any_foot_radius_can_be_seen_and_are_shorter_than_two_steps(radius):
    assert 0.1 <= footprint_length(radius) <= 0.6


POINTS = st.lists(
    st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)), min_size=1, max_size=8
).map(np.array)


@given(POINTS)
def test_the_camera_above_always_sees_the_walker_and_everything_that_fits(points):
    panel, border = Panel(10.0, 20.0, 500.0, 400.0), 40.0
    camera = floor_camera(
        panel, points, points[-1], border=border, least_scale=10.0, greatest_scale=100.0
    )
    assert camera.sees(points[-1])
    assert 10.0 <= camera.scale <= 100.0
    low, high = points.min(axis=0), points.max(axis=0)
    if (10.0 * (high - low) <= [400.0 - 2 * border, 500.0 - 2 * border]).all():
        assert camera.sees(points).all()


def test_the_camera_above_follows_without_jolts():
    panel, along = Panel(0.0, 0.0, 500.0, 500.0), np.linspace(0.0, 60.0, 3001)
    path = np.column_stack([along, 3.0 * np.sin(0.3 * along)])
    options = {"border": 50.0, "least_scale": 20.0, "greatest_scale": 120.0}
    cameras = [floor_camera(panel, path[: i + 1], path[i], **options) for i in range(len(path))]
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    moves = np.linalg.norm(np.diff([camera.centre for camera in cameras], axis=0), axis=1)
    # a continuous camera moves no faster than its subject, and zooms by a small factor per instant
    assert (moves <= steps + ROUNDING).all()
    assert np.abs(np.diff(np.log([camera.scale for camera in cameras]))).max() < 0.01


def test_downhill_is_up_and_right_is_right_from_above():
    panel = Panel(0.0, 0.0, 100.0, 100.0)
    camera = floor_camera(
        panel, np.zeros((0, 2)), np.zeros(2), border=0.0, least_scale=1.0, greatest_scale=10.0
    )
    np.testing.assert_allclose(
        camera.pixels(np.array([[1.0, 0.0], [0.0, 1.0]])), [[50, 40], [60, 50]]
    )


@pytest.mark.parametrize("slope", [0.2, 0.0, -0.1])
def test_in_perspective_plumb_lines_are_upright_and_what_is_twice_as_far_is_half_as_large(slope):
    up = upward(WalkerParameters(slope=slope), 0.0)
    target, panel = np.array([3.0, 0.5, -1.0]), Panel(100.0, 50.0, 300.0, 400.0)
    eye = target + np.array([-2.0, 1.0, 1.5])
    camera = perspective_camera(panel, eye, target, up, 0.6)
    middle, scale = camera.place(target)
    np.testing.assert_allclose(middle, panel.middle, atol=1e-9)  # some hundred pixels: rounding
    # the plumb line through what is looked at
    places, _ = camera.seen(target + np.outer([-0.4, 0.4], up))
    assert places[0, 0] == pytest.approx(places[1, 0], abs=1e-9)
    assert places[0, 1] > places[1, 1]
    _, twice_as_far = camera.place(eye + 2.0 * (target - eye))
    assert twice_as_far == pytest.approx(scale / 2.0, rel=1e-12)
    assert np.isnan(camera.seen((eye - (target - eye))[None])[0]).all()  # behind the camera


def test_the_floor_vanishes_at_the_horizon():
    up = upward(WalkerParameters(slope=0.2), 0.0)
    panel = Panel(0.0, 0.0, 300.0, 400.0)
    camera = perspective_camera(panel, np.array([-2.0, 1.0, 1.5]), np.zeros(3), up, 0.6)
    far = 1e9 * np.column_stack([np.cos([0.3, 0.7, 1.1]), -np.sin([0.3, 0.7, 1.1]) + 0.0])
    places = camera.on_floor(far * [1.0, -1.0])
    left, right = camera.horizon()
    expected = left + (right - left) * places[:, 0] / 300.0
    # a height of one at a distance of 1e9 is less than a millionth of a pixel
    np.testing.assert_allclose(places[:, 1], expected, atol=1e-5)


def test_a_slope_that_turns_falls_to_where_the_walker_heads():
    up = upward(WalkerParameters(slope=0.2, slope_turns=True), 0.7)
    ahead = np.array([math.cos(0.7), 0.0, -math.sin(0.7)])
    assert up @ ahead == pytest.approx(-math.sin(0.2), abs=ROUNDING)


# Pictures


def test_a_frame_has_the_size_asked_for(walker):
    frame = Renderer(size=(640, 400)).frame(scene_of(walker, 3))
    assert frame.shape == (400, 640, 3)
    assert frame.dtype == np.uint8


def test_the_same_scene_gives_the_same_pixels(walker, renderer):
    first = renderer.frame(scene_of(walker, 12, lines=("step 12",)))
    renderer.frame(scene_of(walker, 3))
    np.testing.assert_array_equal(renderer.frame(scene_of(walker, 12, lines=("step 12",))), first)
    np.testing.assert_array_equal(Renderer().frame(scene_of(walker, 12, lines=("step 12",))), first)


def test_a_frame_survives_another_user_of_pygame_who_quits(walker, renderer):
    import pygame

    first = renderer.frame(scene_of(walker, 2))
    pygame.quit()
    np.testing.assert_array_equal(renderer.frame(scene_of(walker, 2)), first)


def test_the_stance_footprint_is_drawn_in_its_colour_and_left_is_left_of_right(walker, renderer):
    frame = renderer.frame(scene_of(walker, 4))[:, :540]
    stance = coloured(frame, LEFT)  # four steps on, the left foot stands again
    assert len(stance) > 100
    old_right = coloured(
        frame, tuple(round(0.6 * c + 0.4 * f) for c, f in zip(RIGHT, FLOOR, strict=True))
    )
    assert len(old_right) > 200
    assert stance[:, 1].mean() < old_right[:, 1].mean()
    # it is the foremost print: up on the picture
    assert stance[:, 0].mean() < old_right[:, 0].min()


@pytest.mark.parametrize("heading", [0.5, -0.5])
def test_the_commanded_heading_points_left_when_positive(walker, renderer, heading):
    frame = renderer.frame(scene_of(walker, 2, commanded_heading=heading))[:, :540]
    without = renderer.frame(scene_of(walker, 2))[:, :540]
    arrow = coloured(frame, COMMAND)
    assert len(coloured(without, COMMAND)) == 0
    assert len(arrow) > 100
    tip, tail = arrow[arrow[:, 0].argmin()], arrow[arrow[:, 0].argmax()]
    assert np.sign(tail[1] - tip[1]) == np.sign(heading)


def test_goals_and_a_reference_path_are_on_the_floor(walker, renderer):
    frame = renderer.frame(
        scene_of(
            walker,
            4,
            goals=[Goal(3.0, 1.0, 0.3), (1.0, -1.0, 0.3, True)],
            reference_path=np.array([[0.0, 0.5], [4.0, 0.5]]),
        )
    )
    rings = coloured(frame, GOAL)
    line = coloured(frame, REFERENCE)
    assert len(rings) > 20
    assert len(line) > 100
    # one leg length right of the start's foot, beyond the line at a half
    assert rings[:, 1].mean() > line[:, 1].mean()


def test_legs_stand_under_their_masses_in_perspective_and_the_left_one_is_left(walker, renderer):
    view = renderer.frame(scene_of(walker, 1))[:510, 568:]  # without the legend below
    left, right = coloured(view, FOOT_COLOURS["left"]), coloured(view, FOOT_COLOURS["right"])
    masses = coloured(view, INK)
    assert min(len(left), len(right), len(masses)) > 300
    assert left[:, 1].mean() < right[:, 1].mean()
    for leg in (left, right):
        # two thirds of the way up, at least, from the foot to the masses
        assert leg[:, 0].max() > masses[:, 0].max() + 100
    assert masses[:, 0].max() < view.shape[0] / 2


def test_commands_and_goals_lie_on_the_floor_in_perspective_too(walker, renderer):
    plain = renderer.frame(scene_of(walker, 4))[:, 568:]
    frame = renderer.frame(scene_of(walker, 4, commanded_heading=0.3, goals=[Goal(3.5, 0.0, 0.3)]))[
        :, 568:
    ]
    for colour in (COMMAND, GOAL):
        assert len(coloured(plain, colour)) == 0
        assert len(coloured(frame, colour)) > 20


def test_a_walk_longer_than_the_panel_shows_is_seen_whole_in_an_inset(walker, renderer):
    long = scene_of(walker, 150)
    panel = Panel(0.0, 0.0, 560.0, 540.0)
    corner = renderer.frame(long)[382:492, 438:548]
    short = renderer.frame(scene_of(walker, 20))[382:492, 438:548]
    path = (92, 94, 102)
    assert panel.bottom > 492
    assert len(coloured(corner, path, 40)) > 50
    assert len(coloured(short, path, 40)) == 0


def test_lines_of_text_are_written(walker, renderer):
    words = status_lines(step=3, time=2.1, speed=0.4, heading=-0.1, commanded_heading=0.2)
    assert words == (
        "step 3",
        "time 2.1",
        "speed 0.400",
        "heading -0.100 rad",
        "commanded +0.200 rad",
        "walking",
    )
    with_words = renderer.frame(scene_of(walker, 2, lines=words))[:130, :160]
    without = renderer.frame(scene_of(walker, 2))[:130, :160]
    assert len(coloured(with_words, INK)) > 300
    assert len(coloured(without, INK)) == 0


@pytest.mark.parametrize(
    "parameters",
    [
        WalkerParameters(hip_width=0.0, foot_radius=0.0, slope=-0.3),
        WalkerParameters(hip_width=2.0, foot_radius=0.99, slope=0.0),
        WalkerParameters(slope_turns=True, slope=0.5),
    ],
)
def test_extreme_walkers_in_fallen_poses_are_drawn(renderer, parameters):
    fallen = Pose(np.array([9.0, -1.5, 1.9, 0.0, 0.0]), "right", 0.5, 1.0)
    frame = renderer.frame(Scene(parameters, fallen))
    assert len(coloured(frame, RIGHT)) > 50


@pytest.mark.parametrize("right", [-4.0, 0.0, 4.0])
def test_the_words_never_hide_the_walker(walker, renderer, right):
    lines = status_lines(step=132, time=80.0, speed=0.4, heading=0.3, commanded_heading=0.5)
    place = np.array([6.0, right])
    goals = [Goal(0.0, -right, 0.5), Goal(0.0, 5.0, 0.5)]

    def frame_with(lines):
        pose = Pose(GAIT, contact=place)
        path = np.array([[0.0, 0.0], place])
        return renderer.frame(Scene(walker.parameters, pose, path=path, goals=goals, lines=lines))

    words = np.any(frame_with(lines) != frame_with(()), axis=-1)
    masses = coloured(frame_with(()), INK)
    # The masses and the heading's arrow are what is dark in the view from above, without the scale's bar
    body = masses[(masses[:, 1] < 560) & (masses[:, 0] < 480)]
    assert words.any() and len(body) > 100
    assert not words[body[:, 0], body[:, 1]].any()


def test_an_array_needs_no_display_and_opens_none():
    script = (
        "import numpy as np, sys\n"
        "from lean_yaw_env.rendering import Pose, Renderer, Scene\n"
        "from lean_yaw_env.parameters import WalkerParameters\n"
        "assert not {'pygame', 'matplotlib'} & set(sys.modules), 'imported too early'\n"
        "frame = Renderer().frame(Scene(WalkerParameters(), Pose(np.zeros(5))))\n"
        "import pygame\n"
        "assert not pygame.display.get_init()\n"
        "assert len(np.unique(frame)) > 20\n"
    )
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    root = Path(__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, cwd=root, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


# Windows


def test_a_window_closed_by_its_user_stays_closed(walker, monkeypatch):
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    renderer, scene = Renderer(), scene_of(walker, 2)
    try:
        assert renderer.show(scene, fps=1000)
        assert pygame.display.get_surface().get_size() == (960, 540)
        pygame.event.post(pygame.event.Event(pygame.QUIT))
        assert not renderer.show(scene, fps=1000)
        assert not pygame.display.get_init()
        assert not renderer.show(scene, fps=1000)
        assert not pygame.display.get_init()
    finally:
        renderer.close()


def test_a_window_shows_the_pixels_of_the_array(walker, monkeypatch):
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    renderer, scene = Renderer(), scene_of(walker, 2)
    try:
        renderer.show(scene, fps=1000)
        shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
        np.testing.assert_array_equal(shown, renderer.frame(scene))
    finally:
        renderer.close()


def test_without_a_display_a_window_says_so(walker, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    with pytest.raises(RuntimeError, match="no window could be opened"):
        Renderer().show(scene_of(walker, 1))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere there is a display")
def test_without_a_display_no_invisible_window_opens(monkeypatch):
    import pygame

    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    env = gym.make("LeanYaw/Walk-v1", render_mode="human")
    with pytest.raises(RuntimeError, match="there is no display"):
        env.reset(seed=0)
    assert not pygame.display.get_init()


# Films


class Recorder:
    """Stands in for the renderer: keeps scenes, and draws little."""

    scenes: list[Scene]

    def __init__(self, size):
        self.size = (16, 16)
        type(self).scenes = []

    def frame(self, scene):
        self.scenes.append(scene)
        return np.full((16, 16, 3), len(self.scenes) % 256, dtype=np.uint8)


@pytest.fixture
def recorder(monkeypatch):
    monkeypatch.setattr(sys.modules[film.__module__], "Renderer", Recorder)
    return Recorder


def test_a_film_moves_without_jumps_within_and_between_steps(walker, recorder, tmp_path):
    offsets = [0.0, 0.005, 0.01, 0.01, 0.005, 0.0]
    film(
        walker, 6, tmp_path / "walk.gif", state=GAIT, mass_offset=offsets, progress=False,
        fps=50, seconds_per_time_unit=1.0,
    )  # fmt: skip
    shapes = [walker_shape(scene.parameters, scene.pose) for scene in recorder.scenes]
    assert len(shapes) > 200

    def by_foot(shape, foot):
        leg = shape.stance_leg if shape.stance_leg.foot == foot else shape.swing_leg
        return np.vstack([leg.hip, leg.ankle, leg.outer_arc])

    for foot in ("left", "right"):
        places = np.array([by_foot(shape, foot) for shape in shapes])
        # the swing leg turns by 0.6 rad in half a step of 0.7: its foot is no faster than five
        # leg lengths per unit of time, 0.1 in a frame of 1/50
        assert np.linalg.norm(np.diff(places, axis=0), axis=-1).max() < 0.1
    centres = np.array([shape.centre for shape in shapes])
    # the centre of mass goes at 0.3 to 0.5
    assert np.linalg.norm(np.diff(centres, axis=0), axis=-1).max() < 0.012


def test_the_camera_in_perspective_follows_a_turning_walker_without_jolts(
    walker, recorder, tmp_path
):
    film(
        walker, 12, tmp_path / "walk.gif", state=GAIT, mass_offset=0.03, progress=False,
        fps=50, seconds_per_time_unit=1.0,
    )  # fmt: skip
    panel = Panel(0.0, 0.0, 300.0, 500.0)
    cameras = [
        following_camera(panel, scene, walker_shape(scene.parameters, scene.pose))
        for scene in recorder.scenes
    ]
    turned = np.diff(np.unwrap([math.atan2(*camera.right[[0, 2]]) for camera in cameras]))
    # The walker turns by 0.05 rad in a step of 0.7, and sways: the way behind it turns no faster than 0.3 rad in a unit of time
    assert abs(turned).max() < 0.3 / 50
    assert abs(turned.sum()) > 0.2
    moved = np.linalg.norm(np.diff([camera.eye for camera in cameras], axis=0), axis=1)
    # the centre of mass at up to 0.6, and the turn at a distance of three leg lengths
    assert moved.max() < (0.6 + 3.0 * 0.3) / 50


def test_a_film_s_scenes_are_the_walk_s(walker, recorder, tmp_path):
    across = np.array([0.5, *GAIT[1:]])  # so that ahead is not downhill
    walk = film(
        walker, 5, tmp_path / "walk.gif", state=across, commanded_heading=0.2, progress=False
    )
    last = recorder.scenes[-1]
    np.testing.assert_array_equal(last.footprints, walk.footprints[:5])
    assert last.commanded_heading == 0.2
    assert last.lines[0] == "step 4"
    # the path ends at the last of 33 samples of a step of 0.7, walked at less than 0.6
    np.testing.assert_allclose(
        last.path[-1], walker_shape(walker.parameters, last.pose).centre[[0, 2]], atol=0.015
    )
    rate, seconds = 100.0 / 3.0, 1.0 / math.sqrt(9.81)
    assert len(recorder.scenes) == math.ceil(walk.durations.sum() * seconds * rate)


def test_the_swing_leg_may_be_in_front_at_once_as_in_the_model(walker, recorder, tmp_path):
    film(walker, 3, tmp_path / "walk.gif", state=GAIT, swing_share=0.0, progress=False)
    assert {scene.pose.inter_leg_angle for scene in recorder.scenes} == {0.3}


def test_a_film_of_a_fall_ends_with_it(walker, recorder, tmp_path):
    walk = film(
        walker, 80, tmp_path / "fall.gif", state=GAIT, mass_offset=0.05, progress=False
    )  # turns past 90 degrees, where the slope gives nothing (section 4.4)
    assert walk.fall is not None
    assert recorder.scenes[-1].lines[-1] == f"falls: {walk.fall.value}"
    assert recorder.scenes[0].lines[-1] == "walking"


def test_a_gif_has_the_film_s_frames_and_duration(walker, tmp_path):
    image = pytest.importorskip("PIL.Image")
    path = tmp_path / "walk.gif"
    walk = film(walker, 2, path, state=GAIT, fps=10, progress=False, size=(480, 360))
    with image.open(path) as gif:
        assert gif.size == (480, 360)
        assert gif.info["duration"] == 100
        assert gif.n_frames == math.ceil(walk.durations.sum() / math.sqrt(9.81) * 10)


def test_an_mp4_has_the_film_s_size_and_frames(walker, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / "walk.mp4"
    walk = film(walker, 2, path, state=GAIT, fps=20, progress=False, size=(480, 362))
    frames, _ = ffmpeg.count_frames_and_secs(str(path))
    assert frames == math.ceil(walk.durations.sum() / math.sqrt(9.81) * 20)
    assert next(ffmpeg.read_frames(str(path)))["size"] == (480, 362)


def test_a_film_that_fails_leaves_the_old_file_alone(walker, recorder, tmp_path, monkeypatch):
    path = tmp_path / "walk.gif"
    path.write_bytes(b"old")

    def fail(self, scene):
        raise KeyboardInterrupt

    monkeypatch.setattr(Recorder, "frame", fail)
    with pytest.raises(KeyboardInterrupt):
        film(walker, 2, path, state=GAIT, progress=False)
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["walk.gif"]


# Pictures by matplotlib


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_the_walker_s_diagram_is_written(tmp_path, ending):
    draw_walker(WalkerParameters(), tmp_path / f"walker.{ending}")
    assert (tmp_path / f"walker.{ending}").stat().st_size > 10_000
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    "parameters",
    [
        WalkerParameters(hip_width=0.0, foot_radius=0.0, slope=0.0),
        WalkerParameters(hip_width=1.0, slope=-0.2, slope_turns=True),
    ],
)
def test_the_diagram_of_an_extreme_walker_leaves_out_what_it_has_not(tmp_path, parameters):
    path = tmp_path / "walker.svg"
    draw_walker(parameters, path)
    assert path.stat().st_size > 10_000


def test_footprints_of_several_walks_share_one_scale(walker):
    figure_class = pytest.importorskip("matplotlib.figure").Figure
    walks = {
        f"offset {offset}": walker.walk(12, state=GAIT, mass_offset=offset, samples_per_step=5)
        for offset in (0.0, 0.05)
    }
    axes = figure_class().subplots(1, 2)
    draw_footprints(walks, axes)
    assert [place.get_title() for place in axes] == list(walks)
    assert axes[0].get_xlim() == axes[1].get_xlim()
    assert axes[0].get_ylim() == axes[1].get_ylim()
    for place, walk in zip(axes, walks.values(), strict=True):
        (prints,) = place.collections
        assert len(prints.get_paths()) == 13
        np.testing.assert_allclose(prints.get_facecolor()[0][:3], np.array(LEFT) / 255)
        np.testing.assert_allclose(prints.get_facecolor()[1][:3], np.array(RIGHT) / 255)
        (path,) = place.lines
        np.testing.assert_array_equal(path.get_xdata(), walk.path[:, 3])
        np.testing.assert_array_equal(path.get_ydata(), walk.path[:, 1])


@pytest.mark.parametrize("count", [1, 5, 7])
def test_titles_and_labels_of_footprints_are_inside_the_picture(walker, count):
    walks = {f"walk {k}": walker.walk(60, state=GAIT) for k in range(count)}
    figure, panels = footprint_figure(walks, places=[(12.0, -3.0)])
    figure.canvas.draw()
    columns = 4 if count == 7 else count
    for k, panel in enumerate(panels):
        assert panel.get_title() == f"walk {k}"
        shown = [panel.title]
        shown += [panel.xaxis.label] if k + columns >= count else []
        shown += [panel.yaxis.label] if k % columns == 0 else []
        for text in shown:
            box = text.get_window_extent()
            assert text.get_visible() and text.get_text()
            assert figure.bbox.containsx(box.x0) and figure.bbox.containsx(box.x1)
            assert figure.bbox.containsy(box.y0) and figure.bbox.containsy(box.y1)
        assert panel.get_xlim()[0] < -3.0


@pytest.mark.parametrize(
    "places", ["x", None, [[1.0, 2.0, 3.0]], [[math.nan, 0.0]], [[1.0, 2.0], [3.0]]]
)
def test_places_that_are_no_points_are_refused_by_name(walker, places):
    with pytest.raises(ValueError, match="places must"):
        footprint_figure({"walk": walker.walk(3, state=GAIT)}, places=places)


@pytest.mark.parametrize("places", [(), [], np.empty((0, 2))])
def test_no_places_change_nothing(walker, places):
    walks = {"walk": walker.walk(3, state=GAIT)}
    (panel,), (alone,) = (footprint_figure(walks, **each)[1] for each in ({"places": places}, {}))
    assert (panel.get_xlim(), panel.get_ylim()) == (alone.get_xlim(), alone.get_ylim())


def test_a_picture_of_footprints_is_written_whole(walker, tmp_path):
    walks = {"fixed": walker.walk(3, state=GAIT)}
    save_footprints(walks, tmp_path / "prints.png")
    assert [entry.name for entry in tmp_path.iterdir()] == ["prints.png"]


# Bad input


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"state": np.zeros(4)}, r"state must have shape \(5,\), got \(4,\)"),
        ({"state": np.full(5, np.nan)}, "state must hold finite numbers"),
        ({"state": "here"}, "state must hold numbers"),
        ({"stance": "both"}, "stance must be one of left, right, got 'both'"),
        ({"inter_leg_angle": 2.0}, "inter_leg_angle must be in"),
        ({"mass_offset": -1.5}, "mass_offset must be in"),
        ({"contact": np.zeros(3)}, r"contact must have shape \(2,\), got \(3,\)"),
    ],
)
def test_a_pose_names_what_is_wrong_with_it(change, message):
    with pytest.raises(ValueError, match=message):
        Pose(**{"state": GAIT, **change})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameters": None}, "parameters must be WalkerParameters"),
        ({"pose": GAIT}, "pose must be Pose"),
        ({"footprints": np.zeros((2, 3))}, r"footprints must have shape \(n, 2\), got \(2, 3\)"),
        ({"footprints": np.zeros((2, 2))}, r"headings must have shape \(2,\), got \(0,\)"),
        ({"feet": ["left"]}, "feet must hold 0, one per footprint, got 1"),
        ({"path": [[0.0, math.inf]]}, "path must hold finite numbers"),
        ({"commanded_heading": math.nan}, "commanded_heading must be a finite number"),
        ({"goals": [(1.0, 2.0)]}, "a goal must be"),
        ({"goals": [(1.0, 2.0, 0.0, False)]}, "goal's radius must be in"),
        ({"reference_path": np.zeros(2)}, "reference_path must have shape"),
    ],
)
def test_a_scene_names_what_is_wrong_with_it(change, message):
    with pytest.raises(ValueError, match=message):
        Scene(**{"parameters": WalkerParameters(), "pose": Pose(GAIT), **change})


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ((100, 540), r"size: width must be from 480 to 3840"),
        ((960, 9000), r"size: height must be from 360 to 2160"),
        ((960.5, 540), "size: width must be a whole number"),
        (960, r"size must be \(width, height\)"),
    ],
)
def test_a_renderer_names_a_bad_size(size, message):
    with pytest.raises(ValueError, match=message):
        Renderer(size)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": "walk.avi"}, "path must end with one of .mp4, .gif"),
        ({"path": "no such folder/walk.gif"}, "path must be in a folder that exists"),
        ({"fps": 0}, "fps must be in"),
        ({"seconds_per_time_unit": 0.0}, "seconds_per_time_unit must be in"),
        ({"swing_share": 1.5}, "swing_share must be in"),
        ({"commanded_heading": [0.1]}, "commanded_heading must be one number or 2"),
        ({"n_steps": 0}, "n_steps must be from 1 to"),
    ],
)
def test_a_film_names_what_is_wrong_and_writes_nothing(
    walker, tmp_path, monkeypatch, change, message
):
    monkeypatch.chdir(tmp_path)
    arguments = {"n_steps": 2, "path": "walk.gif", "state": GAIT, "progress": False, **change}
    with pytest.raises(ValueError, match=message):
        film(walker, **arguments)
    assert list(tmp_path.iterdir()) == []


def test_pictures_of_footprints_refuse_what_they_cannot_draw(walker, tmp_path):
    with pytest.raises(ValueError, match="axes must be as many as walks"):
        draw_footprints({"a": walker.walk(1, state=GAIT)}, [])
    with pytest.raises(ValueError, match="walks must hold one walk or more"):
        save_footprints({}, tmp_path / "prints.png")
    with pytest.raises(ValueError, match="path must end with one of"):
        draw_walker(WalkerParameters(), tmp_path / "walker.bmp")


@pytest.mark.parametrize(
    ("module", "draw"),
    [
        ("pygame", lambda folder: Renderer()),
        (
            "matplotlib.figure",
            lambda folder: draw_walker(WalkerParameters(), folder / "walker.png"),
        ),
        ("imageio_ffmpeg", lambda folder: film(Walker(), 1, folder / "walk.mp4", state=GAIT)),
        ("PIL", lambda folder: film(Walker(), 1, folder / "walk.gif", state=GAIT)),
        ("tqdm", lambda folder: film(Walker(), 1, folder / "walk.mp4", state=GAIT)),
    ],
)
def test_a_missing_library_is_named_with_the_way_to_install_it(tmp_path, monkeypatch, module, draw):
    monkeypatch.setitem(sys.modules, module, None)
    message = r"is not installed, run `pip install 'lean-yaw-env\[render\]'`"
    with pytest.raises(DependencyNotInstalled, match=message):
        draw(tmp_path)
    assert list(tmp_path.iterdir()) == []
