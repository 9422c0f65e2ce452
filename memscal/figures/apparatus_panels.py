"""The panels that show the apparatus function, in space and in wavenumbers."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from memscal.estimation.channels import TANGENTIAL
from memscal.figures.style import COLOURS, legend_above
from memscal.model.apparatus import ApparatusData, ApparatusRadial
from memscal.model.quantities import MM, PER_MM, PER_MM2
from memscal.model.validation import FloatArray

__all__ = ["channel_indices", "draw_radial", "draw_radial_log", "draw_transfer"]

_EXPANDED = 2.0
_LOG_DECADES = 4.0


def draw_radial(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r) with its expanded uncertainty (k = 2) and the Gaussian, linear."""
    radial = data.radial_profile
    axes.axhline(0.0, color="0.4", lw=0.6)
    _draw_band(axes, radial, floor=-np.inf)
    _draw_profiles(axes, radial.r, radial.g, radial.g_gaussian)
    low, high = (
        radial.g - _EXPANDED * radial.g_errors,
        radial.g + _EXPANDED * radial.g_errors,
    )
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    # An honest band may dwarf G; G must stay legible in it.
    top = min(_largest(high), 3 * peak)
    bottom = -min(_largest(-low, floor=0.0), 1.5 * peak)
    axes.set_ylim((bottom - 0.06 * top) / PER_MM2, 1.06 * top / PER_MM2)
    axes.set_xlim(0.0, _shown_radius(radial) / MM)
    axes.set_ylabel(f"$G_{{{channel_indices(data)}}}$ (1/mm$^2$)")
    legend_above(axes)


def draw_radial_log(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r) on a logarithmic axis; where G is not positive, only the band is drawn."""
    radial = data.radial_profile
    axes.set_yscale("log")
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    inside = radial.r <= _shown_radius(radial)
    smallest = np.min(np.maximum(radial.g_gaussian[inside], 10**-_LOG_DECADES * peak))
    floor = max(0.3 * float(smallest), 10**-_LOG_DECADES * peak)
    _draw_band(axes, radial, floor=floor)
    _draw_profiles(
        axes,
        radial.r,
        np.where(radial.g > 0, radial.g, np.nan),
        np.where(radial.g_gaussian > 0, radial.g_gaussian, np.nan),
    )
    axes.set_ylim(floor / PER_MM2, 3 * peak / PER_MM2)
    axes.set_xlim(0.0, _shown_radius(radial) / MM)
    axes.set_xlabel("distance from the axis $r$ (mm)")
    axes.set_ylabel(f"$G_{{{channel_indices(data)}}}$ (1/mm$^2$)")


def draw_transfer(axes: Axes, data: ApparatusData) -> None:
    """Draw the transfer function's modulus, the window, and where the scan stops speaking."""
    transfer = data.transfer
    k, limit = transfer.k / PER_MM, transfer.resolved_wavenumber / PER_MM
    end = _shown_wavenumber(k, limit)
    shown = k <= end
    band = _EXPANDED * transfer.modulus_errors
    blue = COLOURS["deconvolved"]
    axes.fill_between(
        k,
        np.maximum(transfer.modulus - band, 0.0),
        transfer.modulus + band,
        color=blue,
        alpha=0.25,
        lw=0,
        label="±2u (k = 2)",
    )
    axes.plot(k, transfer.modulus, "-", color=blue, label="modulus for G")
    sigma = data.gaussian_sigma
    gaussian = np.exp(-0.5 * (sigma * transfer.k) ** 2)
    axes.plot(k, gaussian, "--", color=COLOURS["gaussian"], label="Gaussian")
    axes.plot(k, transfer.window, ":", color=COLOURS["window"], label="window")
    _shade_unresolved(axes, limit, end)
    top = max(1.1, min(1.1 * _largest(transfer.modulus[shown]), 3.0))
    axes.set(xlim=(0.0, end), ylim=(0.0, top))
    axes.set_xlabel("wavenumber $k$ (rad/mm)")
    axes.set_ylabel("transfer function (1)")
    legend_above(axes)


def _draw_band(axes: Axes, radial: ApparatusRadial, *, floor: float) -> None:
    spread = _EXPANDED * radial.g_errors
    axes.fill_between(
        radial.r / MM,
        np.maximum(radial.g - spread, floor) / PER_MM2,
        np.maximum(radial.g + spread, floor) / PER_MM2,
        color=COLOURS["deconvolved"],
        alpha=0.25,
        lw=0,
        label="±2u (k = 2)",
    )


def _draw_profiles(axes: Axes, r: FloatArray, g: FloatArray, gaussian: FloatArray) -> None:
    axes.plot(r / MM, g / PER_MM2, "-", color=COLOURS["deconvolved"], label="deconvolved G")
    axes.plot(
        r / MM,
        gaussian / PER_MM2,
        "--",
        color=COLOURS["gaussian"],
        label="Gaussian fit",
    )


def _shade_unresolved(axes: Axes, limit: float, end: float) -> None:
    if not (np.isfinite(limit) and limit < end):
        return
    axes.axvspan(0.0, limit, color=COLOURS["reference"], alpha=0.10, lw=0, label="_resolved")
    axes.axvspan(
        limit,
        end,
        facecolor="0.95",
        edgecolor="0.75",
        hatch="////",
        lw=0,
        zorder=0,
        label="extrapolated",
    )
    axes.axvline(limit, color="0.25", lw=0.8, label=f"resolved to {limit:.3g} rad/mm")


def _shown_radius(radial: ApparatusRadial) -> float:
    """Return the radius to draw up to: where G, or its Gaussian, has died away."""
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    alive = np.flatnonzero(np.maximum(np.abs(radial.g), radial.g_gaussian) > 1e-3 * peak)
    gaussian_alive = np.flatnonzero(radial.g_gaussian > 1e-3 * peak)
    if not alive.size or not gaussian_alive.size:
        return float(radial.r[-1])
    # Ripples of a poor deconvolution reach far; the Gaussian says where the sensor ends.
    far = min(radial.r[alive[-1]], 1.6 * radial.r[gaussian_alive[-1]])
    return float(min(1.1 * far, radial.r[-1])) or float(radial.r[-1])


def _shown_wavenumber(k: FloatArray, limit: float) -> float:
    end = float(k[-1])
    if np.isfinite(limit) and limit > 0:
        end = min(end, 2.0 * limit)
    return end


def _largest(values: FloatArray, floor: float = 1e-300) -> float:
    finite = values[np.isfinite(values)]
    return max(float(np.max(finite)), floor) if finite.size else floor


def channel_indices(data: ApparatusData) -> str:
    """Return the indices of the stress that a sensor's channel measures: zz, xz or yz."""
    return data.sensor.channel if data.sensor.channel in TANGENTIAL else "zz"
