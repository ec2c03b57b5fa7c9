"""Settings of the predictive controller."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

from lean_yaw_env.validation import require_count, require_number


@dataclass(frozen=True)
class PlanSpread:
    """First standard deviations of what is tried, as shares of the actions' ranges."""

    angle: float = 0.4
    steady: float = 0.4
    """Of the mass offset to one side."""
    alternating: float = 0.0
    """Of the mass offset that changes sides with the stance foot, which pumps."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require_number(f"spread {name}", value, 0.0, 2.0)
        if self.angle == self.steady == self.alternating == 0.0:
            raise ValueError("spread must be above 0 in one direction or more, got 0 in all")


@dataclass(frozen=True)
class MpcSettings:
    """Settings of ``MpcController``."""

    horizon: int = 16
    """1 to 64 walking steps that are planned."""
    tail: int = 0
    """0 to 64 walking steps that the base controller then walks before a plan's worth is taken, so that no plan gains by leaving the walker in a
    bad state."""
    knots: tuple[int, ...] = (0, 2, 5, 10)
    """Increasing steps from 0 on, where what is tried is drawn; linear in between and held after the last."""
    samples: int = 48
    """Plans tried at once."""
    iterations: int = 3
    elites: int = 8
    """Best plans, of which the next are made."""
    spread: PlanSpread = field(default_factory=PlanSpread)
    window: float = 20.0
    """Time in which plans are compared; one that ends earlier is extended at the reward rate of its last two steps."""
    fall: float = 50.0
    """Reward that a fall costs."""
    step_price: float = 0.0
    """Reward that a step costs, where commands change after so many steps: long ones meet fewer."""
    trust: float = 0.0
    """Reward that it costs to leave the base controller's actions by their whole range, mean over a plan."""
    margin: float = 0.0
    """Reward by which a plan must be better than the base controller's to be followed in its place."""
    scenarios: int = 0
    """0 to 64 draws of pushes, commands and goals that every plan is tried under, the same for all plans; 0 plans without pushes, up to where the
    task draws something."""
    push_scale: float = 1.0
    """Size of these pushes, in terms of the environment's, 0 to 10."""

    def __post_init__(self) -> None:
        for name, low, high in (
            ("horizon", 1, 64),
            ("tail", 0, 64),
            ("samples", 4, 4096),
            ("iterations", 1, 64),
            ("elites", 2, self.samples - 2),
            ("scenarios", 0, 64),
        ):
            require_count(name, getattr(self, name), low, high)
        knots = self.knots
        rises = all(a < b for a, b in itertools.pairwise(knots))
        if not knots or knots[0] != 0 or not rises or knots[-1] >= self.horizon:
            raise ValueError(
                f"knots must increase from 0 to below the horizon {self.horizon}, got {knots!r}"
            )
        require_number("window", self.window, 0.0, math.inf, "()")
        for name in ("fall", "step_price", "trust", "margin"):
            require_number(name, getattr(self, name), 0.0, math.inf, "[)")
        require_number("push_scale", self.push_scale, 0.0, 10.0)
