"""The sweep figure: every draw is accounted for, and heavy tails do not rule the axes."""

import numpy as np
import pytest
from helpers.builders import make_sweep

from memscal.extensions.monte_carlo.sweep_figure import sweep_figure


def line(axes, label):
    (found,) = [each for each in axes.lines if each.get_label() == label]
    return np.asarray(found.get_xdata(), float), np.asarray(found.get_ydata(), float)


def test_each_panel_holds_the_exact_results_in_its_unit():
    sweep = make_sweep()
    a, sigma, misfit = sweep_figure(sweep).axes
    np.testing.assert_allclose(line(a, "exact expectation")[1], sweep.conversion_constant / 1e-8)
    np.testing.assert_allclose(
        line(sigma, "exact expectation")[1], sweep.gaussian_sigma_deconvolved * 1e3
    )
    np.testing.assert_allclose(line(misfit, "exact expectation")[1], sweep.relative_rms * 100)
    assert misfit.get_xscale() == "log"


def test_the_median_of_the_draws_is_drawn_and_every_draw_is_a_dot():
    sweep = make_sweep()
    sigma = sweep_figure(sweep).axes[1]
    _, median = line(sigma, "median of draws")
    np.testing.assert_allclose(median, np.median(sweep.seed_gaussian_sigma, axis=1) * 1e3)
    _, dots = line(sigma, "one draw")
    np.testing.assert_allclose(np.sort(dots), np.sort(sweep.seed_gaussian_sigma.ravel() * 1e3))


def test_the_right_hand_axis_is_zero_percent_at_the_rules_amplitude():
    sweep = make_sweep()
    axes = sweep_figure(sweep).axes[1]
    (right,) = axes.child_axes
    to_percent = right._functions[0]  # what the drawn ticks are computed with
    at_rule = sweep.gaussian_sigma_deconvolved[4] * 1e3
    assert to_percent(at_rule) == pytest.approx(0.0, abs=1e-12)
    assert to_percent(1.05 * at_rule) == pytest.approx(5.0)
