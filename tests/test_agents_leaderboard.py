"""The leaderboard: comparisons that mean what they say, episodes kept and found again, and a page with all of it."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import FixedController, RandomController, references
from agents.command_line import app
from agents.evaluation import leaderboard, plan
from agents.evaluation.comparison import (
    Hypothesis,
    best_feedback,
    compared_rows,
    hypotheses_of,
    rivals_of,
)
from agents.evaluation.episodes import (
    FELL,
    RETURN,
    SURVIVAL,
    TIME,
    TIME_PER_FALL,
    Episodes,
    Results,
    direction,
    is_share,
    metric_row,
)
from agents.evaluation.leaderboard import (
    leaderboard_page,
    level_candidates,
    level_rows,
    make_leaderboard,
)
from agents.evaluation.pictures import save_leaderboard_plot, save_push_levels_plot
from agents.evaluation.plan import Candidate, Evaluation
from agents.evaluation.recording import record_episode
from agents.evaluation.row_tables import rows_to_csv
from agents.evaluation.scoring import run_episodes
from agents.registry import (
    AGENTS,
    KINDS,
    AgentRequest,
    agent_colour,
    make_agent,
    make_all,
    names_for,
)
from agents.seeds import first_seed
from lean_yaw_env import Walker
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.registration import ENV_IDS, TASK_VERSIONS
from lean_yaw_env.rendering.palette import AGENT_COLOURS

SHORT = EnvOptions(horizon=8.0)
ENDLESS = "Metastable"
"""A task that measures the time to a fall."""
EPISODES = 6


def run_all(candidates: list[Candidate], **arguments) -> list[Results]:
    return Evaluation(progress=False, **arguments).run(candidates)


def walked(task: str, agent: str, returns: np.ndarray, **metrics: np.ndarray) -> Results:
    """Results with these values, (trainings, episodes); everything else is one."""
    names = (RETURN, *task_named(task).metrics, TIME, FELL)
    given = {RETURN: returns} | metrics
    runs = [
        Episodes(
            np.ones(returns.shape[1], dtype=bool),
            {name: given.get(name, np.ones_like(returns))[k] for name in names},
        )
        for k in range(len(returns))
    ]
    return Results(task, agent, tuple(runs))


def returns(mean: float, trainings: int = 1) -> np.ndarray:
    episodes = np.random.default_rng(0).normal(0.0, 5.0, 60)
    noise = np.random.default_rng(int(mean)).normal(0.0, 0.2, (trainings, 60))
    return mean + episodes + noise


def named(*results: Results) -> dict[str, Results]:
    return {each.agent: each for each in results}


def hypothesis(results: dict[str, Results], better: str, worse: str) -> Hypothesis:
    """That one of these agents of Heading is better than another, with no other hypothesis beside it."""
    rival = {"Heading": worse}
    return next(
        each for each in hypotheses_of({"Heading": results}, rival) if each.better == better
    )


SAMPLES = named(
    walked("Heading", "random", returns(10.0)),
    walked("Heading", "fixed", returns(12.0)),
    walked("Heading", "feedback", returns(15.0)),
    walked("Heading", "lqr", returns(20.0)),
    walked("Heading", "ppo", returns(21.0, trainings=3)),
)


def test_every_task_has_a_headline_with_a_direction():
    for name in TASK_VERSIONS:
        task = task_named(name)
        if task.headline not in (RETURN, TIME_PER_FALL):
            assert task.metrics[task.headline].better is not None
    assert is_share("WaypointGoal", "is_success") and is_share("Walk", SURVIVAL)
    assert not is_share("Waypoint", "goals")


def test_the_best_feedback_controller_is_neither_the_baseline_nor_the_learned():
    assert best_feedback(SAMPLES) == "lqr"
    assert best_feedback({"fixed": SAMPLES["fixed"]}) is None


def test_a_small_difference_on_the_same_episodes_is_seen_through_their_spread():
    found = hypothesis(named(SAMPLES["ppo"], SAMPLES["lqr"]), "ppo", "lqr")
    # episodes spread by 5, agents differ by 1 on each
    assert found.verdict == "better" and found.p_value < 0.001
    assert found.comparison.mean.low > 0.5
    assert hypothesis(named(SAMPLES["lqr"], SAMPLES["ppo"]), "lqr", "ppo").verdict == "worse"
    twin = replace(SAMPLES["lqr"], agent="fixed")
    found = hypothesis(named(SAMPLES["lqr"], twin), "fixed", "lqr")
    assert found.verdict == "tie" and found.p_value == 1.0


def test_of_an_error_less_is_better():
    error = "mean_absolute_heading_error"
    low, high = (
        walked("Heading", name, returns(5.0), **{error: value * np.ones((1, 60))})
        for name, value in (("lqr", 0.1), ("fixed", 0.3))
    )
    rows, _ = compared_rows({"Heading": named(low, high)}, {"Heading": "lqr"})
    row = next(row for row in rows if (row.agent, row.metric) == ("fixed", error))
    assert row.difference == pytest.approx(0.2) and direction("Heading", error) == -1
    assert row.verdict is None  # only the headline is tested


def test_a_mean_and_an_interquartile_mean_that_disagree_are_called_mixed():
    steady = walked("Heading", "lqr", np.full((1, 60), 10.0))
    failing = np.full((1, 60), 10.1)
    failing[0, :8] = 0.0  # better in most episodes, and falls in some
    results = named(steady, walked("Heading", "fixed", failing))
    assert hypothesis(results, "fixed", "lqr").verdict == "mixed"


def test_an_agent_that_walked_fewer_episodes_is_compared_on_those():
    few = walked("Heading", "feedback", returns(19.0)[:, :20])
    found = hypothesis(named(SAMPLES["lqr"], few), "feedback", "lqr")
    assert found.comparison.episodes == 20
    assert found.verdict == "worse"


def test_a_few_episodes_decide_nothing_however_clear_they_are():
    results = named(
        walked("Heading", "lqr", np.full((1, 4), 10.0)),
        walked("Heading", "mpc", np.full((1, 4), 11.0)),
    )
    found = hypothesis(results, "mpc", "lqr")
    # four equal signs by chance: 2 / 2^4
    assert found.p_value == 0.125 and found.verdict == "tie"


def test_rows_say_against_whom_and_leave_undefined_episodes_uncompared():
    holed = returns(12.0)
    holed[0, 3] = np.nan
    results = named(
        walked("Heading", "fixed", returns(12.0), settled_fraction=holed), SAMPLES["lqr"]
    )
    found, _ = compared_rows({"Heading": results}, rivals_of({"Heading": results}))
    rows = {(row.agent, row.metric): row for row in found}
    assert rows["fixed", RETURN].against == "lqr"
    assert rows["fixed", RETURN].verdict == "worse"
    assert rows["fixed", "settled_fraction"].against is None
    assert rows["fixed", "commands"].against is None  # it only describes
    assert rows["lqr", RETURN].against is None


def test_hypotheses_are_of_fixed_over_random_and_of_every_agent_over_the_rival():
    hypotheses = hypotheses_of({"Heading": SAMPLES}, {"Heading": "lqr"})
    assert [(each.better, each.worse, each.verdict) for each in hypotheses] == [
        ("fixed", "random", "better"), ("random", "lqr", "worse"), ("fixed", "lqr", "worse"),
        ("feedback", "lqr", "worse"), ("ppo", "lqr", "better"),
    ]  # fmt: skip
    assert hypotheses_of({"Heading": SAMPLES}, {"Heading": None})[0].better == "fixed"
    assert len(hypotheses_of({"Heading": SAMPLES}, {})) == 1


def test_a_hypothesis_needs_a_smaller_p_value_the_more_hypotheses_there_are():
    noise = np.random.default_rng(3).normal(0.0, 1.0, (1, 60))
    slight = walked("Heading", "feedback", returns(20.0) + 0.3 + noise)
    alone = hypothesis(named(SAMPLES["lqr"], slight), "feedback", "lqr")
    assert alone.holds and alone.p_value == alone.comparison.p_value > 0.001
    twins = [replace(slight, agent=f"twin{k}") for k in range(40)]
    among = hypothesis(named(SAMPLES["lqr"], slight, *twins), "feedback", "lqr")
    assert among.comparison == alone.comparison
    assert among.p_value == pytest.approx(min(41 * alone.p_value, 1.0))
    assert among.verdict == "tie"


def test_an_agent_is_drawn_alike_whoever_else_is_evaluated():
    alone = compared_rows({"Heading": named(SAMPLES["ppo"])}, {})[0]
    among = compared_rows({"Heading": SAMPLES}, {})[0]
    # NaN is no equal of itself
    assert repr(alone) == repr([row for row in among if row.agent == "ppo"])


def test_every_agent_has_a_kind_and_is_made_for_its_tasks_alone():
    for name, entry in AGENTS.items():
        assert entry.kind in KINDS
        for env_id in ENV_IDS:
            task = env_id.partition("/")[2].partition("-")[0]
            if task not in entry.tasks:
                with pytest.raises(ValueError, match=f"{name} is an agent for"):
                    make_agent(name, AgentRequest(env_id, EnvOptions()))


def test_learned_agents_are_there_where_a_training_is_found(tmp_path: Path):
    request = AgentRequest("LeanYaw/Walk-v1", EnvOptions(), path=tmp_path)
    assert "ppo" in names_for(request)
    quick = make_all(replace(request, path=None, runs=tmp_path), ("baseline",))
    assert list(quick) == ["random", "fixed"]


def test_episodes_walked_in_parts_are_those_of_one_evaluation(monkeypatch):
    monkeypatch.setattr(plan, "_CHUNK", 4)
    found = run_all([Candidate("Walk", "fixed", EPISODES, SHORT)], seed=3)[0]
    whole = run_episodes(FixedController(), "Walk", episodes=EPISODES, seed=3, options=SHORT)
    for name, values in whole.metrics.items():
        assert np.array_equal(found.values(name)[0], values)


def test_an_interrupted_evaluation_goes_on_and_loses_nothing(tmp_path: Path, monkeypatch):
    candidates = [Candidate("Walk", name, EPISODES, SHORT) for name in ("fixed", "random")]
    expected = run_all(candidates)

    real, calls = plan.run_seeds, []

    def interrupted(*arguments, **options):
        calls.append(arguments)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(*arguments, **options)

    monkeypatch.setattr(plan, "run_seeds", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_all(candidates, cache=tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    again = run_all(candidates, cache=tmp_path)
    assert len(calls) == 3  # the first agent's are not walked again
    for one, other in zip(expected, again, strict=True):
        assert np.array_equal(one.values(RETURN), other.values(RETURN))
    assert run_all(candidates, cache=tmp_path)[0].seconds == again[0].seconds
    assert len(calls) == 3


def test_kept_episodes_are_not_taken_for_other_ones(tmp_path: Path):
    candidate = Candidate("Walk", "fixed", 2, SHORT)
    run_all([candidate], cache=tmp_path)
    for other in (
        replace(candidate, episodes=3),
        replace(candidate, options=EnvOptions(horizon=7.0)),
        replace(candidate, agent="random"),
    ):
        before = len(list(tmp_path.iterdir()))
        run_all([other], cache=tmp_path)
        assert len(list(tmp_path.iterdir())) == before + 1
    run_all([candidate], seed=1, cache=tmp_path)
    assert len(list(tmp_path.iterdir())) == 5


def test_a_damaged_file_is_walked_again(tmp_path: Path):
    candidate = Candidate("Walk", "fixed", 2, SHORT)
    first = run_all([candidate], cache=tmp_path)[0]
    next(tmp_path.iterdir()).write_bytes(b"PK damaged")
    again = run_all([candidate], cache=tmp_path)[0]
    assert np.array_equal(first.values(RETURN), again.values(RETURN))


def test_two_processes_give_the_results_of_one(monkeypatch):
    monkeypatch.setattr(plan, "_WORTH_PROCESSES", 2)
    candidates = [Candidate("Walk", name, 3, SHORT) for name in ("fixed", "random")]
    for one, two in zip(run_all(candidates), run_all(candidates, processes=2), strict=True):
        assert np.array_equal(one.values(RETURN), two.values(RETURN))


def test_push_levels_are_walked_by_the_agents_of_one_task_alone():
    own = Candidate(ENDLESS, "fixed", EPISODES, SHORT)
    candidates = level_candidates([own, Candidate("Walk", "fixed", EPISODES, SHORT)], (0.1, 2.0))
    assert [each.options.push_level for each in candidates] == [0.1, 2.0]
    rows = level_rows(run_all([own, *candidates]))
    assert list(rows) == sorted([0.1, task_named(ENDLESS).push_level, 2.0])
    assert all(row.metric == TIME_PER_FALL for of_level in rows.values() for row in of_level)


def test_the_time_per_fall_is_that_of_the_episodes():
    (found,) = run_all([Candidate(ENDLESS, "fixed", 40, EnvOptions(horizon=15.0))])
    times, fell = found.values(TIME)[0], found.values(FELL)[0]
    assert 0 < fell.sum() < 40
    assert np.array_equal(fell == 1.0, found.values(SURVIVAL)[0] == 0.0)
    assert (times[fell == 0.0] >= 15.0).all() and (times[fell == 1.0] <= 15.0).all()
    row = metric_row(found, TIME_PER_FALL)
    assert 10.0**row.mean == pytest.approx(times.sum() / fell.sum(), rel=1e-12)
    assert row.low < row.mean < row.high and row.episodes == 40


def test_walks_until_a_fall_are_cut_sooner_than_their_task_cuts_them():
    evaluation = Evaluation(episodes=1000, progress=False)
    (own,) = evaluation.candidates([ENDLESS], ["lqr"])
    assert (own.episodes, own.options.horizon) == (plan.LONG_EPISODES, plan.LONG_HORIZON)
    assert evaluation.candidates([ENDLESS], ["mpc"])[0].episodes == plan.LONG_COSTLY_EPISODES
    (other,) = evaluation.candidates(["Walk"], ["lqr"])
    assert (other.episodes, other.options) == (1000, EnvOptions())
    given = Evaluation(options=SHORT, progress=False)
    assert given.candidates([ENDLESS], ["lqr"])[0].options == SHORT


def fallen(agent: str, mean: float, episodes: int = 60, trainings: int = 1) -> Results:
    """Walks of an agent that falls after a mean time, cut at 100; of an infinite one, never."""
    times = np.random.default_rng(1).exponential(1.0, (trainings, episodes)) * mean
    fell = (times < 100.0).astype(float)
    return walked(
        ENDLESS, agent, np.minimum(times, 100.0), time=np.minimum(times, 100.0), fell=fell
    )


def test_who_falls_less_often_is_better_however_few_fall():
    results = {ENDLESS: named(*(fallen(*each) for each in (("lqr", 50.0), ("ppo", 200.0), ("sac", np.inf))))}  # fmt: skip
    hypotheses = {each.better: each for each in hypotheses_of(results, {ENDLESS: "lqr"})}
    assert hypotheses["ppo"].holds and hypotheses["sac"].holds
    assert hypotheses["ppo"].comparison.mean.value == pytest.approx(np.log10(4.0), abs=0.2)
    assert np.isfinite(hypotheses["sac"].comparison.mean).all()
    few = {ENDLESS: named(fallen("lqr", 5000.0), fallen("ppo", np.inf))}
    fell = few[ENDLESS]["lqr"].values(FELL).sum()
    assert 0 < fell < 5  # too few to say anything
    assert hypotheses_of(few, {ENDLESS: "lqr"})[0].verdict == "tie"
    assert best_feedback(named(fallen("lqr", 50.0), fallen("feedback", 20.0))) == "lqr"


def test_an_agent_that_never_falls_has_a_bound_and_no_infinity_anywhere(tmp_path):
    results = {ENDLESS: named(fallen("lqr", 50.0), fallen("ppo", np.inf, trainings=2))}
    rows, hypotheses = compared_rows(results, {ENDLESS: "lqr"})
    page = leaderboard_page(rows, hypotheses, {0.5: rows[:1]}, {}, "Made by a test.")
    bound = np.log10(2 * 60 * 100.0 / -np.log(0.025))
    assert f"| ≥ {bound:.3f} |" in page and "log10 time per fall ↑" in page
    text = rows_to_csv(rows)
    assert "inf" not in text and "inf" not in page.lower().replace("information", "")
    row = next(row for row in csv.DictReader(text.splitlines()) if row["agent"] == "ppo")
    assert (row["metric"], row["mean"], row["high"]) == (TIME_PER_FALL, "", "")
    assert float(row["low"]) == pytest.approx(bound)
    assert row["verdict"] == "better"
    save_leaderboard_plot(rows, tmp_path / "board.png")
    save_push_levels_plot({0.5: rows[:1], 1.0: [row for row in rows if row.agent == "ppo"][:1]}, tmp_path / "levels.png")  # fmt: skip


def test_a_recorded_episode_keeps_goals_and_path():
    waypoint = record_episode(FixedController(), "Waypoint", seed=1, most_steps=5)
    assert not waypoint.scene.goals[-1].reached
    assert waypoint.scene.goals[0].radius == 0.5
    slalom = record_episode(FixedController(), "Slalom", seed=1, most_steps=5)
    assert slalom.scene.reference_path is not None and slalom.scene.reference_path.shape[1] == 2
    assert not slalom.scene.goals
    assert (
        record_episode(RandomController(0), "Walk", seed=1, most_steps=5).scene.reference_path
        is None
    )


def test_a_random_body_s_path_is_walked_by_that_body():
    options = EnvOptions(random_body="training", start_disturbance=0.0)
    episode = record_episode(FixedController(), "Walk", seed=3, options=options, most_steps=6)
    assert episode.scene.parameters != EnvOptions().walker_parameters(task_named("Walk"))
    walker = Walker(episode.scene.parameters)
    # the path in a step ends where that body's own step takes it: at the time of the next heel strike
    env = WalkerEnv("Walk", **vars(options))
    _, info = env.reset(seed=3)
    ends = []
    for _ in range(6):
        step = walker.step(info["state"], stance="left" if info["stance_side"] > 0.0 else "right")
        _, _, _, _, after = env.step(np.zeros(2, dtype=np.float32))
        assert after["state"] == pytest.approx(step.state, abs=1e-12)
        ends.append(info["time"] + step.duration)
        info = after
    times = episode.path[:, 0]
    assert times[-1] == pytest.approx(ends[-1], abs=1e-12)
    assert all(np.abs(times - end).min() < 1e-12 for end in ends)


def test_every_agent_has_a_colour_of_its_own():
    assert set(AGENT_COLOURS) == set(AGENTS)
    assert len({agent_colour(name) for name in AGENTS}) == len(AGENTS)


def test_the_leaderboard_holds_every_agent_and_the_command_that_made_it(tmp_path: Path):
    evaluation = Evaluation(episodes=4, options=SHORT, cache=tmp_path / "kept", progress=False)
    candidates = evaluation.candidates(["Walk", "Metastable"], ["random", "fixed"])
    rows, _ = make_leaderboard(
        candidates, evaluation, tmp_path / "docs", "make it", starts=8, points=3
    )
    page = (tmp_path / "docs" / "leaderboard.md").read_text()
    assert page.startswith("# Leaderboard\n\nThis page is generated by `make it`")
    cells = [line.split("|")[-3].strip() for line in page.splitlines() if "| baseline |" in line]
    assert cells[0] == "" and 0.0 <= float(cells[1].rstrip("%")) <= 100.0  # random draws, fixed not
    for words in (
        "## Walk",
        "## Metastable",
        "| random | baseline |",
        "random < fixed",
        "| 0.5 | 0.7",
    ):
        assert words in page
    with open(tmp_path / "docs" / "leaderboard.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    images = {path.name for path in (tmp_path / "docs" / "images").iterdir()}
    assert images == {
        "leaderboard.png", "push_levels.png", "footprints_walk.png", "footprints_metastable.png", "capture_walk_friction_0.6.png",
        "capture_metastable_friction_0.6.png"
    }  # fmt: skip
    assert "(images/capture_metastable_friction_0.6.png)" in page


def test_a_page_says_plainly_what_does_not_hold():
    results = named(
        walked("Heading", "lqr", returns(20.0)),
        walked("Heading", "ppo", returns(20.0, trainings=2) - 0.001),
        walked("Heading", "sac", returns(15.0, trainings=2)),
    )
    rows, hypotheses = compared_rows({"Heading": results}, {"Heading": "lqr"})
    page = leaderboard_page(rows, hypotheses, {}, {}, "Made by a test.")
    assert "no: no significant difference from lqr" in page
    assert "no: sac is worse than lqr" in page
    assert "**ppo** is better than the best feedback controller on no task" in page
    assert "The correction is for 2 comparisons" in page


def test_a_page_says_whether_the_best_agent_leaves_room_to_win(monkeypatch):
    known = {"metric": RETURN, "fixed": 10.0, "found_by": "a search"}
    found = {
        task: SimpleNamespace(**known, value=value) for task, value in (("Heading", 30.0), ("Level", 21.0))
    }  # fmt: skip
    monkeypatch.setattr(references, "references", lambda: found)
    monkeypatch.setattr(leaderboard, "references", lambda: found)
    results = {
        task: named(walked(task, "fixed", np.full((1, 9), 10.0)), walked(task, "lqr", np.full((1, 9), 20.0)))
        for task in ("Heading", "Level", "Slalom", "Walk")
    }  # fmt: skip
    rows, hypotheses = compared_rows(results, {})
    rows = [leaderboard._normalised(row) for row in rows]
    assert {row.normalised for row in rows if (row.task, row.metric) == ("Heading", RETURN)} == {0.0, 0.5}  # fmt: skip
    page = leaderboard_page(rows, hypotheses, {}, {}, "Made by a test.")
    assert "30.0 (a search) | lqr | 20.0 [20.0, 20.0] | 0.50 | yes |" in page
    assert "| 0.91 | **no: nearly solved** |" in page
    assert "not known: no reference" in page
    assert "**A smoke test: it ranks no agent.**" in page and "| Walk | return" not in page


def test_a_task_that_ranks_nobody_has_no_hypotheses():
    of_walk = named(*(walked("Walk", name, returns(k)) for k, name in enumerate(("random", "fixed", "lqr"))))  # fmt: skip
    assert hypotheses_of({"Walk": of_walk}, {"Walk": "lqr"}) == []


def test_the_rival_is_chosen_on_validation_and_only_the_leaderboard_reads_the_test(
    tmp_path: Path, monkeypatch
):
    read: list[tuple[str, int]] = []
    real = plan.run_seeds

    def recorded(agent, task, seeds, **options):
        read.append((type(agent).__name__, seeds.start))
        return real(agent, task, seeds, **options)

    monkeypatch.setattr(plan, "run_seeds", recorded)
    evaluation = Evaluation(episodes=2, options=SHORT, progress=False)
    candidates = evaluation.candidates(["Heading"], ["fixed", "feedback", "lqr"])
    evaluation.run(candidates)
    assert {start for _, start in read} == {first_seed("validation")}
    read.clear()
    make_leaderboard(candidates, evaluation, tmp_path, "make it", starts=8, points=3)
    names = ["HeadingFeedback", "HeadingLqr"]
    assert read[:2] == [(name, first_seed("validation")) for name in names]
    assert {start for _, start in read[2:]} == {first_seed("test")}


def test_pictures_alone_are_drawn_by_one_option(tmp_path: Path):
    arguments = ["evaluate", "--task", "Waypoint", "--agents", "fixed", "--pictures", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert [path.name for path in tmp_path.iterdir()] == ["footprints_waypoint.png"]


def test_bad_numbers_and_runs_of_other_episodes_are_refused():
    with pytest.raises(ValueError, match="episodes must be from"):
        Candidate("Walk", "fixed", 0, SHORT)
    with pytest.raises(ValueError, match="processes must be from"):
        run_all([], processes=0)
    one, two = (walked("Walk", "fixed", np.ones((1, n))).runs[0] for n in (2, 3))
    with pytest.raises(ValueError, match="runs must be one or more of the same episodes"):
        Results("Walk", "fixed", (one, two))
