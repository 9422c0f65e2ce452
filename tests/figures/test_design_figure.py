"""The figure of a design: what is drawn is what is to be expected."""

from __future__ import annotations

import numpy as np
import pytest

import memscal
from memscal.errors import InputError
from memscal.figures.design import design_figure
from memscal.planning.expected import Design


@pytest.fixture(scope="module")
def planned() -> Design:
    return memscal.design(step=0.5e-3, repeats=2)


def test_curves_are_the_designs_own(planned: Design) -> None:
    radial, transfer, varied = design_figure(planned, vary="repeats").axes
    (g,) = (line for line in radial.lines if line.get_label() == "G expected")
    shown = np.asarray(g.get_ydata())
    np.testing.assert_allclose(shown, planned.g[: shown.size] * 1e-6)
    (band,) = (line for line in transfer.lines if line.get_label() == "resolved")
    assert band.get_xdata()[0] == pytest.approx(planned.resolved_wavenumber * 1e-3)
    (a,) = (line for line in varied.lines if line.get_label() == "A")
    here = list(a.get_xdata()).index(2)
    assert a.get_ydata()[here] == pytest.approx(
        100 * planned.relative_uncertainty("conversion_constant")
    )


@pytest.mark.parametrize("vary", ["step", "half_range", "repeats"])
def test_less_noise_is_less_uncertainty_along_every_axis(planned: Design, vary: str) -> None:
    axes = design_figure(planned, vary=vary).axes[2]
    (sigma,) = (line for line in axes.lines if line.get_label() == "σ")
    first, last = sigma.get_ydata()[0], sigma.get_ydata()[-1]
    assert (last > first) == (vary == "step")


def test_a_plan_with_many_positions_is_not_varied_beyond_reason() -> None:
    dense = memscal.design(step=0.02e-3, half_range=8e-3)
    axes = design_figure(dense, vary="step").axes[2]
    (a,) = (line for line in axes.lines if line.get_label() == "A")
    assert min(a.get_xdata()) >= 16 / 1025


def test_what_cannot_be_varied_is_refused(planned: Design) -> None:
    with pytest.raises(InputError, match="'weather'"):
        design_figure(planned, vary="weather")
