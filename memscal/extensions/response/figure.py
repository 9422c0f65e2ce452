"""Figure of a response: gain by wavelength, and the smallest stress by wavelength and speed."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from memscal.extensions.response.response import SIGMAS, Response, response
from memscal.figures.style import (
    DECONVOLVED,
    FAILED,
    MEASURED,
    MUTED,
    WINDOW,
    coverage,
    draw_band,
    legend_above,
    panels_of,
)
from memscal.model.arrays import FloatArray
from memscal.model.quantities import MM, Quantity

_FINE = 121
#: Waves are drawn from this share of the shortest resolved one, speeds by this factor around.
_SHORTEST = 0.6
_AROUND = 10.0
#: The longest waves that are drawn without others are of so many thicknesses of the film.
_LONGEST = 10.0
#: So many powers of ten of the smallest stress have contours.
_DECADES = 5


def response_figure(seen: Response) -> Figure:
    """Draw the gain against wavelength; of a noise record, contours of the smallest stress."""
    limit = 2 * math.pi / seen.apparatus.resolved_wavenumber
    longest = max(_LONGEST * seen.film.thickness, *seen.wavelength)
    shortest = min(_SHORTEST * limit, *seen.wavelength)
    # Where no wave has a smallest stress, there is none to draw.
    heard = bool(np.isfinite(seen.smallest_stress).any())
    if heard:
        longest = seen.length
    wavelength = np.geomspace(shortest, longest, _FINE)
    with panels_of(3.4, 1, 1 + heard, squeeze=False) as (figure, [panels]):
        _draw_gain(panels[0], seen, wavelength)
        if heard:
            _draw_smallest(panels[1], seen, wavelength)
        for axes in panels:
            axes.axvspan(shortest / MM, limit / MM, color=WINDOW, alpha=0.12, lw=0)
            axes.axvline(limit / MM, color=WINDOW, ls=":", label="resolved from here")
            axes.set(xscale="log", xlim=wavelength[[0, -1]] / MM, xlabel="wavelength (mm)")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
            legend_above(axes)
    return figure


def _draw_gain(axes: Axes, seen: Response, wavelength: FloatArray) -> None:
    shown = Quantity("gain", "voltage per stress").read_in(seen.apparatus.reading)
    along = _at(seen, wavelength)
    gain = np.abs(along.gain) / shown.scale
    band = coverage() * along.uncertainty / shown.scale
    draw_band(axes, wavelength / MM, gain - band, gain + band)
    axes.plot(wavelength / MM, gain, color=DECONVOLVED, label=f"gain, ±{coverage():g}u")
    modulus = np.abs(seen.gain) / shown.scale
    bars = coverage() * seen.uncertainty / shown.scale
    axes.errorbar(seen.wavelength / MM, modulus, bars, color=MEASURED, fmt="o", ms=3)
    axes.set(yscale="log", ylabel=f"gain ({shown.unit})")


def _draw_smallest(axes: Axes, seen: Response, wavelength: FloatArray) -> None:
    noise = seen.noise_record
    assert seen.speed is not None  # a noise record is given with speeds
    assert noise is not None
    speed = np.geomspace(seen.speed.min() / _AROUND, seen.speed.max() * _AROUND, _FINE)
    smallest = _at(seen, wavelength, speed).smallest_stress
    least = np.floor(np.log10(np.nanmin(smallest)))
    levels = 10 ** (least + np.arange(_DECADES))
    # Next to the shortest resolved wave the contours are too close for labels of their own.
    areas = axes.contourf(
        wavelength / MM, speed / MM, smallest, levels, norm=LogNorm(), cmap="Blues", extend="max"
    )
    axes.figure.colorbar(areas, ax=axes, label=f"smallest stress, {SIGMAS:g} sigma (Pa)")
    if noise.corner:
        corner = noise.corner * wavelength / MM
        axes.plot(wavelength / MM, corner, color=FAILED, ls="--", label="drift rules below")
    if np.isfinite(seen.noise_band[1]):
        edges = np.outer(wavelength / MM, seen.noise_band)
        lines = axes.plot(wavelength / MM, edges, color=MUTED, ls="-.")
        lines[0].set_label("noise known between")
    places = np.meshgrid(seen.wavelength / MM, seen.speed / MM)
    axes.plot(*map(np.ravel, places), "o", color=MEASURED, ms=3)
    axes.set(yscale="log", ylim=speed[[0, -1]] / MM, ylabel="speed (mm/s)")
    axes.yaxis.set_major_formatter("{x:g}")


def _at(seen: Response, wavelength: FloatArray, speed: FloatArray | None = None) -> Response:
    """Return the response at other wavelengths and, where the noise is known, speeds."""
    heard = speed is not None
    return response(
        seen.apparatus,
        wavelength,
        speed,
        film=seen.film,
        friction=seen.friction,
        noise_record=seen.noise_record if heard else None,
        length=seen.length if heard else None,
    )
