"""Figures of a comparison: what is drawn are the comparison's numbers, and nothing is lost."""

import math

import numpy as np
import pytest
from helpers.friction_results import LOADS, comparison, interface_comparison, stress

from memscal.errors import InputError
from memscal.extensions.interface_laws.figure import interface_figure
from memscal.figures.friction import comparison_figure, maxima_figure
from memscal.figures.friction_profiles import (
    friction_position,
    friction_set_figure,
    profile_figure,
)
from memscal.figures.style import render_figure


@pytest.fixture(scope="module")
def found():
    return comparison()


def bars(axes):
    """Abscissae, values and expanded uncertainties of the error bars in a panel."""
    drawn = []
    for points, _, (stems,) in axes.containers:
        x, y = points.get_data()
        heights = np.array([np.ptp(segment[:, 1]) / 2 for segment in stems.get_segments()])
        drawn.append((np.asarray(x, float), np.asarray(y, float), heights))
    return drawn


def test_profiles_are_drawn_with_their_expanded_uncertainties(found):
    figure = profile_figure(found, lubrication="lubricated")
    profiles = found.measured.profiles[len(LOADS) :]
    for (r, s, u), profile in zip(bars(figure.axes[0]), profiles, strict=True):
        np.testing.assert_allclose(r, profile.r * 1e3)
        np.testing.assert_allclose(s, profile.s_zz * 1e-3)
        np.testing.assert_allclose(u, 2e-3 * profile.s_zz_errors)


def test_curves_are_of_the_fitted_coefficient_and_of_the_limits(found):
    axes = comparison_figure(found).axes[0]
    best = found.joint["dry"]["incremental"].value
    for ls, friction in (("-", best), (":", 0.0), ("--", math.inf)):
        lines = [
            line for line in axes.lines if line.get_ls() == ls and np.size(line.get_xdata()) > 99
        ]
        assert len(lines) == len(LOADS)
        for line, load in zip(lines, LOADS, strict=True):
            expected = stress(np.asarray(line.get_xdata()) * 1e-3, load, friction, "incremental")
            np.testing.assert_allclose(
                np.asarray(line.get_ydata()) * 1e3, expected, atol=2e-3 * expected.max()
            )


def test_ratios_stand_at_their_loads_among_the_calculated_curves(found):
    figure = maxima_figure(found)
    assert len(figure.axes) == len(found.loadings)
    for axes, loads in zip(figure.axes, found.loads.values(), strict=True):
        dry, lubricated = bars(axes)
        of_dry = [one for one in loads if one.lubrication == "dry"]
        np.testing.assert_allclose(dry[0], [one.load for one in of_dry])
        np.testing.assert_allclose(dry[1], [one.ratio for one in of_dry])
        np.testing.assert_allclose(dry[2], [2 * one.ratio_uncertainty for one in of_dry])
        assert np.all(lubricated[1] < dry[1])
        (sticking,) = (line for line in axes.lines if line.get_gid() == "mu=inf")
        np.testing.assert_allclose(
            sticking.get_ydata(), [one.p_max[-1] / one.p0_max for one in of_dry]
        )


def test_an_open_interval_is_an_arrow_to_infinity_without_a_value():
    sticking = comparison(friction=math.inf, lubrications=("dry",), loadings=("incremental",))
    (axes,) = comparison_figure(sticking, name="effective-friction").axes
    open_ends = [line for line in axes.lines if line.get_label() == "_open"]
    of_profile = [one.by_profile for one in sticking.loads["incremental"]]
    assert all(reading.interval.high is None for reading in of_profile)
    assert len(open_ends) == 2 * len(LOADS)
    assert {float(line.get_ydata()[0]) for line in open_ends} == {1.0}
    assert not [line for line in axes.lines if line.get_label() == "_value"]


def test_likelihoods_touch_zero_at_the_best_coefficient(found):
    axes = comparison_figure(found, name="likelihood").axes[0]
    curves = {line.get_label(): line for line in axes.lines}
    one = found.loads["incremental"][0]
    joint = found.joint["dry"]["incremental"]
    for label, reading in (("0.34 N", one.by_profile), ("all loads", joint)):
        t, rise = (np.asarray(values) for values in curves[label].get_data())
        np.testing.assert_allclose(rise, reading.deviance - reading.least, atol=1e-9)
        assert t[np.argmin(rise)] == pytest.approx(float(friction_position(reading.best)))


def test_the_likelihood_of_a_slip_length_touches_zero_at_it():
    figure = interface_figure(comparison(interface=interface_comparison(1.8e-6)))
    curves = {line.get_label(): line for line in figure.axes[0].lines}
    t, rise = (np.asarray(values) for values in curves["tangential, dry"].get_data())
    assert t[np.argmin(rise)] == pytest.approx(1.8 / (1.8 + 3.0), abs=0.01)
    assert render_figure(figure, "png", dpi=50).startswith(b"\x89PNG")


def test_what_was_not_measured_or_compared_is_refused_by_name(found):
    with pytest.raises(InputError, match="sideways"):
        comparison_figure(found, loading="sideways")
    with pytest.raises(InputError, match="not stated"):
        friction_set_figure(found, lubrication="")
    with pytest.raises(InputError, match="interface=True"):
        interface_figure(found)
