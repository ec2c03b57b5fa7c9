"""Returns discounted in time, through which gradients flow to every step before."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from agents.learning.gradient.walkers import Walked


class Window(NamedTuple):
    """A window of steps of many walkers, with gradients.

    Attributes
    ----------
    observations : shape (window, n, features)
        Before each step.
    next_observations : shape (window, n, features)
        After it: where it ended an episode, that episode's last ones.
    rewards, durations : shape (window, n)
    terminated, truncated : bool, shape (window, n)
    """

    observations: Tensor
    next_observations: Tensor
    rewards: Tensor
    durations: Tensor
    terminated: Tensor
    truncated: Tensor

    @classmethod
    def of(cls, observations: list[Tensor], steps: list[Walked]) -> Window:
        """Steps one after the other, and what was observed before each."""
        return cls(
            torch.stack(observations),
            torch.stack([step.observations for step in steps]),
            torch.stack([step.rewards for step in steps]),
            torch.stack([step.durations for step in steps]),
            torch.stack([step.terminated for step in steps]),
            torch.stack([step.truncated for step in steps]),
        )


def time_discounted_returns(
    window: Window, next_values: Tensor, time_constant: float, trace: float
) -> Tensor:
    """The lambda-return from each step on, shape (window, n).

    A step's discount is exp(-duration / time constant), and its reward, spread evenly over its duration, is discounted within the step
    too: a policy gains nothing by the length of its steps as such. After a fall nothing more is earned.

    Parameters
    ----------
    window : Window
    next_values : shape (window, n)
        The critic's, after each step.
    time_constant : float
    trace : lambda, from 0 (one step, then the critic) to 1 (the whole window, then the critic)
    """
    ratio = window.durations / time_constant
    lives = ~window.terminated
    # the limit for a step that took no time, which a fall may do
    within = torch.where(lives, -torch.expm1(-ratio) / torch.where(lives, ratio, 1.0), 1.0)
    rewards = window.rewards * within
    discounts = torch.where(lives, torch.exp(-ratio), 0.0)
    ends = window.terminated | window.truncated
    onward = next_values[-1]
    returns: list[Tensor] = []
    for step in range(len(rewards) - 1, -1, -1):
        value = next_values[step]
        mixed = torch.where(ends[step], value, value + trace * (onward - value))
        onward = rewards[step] + discounts[step] * mixed
        returns.append(onward)
    return torch.stack(returns[::-1])
