"""A comparison of measured with calculated stress at a glance, and all of its figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from memscal.figures.friction_interface import interface_figure
from memscal.figures.friction_maxima import draw_maxima, maxima_figure
from memscal.figures.friction_profiles import (
    draw_profiles,
    draw_residuals,
    friction_set_figure,
    profile_figure,
)
from memscal.figures.friction_readings import (
    draw_effective,
    effective_friction_figure,
    likelihood_figure,
)
from memscal.figures.friction_scale import chosen, main_loading
from memscal.figures.style import house_style, legend_above, new_figure, panel_letter
from memscal.friction.results import FrictionComparison

__all__ = ["comparison_figure", "comparison_figures"]


def comparison_figure(
    found: FrictionComparison, *, lubrication: str | None = None, loading: str | None = None
) -> Figure:
    """Draw what a comparison found on one page.

    Parameters
    ----------
    found : FrictionComparison
        What was compared.
    lubrication : str, optional
        Whose profiles to draw: of the first one measured by default.
    loading : str, optional
        Definition of the loading: the first one compared by default.

    Returns
    -------
    matplotlib.figure.Figure
        Panel a, measured profiles between no friction and full stick; b, measured maxima over
        frictionless ones against the load; c, residuals against the frictionless profiles; d, the
        effective friction coefficient against the load.

    Raises
    ------
    InputError
        If nothing was measured or compared so.
    """
    loading = main_loading(found, loading)
    loads = chosen(found, loading, lubrication)
    with house_style():
        figure = new_figure(5.6)
        panels = figure.subplots(2, 2)
        draw_profiles(panels[0, 0], found, loads)
        draw_maxima(panels[0, 1], found, loading)
        draw_residuals(panels[1, 0], found, loads, 0)
        panels[1, 0].set_xlim(panels[0, 0].get_xlim())
        draw_effective(panels[1, 1], found, loads[0].lubrication, loading)
        legend_above(panels[1, 1], columns=2)
        for axes, letter in zip(panels.flat, "abcd", strict=True):
            panel_letter(axes, letter)
    return figure


def comparison_figures(found: FrictionComparison) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws each figure of a comparison, by the stem of its file's name.

    Parameters
    ----------
    found : FrictionComparison
        What was compared.

    Returns
    -------
    mapping of str to callable
        ``profiles-dry`` and ``friction-set-dry`` (one for each lubrication), ``maxima``,
        ``effective-friction`` and ``likelihood``, and ``interface`` where one was compared; each
        draws when it is called.
    """
    figures: dict[str, Callable[[], Figure]] = {}
    measured = (profile.lubrication for profile in found.measured.profiles)
    for lubrication in dict.fromkeys(measured):
        tail = f"-{lubrication}" if lubrication else ""
        figures[f"profiles{tail}"] = _of(profile_figure, found, lubrication)
        figures[f"friction-set{tail}"] = _of(friction_set_figure, found, lubrication)
    figures["maxima"] = lambda: maxima_figure(found)
    figures["effective-friction"] = lambda: effective_friction_figure(found)
    figures["likelihood"] = lambda: likelihood_figure(found)
    if found.interface is not None:
        figures["interface"] = lambda: interface_figure(found)
    return figures


def _of(
    draw: Callable[..., Figure], found: FrictionComparison, lubrication: str
) -> Callable[[], Figure]:
    return lambda: draw(found, lubrication=lubrication)
