"""Pictures and films of walks; drawing libraries are imported when something is drawn."""

from lean_yaw_env.rendering.diagram import draw_walker
from lean_yaw_env.rendering.filming import film
from lean_yaw_env.rendering.geometry import LegShape, Pose, WalkerShape, walker_shape
from lean_yaw_env.rendering.picture import draw_footprints, save_footprints
from lean_yaw_env.rendering.pygame_renderer import Renderer
from lean_yaw_env.rendering.scene import Goal, Scene, status_lines

__all__ = [
    "Goal",
    "LegShape",
    "Pose",
    "Renderer",
    "Scene",
    "WalkerShape",
    "draw_footprints",
    "draw_walker",
    "film",
    "save_footprints",
    "status_lines",
    "walker_shape",
]
