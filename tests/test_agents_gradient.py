"""The gradient agent: exact derivatives through steps and tasks, returns, training, resumption."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents import load, save
from agents.controllers.simple import FixedController
from agents.evaluation.scoring import run_seeds
from agents.learning.algorithms import settings_for, train
from agents.learning.apg import GradientSettings, perceptron
from agents.learning.differentiable import (
    DifferentiableWalkers,
    Steps,
    bounded,
    time_discounted_returns,
)
from agents.learning.recorder import CheckpointError
from agents.seeds import first_seed
from lean_yaw_env.envs.derivatives import LinearisedSteps
from lean_yaw_env.envs.options import EnvOptions, gait_of
from lean_yaw_env.envs.state import WALKER
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.jacobian import OUTPUTS, step_jacobians
from lean_yaw_env.kernel.records import STEPPED, Outcome
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.registration import TASK_VERSIONS

VALIDATION = first_seed("validation")
ID = "LeanYaw/Heading-v1"
TINY = GradientSettings(
    steps=1280,
    walkers=8,
    window=8,
    critic_first=128,
    critic_epochs=1,
    critic_batches=2,
    hidden=(8, 8),
)
# episodes of some twenty steps, so that training sees ends and restarts
SHORT = EnvOptions(horizon=15.0)
GRID = 2.0**-10  # actions are float32: multiples of this are exact, and so are differences of them


# --- laws: derivatives


@pytest.mark.parametrize("shift_time", [0.35, 1.5])
def test_derivatives_of_all_that_rewards_are_made_of_agree_with_differences(shift_time):
    # the longer shift is still under way at heel strike, which locks the masses where they are
    parameters = WalkerParameters(shift_time=shift_time)
    n = 64
    generator = np.random.default_rng(0)
    states = np.array(gait_of(WalkerParameters())) + generator.normal(0.0, 0.01, (n, 5))
    offsets = generator.uniform(-0.03, 0.03, (n, 2))
    inputs = np.column_stack([states, generator.uniform(0.25, 0.35, n), offsets])
    body, sides = np.array([parameters.body()]), np.where(np.arange(n) % 2, 1.0, -1.0)
    columns = [Outcome._fields.index(name) for name in OUTPUTS]

    def outputs(given):
        outcomes = np.empty((n, len(Outcome._fields)))
        commands, starts = given[:, 5:].copy(), given[:, :5].copy()
        step_batch(body, commands, starts, sides, outcomes, 0, n)
        return outcomes[:, columns], outcomes[:, Outcome._fields.index("status")]

    statuses, afters = np.empty(n), np.empty((n, 5))
    jacobians = np.empty((n, len(OUTPUTS), 8))
    step_jacobians(
        body, inputs[:, 5:].copy(), inputs[:, :5].copy(), sides, statuses, afters, jacobians, 0, n
    )
    values, walked = outputs(inputs)
    stepped = walked == STEPPED
    assert stepped.mean() > 0.8
    assert (afters[stepped] == values[stepped, :5]).all()
    h = 1e-6
    for k in range(8):
        shift = np.zeros(8)
        shift[k] = h
        (ahead, first), (behind, second) = outputs(inputs + shift), outputs(inputs - shift)
        same = stepped & (first == STEPPED) & (second == STEPPED)
        # the integrator's tolerance of 1e-10 over 2 h, and h^2 times third derivatives of order 1e3
        error = np.abs((ahead - behind) / (2.0 * h) - jacobians[:, :, k])[same]
        assert error.max() < 1e-5


def walked_total(task, actions, options):
    """The sum of all rewards, and of the squares of the last observations, of open-loop walks; and how many fell."""
    walkers = DifferentiableWalkers(task, options, actions.shape[1])
    walkers.reset(5)
    rewards, fell = torch.zeros(()), 0
    for action in actions:
        walked = walkers.step(action)
        rewards = rewards + walked.rewards.sum()
        fell += int(walked.terminated.sum())
        observations = walked.observations
    return rewards, (observations**2).sum(), fell


OPTIONS = [("Heading", EnvOptions(random_body="training")), ("SpeedHeading", EnvOptions(sensor_noise=0.1, hidden_rates=True)), ("Level", EnvOptions(horizon=0.4))]  # fmt: skip


@pytest.mark.parametrize(("task", "options"), [*((task, EnvOptions()) for task in TASK_VERSIONS), *OPTIONS])  # fmt: skip
def test_gradient_through_a_window_of_a_task_agrees_with_central_differences(task, options):
    generator = torch.Generator().manual_seed(0)
    spread = 0.02 * torch.tensor([4.0, 1.0])  # gentle enough for the limit of the offset's change
    drawn = torch.randn(10, 8, 2, generator=generator) * spread
    actions = (torch.round(drawn / GRID) * GRID).double().requires_grad_()
    rewards, seen, fell = walked_total(task, actions, options)
    (by_reward,) = torch.autograd.grad(rewards, actions, retain_graph=True)
    (by_seen,) = torch.autograd.grad(seen, actions)
    for place in ((0, 0, 0), (0, 1, 1), (4, 2, 0), (5, 3, 1), (9, 4, 0), (9, 5, 1)):
        shift = torch.zeros_like(actions)
        shift[place] = GRID
        with torch.no_grad():
            ahead = walked_total(task, actions + shift, options)
            behind = walked_total(task, actions - shift, options)
        assert ahead[2] == behind[2] == fell
        # third derivatives of order 10 times the grid's square
        difference = (ahead[0] - behind[0]) / (2.0 * GRID)
        assert float(by_reward[place]) == pytest.approx(float(difference), rel=1e-4, abs=1e-5)
        # observations are float32: squares of order 10, rounded to 1e-6, over the grid
        difference = (ahead[1] - behind[1]) / (2.0 * GRID)
        assert float(by_seen[place]) == pytest.approx(float(difference), rel=2e-3, abs=2e-3)


def test_gradient_by_a_policy_s_weights_agrees_with_central_differences():
    generator = torch.Generator().manual_seed(1)
    policy = perceptron(7, (8,), 2, 0.01, generator).double()
    direction = [torch.randn(w.shape, generator=generator).double() for w in policy.parameters()]

    def total(along):
        """Rewards of walks by the policy with its weights moved along a direction."""
        moved = [w + along * d for w, d in zip(policy.parameters(), direction, strict=True)]
        names = [name for name, _ in policy.named_parameters()]
        walkers = DifferentiableWalkers("Heading", EnvOptions(), 8)
        observed = walkers.reset(3)
        rewards = torch.zeros(())
        for _ in range(20):
            weights = dict(zip(names, moved, strict=True))
            action = torch.func.functional_call(policy, weights, (observed,))
            rewards = rewards + walkers.step(0.1 * action).rewards.sum()
            observed = walkers.observations
        return rewards

    along = torch.zeros((), dtype=torch.float64, requires_grad=True)
    (slope,) = torch.autograd.grad(total(along), along)
    h = 2e-3
    with torch.no_grad():
        difference = float(total(torch.tensor(h)) - total(torch.tensor(-h))) / (2.0 * h)
    # float32 observations and actions: 160 rewards rounded by 1e-7 each, over h; and h^2 times third derivatives
    assert float(slope) == pytest.approx(difference, rel=5e-3)


def test_no_gradient_passes_the_end_of_an_episode_or_a_cut():
    walkers = DifferentiableWalkers("Heading", EnvOptions(horizon=2.0), 4)
    walkers.reset(0)
    actions = torch.zeros(4, 2, dtype=torch.float64, requires_grad=True)
    walked = walkers.step(actions)
    while not bool(walked.truncated.all()):
        assert float(torch.autograd.grad(walked.rewards.sum(), actions, retain_graph=True)[0].abs().max()) > 0.0  # fmt: skip
        walked = walkers.step(torch.zeros(4, 2, dtype=torch.float64))
    assert not walkers.observations.requires_grad or not torch.autograd.grad(walkers.observations.sum(), actions, allow_unused=True)[0].any()  # fmt: skip
    walkers.step(actions)
    assert walkers.observations.requires_grad
    assert not walkers.cut().requires_grad


def test_bound_gives_descent_the_way_back_in_and_no_way_further_out():
    value = torch.tensor([-0.3, -0.3, 0.0, 0.3, 0.3], requires_grad=True)
    middle = torch.zeros(5, requires_grad=True)
    gradient = torch.tensor([1.0, -1.0, 1.0, 1.0, -1.0])  # of a loss: descent goes against it
    kept = bounded(value, middle, 0.1)
    assert kept.tolist() == pytest.approx([-0.1, -0.1, 0.0, 0.1, 0.1])
    kept.backward(gradient)
    assert value.grad is not None and value.grad.tolist() == [0.0, -1.0, 1.0, 1.0, 0.0]
    # where the bound is in force it moves with its middle
    assert middle.grad is not None and middle.grad.tolist() == [1.0, -1.0, 0.0, 1.0, -1.0]


# --- one truth: the environment's


@pytest.mark.parametrize("task", TASK_VERSIONS)
def test_what_gradients_flow_through_are_the_environment_s_own_numbers(task):
    options = EnvOptions(push_level=0.5, start_disturbance=2.0, horizon=40.0, sensor_noise=0.1)
    walkers = DifferentiableWalkers(task, options, 16)
    walkers.reset(7)
    twin = WalkerVectorEnv(16, task, autoreset_mode="Disabled", **vars(options))
    twin.reset(seed=7)
    generator = torch.Generator().manual_seed(2)
    ends = 0
    for _ in range(80):
        actions = (0.6 * torch.randn(16, 2, generator=generator)).double()  # float32 numbers
        walked = walkers.step(actions)
        seen, rewards, terminated, truncated, _ = twin.step(actions.numpy())
        assert (walked.observations.numpy() == seen).all()
        assert (walked.rewards.numpy() == rewards).all()
        assert (walked.terminated.numpy() == terminated).all()
        assert (walked.truncated.numpy() == truncated).all()
        ended = terminated | truncated
        if ended.any():
            twin.reset(options={"reset_mask": ended})
        ends += int(ended.sum())
    assert ends > 4


@pytest.mark.parametrize("task", TASK_VERSIONS)
def test_jacobians_of_steps_agree_with_differences_of_steps(task):
    options = EnvOptions(push_level=0.2, mirror=False)
    n = 32
    env = WalkerVectorEnv(n, task, autoreset_mode="Disabled", **vars(options))
    env.reset(seed=1)
    simulation = env.simulation
    linearised = LinearisedSteps(simulation)
    zero = np.zeros((n, 2), np.float32)
    for _ in range(3):
        env.step(zero)
    before, actions = env.get_state(), np.full((n, 2), [0.25, 0.0625], np.float32)

    def stepped(name=None, shift=0.0):
        """The outputs of a step from where a field is moved."""
        env.set_state(before)
        if name is not None:
            records = simulation.walkers if name in WALKER.names else simulation.tasks
            records[name] += shift
        linearised.prepare()
        seen, rewards, *_ = env.step(actions)
        durations = simulation.walkers["duration"]
        return np.column_stack([linearised.values(), seen, rewards, durations])

    stepped()
    jacobians, walks = linearised.jacobians(), ~simulation.terminated
    assert walks.mean() > 0.8
    h = 1e-5
    exact = [k for k, name in enumerate(linearised.outputs) if k < len(linearised.followed)]
    exact += [len(linearised.outputs) - 2, len(linearised.outputs) - 1]
    observed = range(len(linearised.followed), len(linearised.outputs) - 2)
    for column, name in enumerate(linearised.followed):
        if name == "mass_offset":
            continue  # the command moves with it, within the largest change
        difference = (stepped(name, h) - stepped(name, -h)) / (2.0 * h)
        error = np.abs(difference - jacobians[:, :, column])[walks & ~simulation.terminated]
        # the integrator's tolerance of 1e-10 over 2 h, and h^2 times third derivatives of order 1e4
        assert error[:, exact].max() < 1e-4, name
        # observations are float32: up to 10, rounded to 5e-7, over h
        assert error[:, observed].max() < 0.1, name


# --- returns


def window_of(durations, rate=1.0, terminated=None, truncated=None) -> Steps:
    """One walker's window of steps that earn a rate of reward."""
    durations = torch.as_tensor(durations, dtype=torch.float64)[:, None]
    none = torch.zeros_like(durations, dtype=torch.bool)
    ends = [none.clone(), none.clone()]
    for end, step in zip(ends, (terminated, truncated), strict=True):
        if step is not None:
            end[step] = True
    empty = torch.zeros(len(durations), 1, 1)
    return Steps(empty, empty, rate * durations, durations, *ends, durations, durations)


@pytest.mark.parametrize("trace", [0.0, 0.7, 1.0])
@pytest.mark.parametrize("step", [0.2, 0.73, 3.0])
def test_a_steady_rate_is_worth_the_same_whatever_the_steps_length(step, trace):
    rate, constant = 0.8, 24.0
    window = window_of([step] * 20, rate)
    worth = torch.full((20, 1), rate * constant, dtype=torch.float64)
    returns = time_discounted_returns(window, worth, constant, trace)
    assert returns.numpy() == pytest.approx(worth.numpy(), rel=1e-12)


def test_whole_trace_is_the_discounted_integral_and_then_the_critic():
    constant = 10.0
    durations = np.random.default_rng(0).uniform(0.3, 1.5, 12)
    values = torch.zeros(12, 1, dtype=torch.float64)
    values[-1] = 5.0
    returns = time_discounted_returns(window_of(durations, 0.5), values, constant, 1.0)
    share = np.exp(-durations[::-1].cumsum()[::-1] / constant)
    expected = 0.5 * constant * (1.0 - share) + 5.0 * share
    assert returns[:, 0].numpy() == pytest.approx(expected, rel=1e-12)


def test_nothing_is_earned_after_a_fall_and_the_critic_s_value_after_a_time_limit():
    values = torch.full((3, 1), 100.0, dtype=torch.float64)
    fall = window_of([1.0, 0.0, 1.0], terminated=1)
    assert float(time_discounted_returns(fall, values, 10.0, 0.5)[1]) == 0.0
    limit = window_of([1.0, 1.0, 1.0], truncated=1)
    here = float(time_discounted_returns(limit, values, 10.0, 1.0)[1])
    assert here == pytest.approx(10.0 * (1.0 - np.exp(-0.1)) + 100.0 * np.exp(-0.1))


# --- training


def trained(**changes):
    return train("apg", ID, replace(TINY, **changes), options=SHORT, progress=False)


def test_a_short_training_steers_better_than_the_fixed_controller():
    settings = GradientSettings(
        steps=24_000, walkers=32, window=32, critic_first=6_000, hidden=(32, 32)
    )
    policy = train("apg", ID, settings, seed=1, progress=False).policy
    seeds = range(VALIDATION, VALIDATION + 48)
    errors = [
        run_seeds(agent, "Heading", seeds).metrics["mean_absolute_heading_error"].mean()
        for agent in (policy, FixedController())
    ]
    # 0.77 of it when this was written; what is asked for is less than any luck of the start gives
    assert errors[0] < 0.9 * errors[1]


def test_training_is_decided_by_its_seed():
    first, again, other = trained(), trained(), train("apg", ID, TINY, seed=1, options=SHORT, progress=False)  # fmt: skip
    for name, weights in first.policy.weights.items():
        assert (weights == again.policy.weights[name]).all()
    assert (first.log.returns == again.log.returns).all()
    assert (first.policy.weights["layers.0.weight"] != other.policy.weights["layers.0.weight"]).any()  # fmt: skip


def test_a_training_logs_each_of_its_episodes_by_itself():
    log = trained().log
    # every step belongs to one episode, and some are not over when the training is
    assert 0 < log.lengths.sum() <= TINY.steps
    assert len(log.lengths) > TINY.walkers


def test_interrupted_training_goes_on_bit_for_bit(tmp_path: Path):
    whole = trained()
    file = tmp_path / "checkpoint.safetensors"

    def interrupt(steps: int, recent_return: float) -> None:
        if steps >= 640:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train("apg", 
            ID, TINY, options=SHORT, progress=False, checkpoint=file, checkpoint_seconds=0.0, report=interrupt,
        )  # fmt: skip
    resumed = train("apg", ID, TINY, options=SHORT, progress=False, checkpoint=file)
    for name, weights in whole.policy.weights.items():
        assert (weights == resumed.policy.weights[name]).all()
    for name in ("steps", "returns", "lengths", "survived"):
        assert (getattr(whole.log, name) == getattr(resumed.log, name)).all()


def test_checkpoint_of_another_training_is_refused(tmp_path: Path):
    file = tmp_path / "checkpoint.safetensors"
    train("apg", ID, TINY, options=SHORT, progress=False, checkpoint=file)
    with pytest.raises(CheckpointError, match="these settings"):
        train("apg", ID, replace(TINY, hidden=(4,)), options=SHORT, progress=False, checkpoint=file)  # fmt: skip


def test_trained_policy_is_kept_and_loaded_as_any_other(tmp_path: Path):
    policy = trained().policy
    save(policy, tmp_path)
    again = load(tmp_path, env_id=ID)
    assert again.card == policy.card
    assert again.card.algorithm == "apg"
    observation = np.random.default_rng(0).normal(size=(5, 7)).astype(np.float32)
    assert (again.predict(observation)[0] == policy.predict(observation)[0]).all()
    assert len(trained().log.returns) > 10


# --- bad input


def test_every_task_has_settings_and_formulas():
    for task in TASK_VERSIONS:
        assert settings_for("apg", task).steps > 0
    with pytest.raises(ValueError, match="task of apg must be one of"):
        settings_for("apg", "Nothing")


@pytest.mark.parametrize(
    ("name", "value"),
    [("walkers", 0), ("window", 0), ("trace", 1.1), ("exploration", 0.0), ("critic_memory", -0.1), ("hidden", ()), ("critic_batches", 7), ("push_level", -1.0)],
)  # fmt: skip
def test_impossible_settings_are_refused(name, value):
    with pytest.raises(ValueError, match=name):
        replace(TINY, **{name: value})


def test_delayed_actions_are_refused():
    with pytest.raises(ValueError, match="action_delay"):
        DifferentiableWalkers("Heading", EnvOptions(action_delay=True), 2)
