"""Means, interquartile means and shares with their intervals: what they are of, and that they are as wide as they should be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from agents.evaluation import intervals
from agents.evaluation.intervals import (
    RESAMPLES,
    equal_rates_p_value,
    holm,
    resample,
    resample_time_per_fall,
    share_estimate,
    time_per_fall_estimate,
)

RNG_SEED = 7


def normal(trainings: int, episodes: int, spread: float = 0.0) -> np.ndarray:
    """Values of mean 3 and standard deviation 2 about trainings that differ by ``spread``."""
    generator = np.random.default_rng(RNG_SEED)
    level = spread * generator.normal(size=(trainings, 1))
    return 3.0 + level + 2.0 * generator.normal(size=(trainings, episodes))


def width(estimate) -> float:
    return estimate.high - estimate.low


@settings(max_examples=50)
@given(arrays(float, st.tuples(st.integers(1, 4), st.just(8)), elements=st.floats(-100, 100)))
def test_the_interquartile_mean_is_scipy_s_trimmed_mean(values):
    # eight episodes: the quarters cut no value in part, which is all that scipy's knows
    expected = stats.trim_mean(values, 0.25, axis=None)
    # sums of at most 32 numbers up to 100, differently ordered
    assert resample(values).iqm == pytest.approx(expected, abs=1e-11)
    assert resample(values).mean == pytest.approx(values.mean(), abs=1e-11)


def test_the_interquartile_mean_forgives_a_fifth_of_failures_and_the_mean_does_not():
    values = np.ones((1, 100))
    values[0, :20] = np.linspace(-50.0, -40.0, 20)
    drawn = resample(values)
    assert drawn.iqm == pytest.approx(1.0, rel=1e-12)
    assert drawn.mean < -5.0


def test_the_interval_of_a_mean_is_near_student_s_on_normal_values():
    values = normal(1, 400)
    estimate = resample(values).mean_estimate()
    expected = stats.t.interval(0.95, 399, values.mean(), stats.sem(values, axis=None))
    # 2000 resamples place a 2.5 % quantile within some 4 % of the interval's half width
    assert estimate[1:] == pytest.approx(expected, abs=0.05 * (expected[1] - expected[0]))


def test_the_interval_of_an_interquartile_mean_covers_the_truth_in_95_percent_of_samples():
    generator = np.random.default_rng(RNG_SEED)
    covered = 0
    for _ in range(200):
        estimate = resample(generator.normal(size=(1, 40))).iqm_estimate()
        covered += estimate.low <= 0.0 <= estimate.high
    # of 200 samples 190 +- 3.1 are covered; four deviations, and percentile intervals of 40 values are a few percent narrow
    assert 174 <= covered <= 200


def test_an_interval_holds_for_another_training_too():
    one = resample(normal(5, 400)).mean_estimate()
    apart = resample(normal(5, 400, spread=3.0)).mean_estimate()
    of_trainings = normal(5, 400, spread=3.0).mean(axis=1)
    # drawn with replacement, the mean of five has the deviation sqrt(4/5) of their standard error
    expected = 2.0 * 1.96 * stats.sem(of_trainings) * np.sqrt(0.8)
    assert width(apart) == pytest.approx(expected, rel=0.2)  # five things have few different draws
    # where trainings do not differ, drawing both ways counts the noise of each episode up to three times (Owen, 2007, theorem 3)
    plain = 2.0 * 1.96 * 2.0 / np.sqrt(5 * 400)
    assert plain < width(one) < 1.1 * np.sqrt(3.0) * plain


def test_differences_are_those_of_pairs():
    easy = normal(1, 200)
    noise = np.random.default_rng(1).normal(0.0, 0.01, easy.shape)
    difference = resample(easy + 0.1 + noise, 1).less(resample(easy, 0))
    assert difference.mean_estimate().value == pytest.approx(0.1, abs=0.01)
    # episodes differ 200 times as much as the agents do on each
    assert width(difference.mean_estimate()) < 0.02 * width(resample(easy).mean_estimate())
    assert difference.iqm_estimate().low > 0.0


def test_undefined_episodes_are_left_out_and_constant_values_have_no_spread():
    assert resample(np.array([[2.0, np.nan, 2.0]])).mean_estimate() == (2.0, 2.0, 2.0)
    assert np.isnan(resample(np.array([[np.nan]])).iqm_estimate()).all()
    holed = normal(2, 40)
    holed[0, ::3] = np.nan
    drawn = resample(holed)
    assert drawn.mean == pytest.approx(np.nanmean(holed), rel=1e-12)
    assert drawn.means.shape == (RESAMPLES,)


def test_the_same_values_give_the_same_interval_and_other_streams_draw_other_trainings():
    values = normal(3, 50, spread=1.0)
    assert resample(values, 1).mean_estimate() == resample(values, 1).mean_estimate()
    assert not np.array_equal(resample(values, 1).means, resample(values, 2).means)


def test_the_interval_of_a_full_share_still_has_a_width():
    estimate = share_estimate(np.ones((1, 100), dtype=bool))
    # Wilson (1927) with all successes: n / (n + z^2)
    assert estimate.low == pytest.approx(100 / (100 + stats.norm.ppf(0.975) ** 2), rel=1e-12)
    assert estimate.high == 1.0


def test_the_interval_of_a_share_is_as_wide_as_trainings_differ():
    generator = np.random.default_rng(RNG_SEED)
    alike = generator.random((4, 400)) < 0.5
    apart = generator.random((4, 400)) < np.array([[0.1], [0.4], [0.6], [0.9]])
    assert width(share_estimate(alike)) < 0.15
    assert width(share_estimate(apart)) > 0.4


def test_nothing_to_draw_from_is_refused():
    with pytest.raises(ValueError, match="one training and one episode"):
        resample(np.empty((0, 3)))


def test_p_values_of_paired_normal_differences_are_near_student_s():
    difference = normal(1, 200) - 3.0 + 0.3
    drawn = resample(difference, resamples=10_000)
    expected = stats.ttest_1samp(difference[0], 0.0).pvalue
    # 10,000 resamples know a share of 0.05 to 0.004; the bootstrap's tails are those of 200 values
    assert drawn.p_value() == pytest.approx(expected, abs=0.015)


def test_the_p_value_of_no_difference_is_one_and_of_a_constant_one_the_smallest_there_is():
    assert resample(np.zeros((1, 20))).p_value() == 1.0
    assert resample(np.ones((1, 20))).p_value() == pytest.approx(2.0 / (RESAMPLES + 1))


def test_holm_s_correction_is_that_of_its_definition():
    # Holm (1979): the smallest of n counts n times, the next n - 1 times, and none falls below an earlier one
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.7]) == [1.0, 1.0]
    assert holm([]) == []


def walks(mean: float, horizon: float, trainings: int, episodes: int, seed: int = RNG_SEED):
    """Times and falls of walkers that fall at random, after a mean time, cut at a horizon."""
    times = np.random.default_rng(seed).exponential(mean, (trainings, episodes))
    return np.minimum(times, horizon), (times < horizon).astype(float)


def test_draws_do_not_depend_on_how_many_are_made_at_a_time(monkeypatch):
    values = normal(3, 50)
    whole = resample(values, 1)
    monkeypatch.setattr(intervals, "_BLOCK", 150 * 7)
    parts = resample(values, 1)
    # the same numbers, summed in another order
    assert parts.means == pytest.approx(whole.means, rel=1e-13)
    assert parts.iqms == pytest.approx(whole.iqms, rel=1e-13)


def test_every_draw_of_episodes_has_as_many_as_there_are():
    for trainings, episodes in intervals._draws((3, 20), 0, 50):
        assert (trainings.sum(axis=1) == 3).all() and (episodes.sum(axis=1) == 20).all()


def test_the_time_per_fall_of_walks_that_are_cut_is_still_the_mean_time_to_a_fall():
    covered = 0
    for seed in range(200):
        # nine walks of ten are cut
        estimate = time_per_fall_estimate(*walks(1000.0, 100.0, 1, 200, seed))
        covered += estimate.low <= 3.0 <= estimate.high
    # the interval is exact or wide: of 200 samples 190 +- 3.1 are covered, or more
    assert covered >= 180


def test_the_interval_of_the_time_per_fall_is_garwood_s():
    # Garwood (1936), table 1: 10 events have the 95 % limits 4.795 and 18.39
    times, falls = np.full((1, 20), 50.0), np.repeat([[1.0, 0.0]], 10, axis=0).reshape(1, 20)
    value, low, high = time_per_fall_estimate(times, falls)
    assert value == pytest.approx(2.0, abs=1e-12)
    assert (1000.0 / 10.0**high, 1000.0 / 10.0**low) == pytest.approx((4.795, 18.39), rel=1e-3)


def test_without_a_fall_there_is_a_lower_bound_alone():
    value, low, high = time_per_fall_estimate(np.full((2, 10), 50.0), np.zeros((2, 10)))
    assert np.isnan(value) and np.isnan(high)
    # no event: the upper limit of the number is -ln 0.025 = 3.689
    assert low == pytest.approx(np.log10(1000.0 / -np.log(0.025)), abs=1e-12)


def test_the_interval_of_the_time_per_fall_is_as_wide_as_trainings_differ():
    alike = walks(100.0, 1000.0, 5, 400)
    pooled = time_per_fall_estimate(*(each.reshape(1, -1) for each in alike))
    # drawing both ways counts the noise of each episode up to three times, as of a mean
    assert width(pooled) <= width(time_per_fall_estimate(*alike)) < 1.8 * width(pooled)
    one, other = walks(50.0, 1000.0, 2, 400), walks(500.0, 1000.0, 2, 400)
    apart = time_per_fall_estimate(*(np.concatenate(each) for each in zip(one, other, strict=True)))
    assert width(apart) > 5.0 * width(pooled)


def test_a_draw_without_a_fall_is_finite():
    times, falls = np.full((1, 5), 10.0), np.array([[1.0, 0.0, 0.0, 0.0, 0.0]])
    drawn = resample_time_per_fall(times, falls)
    assert drawn.mean == pytest.approx(np.log10(50.0), abs=1e-12)
    assert drawn.means.max() == pytest.approx(np.log10(100.0), abs=1e-12)


def test_the_test_of_equal_rates_is_the_binomial_one():
    # 5 falls and none in equal times: twice 1 / 2^5
    assert equal_rates_p_value((100.0, 100.0), (5.0, 0.0)) == pytest.approx(2.0 / 2**5)
    assert equal_rates_p_value((100.0, 300.0), (1.0, 3.0)) == 1.0
    assert equal_rates_p_value((100.0, 300.0), (0.0, 0.0)) == 1.0
