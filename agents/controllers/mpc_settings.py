"""Settings of the predictive controller."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

from lean_yaw_env.validation import require_count, require_number


@dataclass(frozen=True)
class PlanSpread:
    """First standard deviations of what is tried, as shares of the actions' ranges.

    Attributes
    ----------
    angle : of the inter-leg angle
    steady : of the mass offset to one side
    alternating : of the mass offset that changes sides with the stance foot, which pumps
    """

    angle: float = 0.4
    steady: float = 0.4
    alternating: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require_number(f"spread {name}", value, 0.0, 2.0)
        if self.angle == self.steady == self.alternating == 0.0:
            raise ValueError("spread must be above 0 in one direction or more, got 0 in all")


@dataclass(frozen=True)
class MpcSettings:
    """Settings of ``MpcController``.

    Attributes
    ----------
    horizon : 1 to 64 walking steps
        That are planned.
    tail : 0 to 64 walking steps
        That the base controller then walks before a plan is judged, so that no plan is paid for leaving the walker in a bad state.
    knots : increasing steps from 0 on
        Where what is tried is drawn; linear in between and held after the last.
    samples, iterations, elites : int
        Plans tried at once, how often, and of how many best ones the next are made.
    spread : PlanSpread
    window : time
        In which plans are compared; one that ends earlier goes on at the reward rate of its last two steps.
    fall : reward
        That a fall costs.
    step_price : reward
        That a step costs, where commands change after so many steps: long ones meet fewer.
    trust : reward
        Cost of leaving the base controller's actions by their whole range, mean over a plan.
    margin : reward
        By which a plan must be better than the base controller's to be followed in its place.
    scenarios : 0 to 64
        Draws of pushes, commands and goals that every plan is tried under, the same for all plans; 0 plans without pushes, up to where the
        task draws something.
    push_scale : [0, 10]
        Size of these pushes, in terms of the environment's.
    """

    horizon: int = 16
    tail: int = 0
    knots: tuple[int, ...] = (0, 2, 5, 10)
    samples: int = 48
    iterations: int = 3
    elites: int = 8
    spread: PlanSpread = field(default_factory=PlanSpread)
    window: float = 20.0
    fall: float = 50.0
    step_price: float = 0.0
    trust: float = 0.0
    margin: float = 0.0
    scenarios: int = 0
    push_scale: float = 1.0

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
