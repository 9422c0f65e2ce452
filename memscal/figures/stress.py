"""Figures of measured stress, of restored stress, and of contacts."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from memscal.errors import InputError
from memscal.figures import style
from memscal.figures.style import COLOURS
from memscal.measurement.restoration import Restoration, StressComparison
from memscal.mechanics.contact import Contact
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.quantities import KPA, MM

_MEASURED_STRESS_EXPANDED = 1.96
_DECADES = 1e-3
#: Okabe and Ito's colours once more, one for each load, from the smallest up.
_LOADS = ("#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#0072B2", "#7B3F8C", "#6B6B6B")
_SAME_LOAD = 0.05


def measured_stress_figure(measured: MeasuredStress) -> Figure:
    """Draw the measured profiles of all loads against the distance from the centre."""
    with style.panels_of(3.6, 1, 2) as (figure, panels):
        scales = ("linear scale", "logarithmic scale, three decades")
        for axes, scale in zip(panels, scales, strict=True):
            axes.set_title(scale, fontsize=8, loc="left")
            for profile, colour in _coloured(measured):
                _draw(axes, profile, colour, logarithmic=axes is panels[1])
            axes.set_xlabel("distance from the centre (mm)")
            axes.set_ylabel(r"measured stress $S_{zz}$ (kPa)")
            axes.set_xlim(left=0.0)
        panels[0].axhline(0.0, color="0.8", lw=0.5, zorder=0)
        top = max(profile.s_zz.max() for profile in measured.profiles) / KPA
        panels[1].set_yscale("log")
        panels[1].set_ylim(_DECADES * top, 1.6 * top)
        panels[1].yaxis.set_major_formatter("{x:g}")
        _legend(figure, measured)
    return figure


def _coloured(measured: MeasuredStress) -> Iterator[tuple[MeasuredProfile, str]]:
    levels: list[float] = []
    for load in sorted(profile.load for profile in measured.profiles):
        if not levels or load > levels[-1] * (1 + _SAME_LOAD):
            levels.append(load)
    for profile in measured.profiles:
        level = int(np.argmin(np.abs(np.log(np.array(levels) / profile.load))))
        yield profile, _LOADS[level % len(_LOADS)]


def _draw(axes: Axes, profile: MeasuredProfile, colour: str, *, logarithmic: bool) -> None:
    """Draw a profile; if ``logarithmic``, points not distinct from zero are pale, without bars."""
    lubricated = profile.lubrication == "lubricated"
    (line,) = axes.plot(profile.curve_r / MM, profile.curve_s_zz / KPA, color=colour, lw=0.8)
    line.set(ls="--" if lubricated else "-", alpha=0.7)
    bars = _MEASURED_STRESS_EXPANDED * profile.s_zz_errors
    shown = profile.s_zz > bars if logarithmic else np.ones(profile.r.size, dtype=np.bool_)
    marker, face = ("s", "white") if lubricated else ("o", colour)
    look: dict[str, Any] = {"marker": marker, "ls": "none", "color": colour, "mew": 0.7}
    look |= {"ms": 2.6, "mfc": face}
    r, stress = profile.r / MM, profile.s_zz / KPA
    axes.errorbar(r[shown], stress[shown], yerr=bars[shown] / KPA, elinewidth=0.6, **look)
    if not shown.all():
        axes.plot(r[~shown], stress[~shown], alpha=0.3, **look)
    radius = profile.contact_radius / MM
    axes.axvline(radius, ymin=0.94, color=colour, lw=1.2, ls=":" if lubricated else "-")


def _legend(figure: Figure, measured: MeasuredStress) -> None:
    """Name loads by colour and states by mark, once for both panels."""
    handles, seen = [], set()
    for profile, colour in sorted(_coloured(measured), key=lambda pair: pair[0].load):
        if colour not in seen:
            seen.add(colour)
            handles.append(Line2D([], [], color=colour, lw=2.0, label=f"{profile.load:.3g} N"))
    for state in dict.fromkeys(profile.lubrication for profile in measured.profiles):
        marker, face, ls = ("s", "white", "--") if state == "lubricated" else ("o", "0.2", "-")
        handle = Line2D([], [], color="0.2", lw=0.8, marker=marker, ms=3.2, mfc=face, ls=ls)
        handle.set_label(f"{state or 'measured'}, ±1.96u")
        handles.append(handle)
    radius = Line2D([], [], color="0.2", marker="|", ms=6, ls="none", label="contact radius, µ = 0")
    handles.append(radius)
    figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 7))


_RESTORATION_EXPANDED = 2.0
_LEAST_LIMIT = 3.5


def restoration_figure(restored: Restoration, compared: StressComparison | None = None) -> Figure:
    """Draw the stress at the base as restored, as blurred by the sensor, and as calculated."""
    compared = restored.comparison if compared is None else compared
    with style.panels_of(3.3, 1, 2, width_ratios=(1.6, 1)) as (figure, panels):
        _draw_stress(panels[0], restored, compared)
        _draw_residuals(panels[1], restored)
    return figure


def _draw_stress(axes: Axes, restored: Restoration, compared: StressComparison | None) -> None:
    r = restored.r / MM
    stress = restored.sigma_zz / KPA
    band = _RESTORATION_EXPANDED * np.sqrt(np.maximum(np.diag(restored.covariance), 0.0)) / KPA
    blue = COLOURS["deconvolved"]
    axes.fill_between(r, stress - band, stress + band, color=blue, alpha=0.25, lw=0)
    axes.plot(r, stress, color=blue, label=r"restored $\sigma_{zz}$, ±2u")
    blurred = restored.blurred_stress(restored.r) / KPA
    axes.plot(r, blurred, color=COLOURS["gaussian"], ls="-.", label=r"blurred again, $G*\sigma$")
    if compared is not None:
        label = "expected"
        if isinstance(compared.stress, Contact):
            friction = compared.stress.friction
            label = f"calculated, {f'friction {friction:.3g}' if friction else 'no friction'}"
        axes.plot(r, compared.sigma_zz / KPA, color=COLOURS["reference"], ls="--", label=label)
    many = restored.points.u.size > style.SCATTER_THRESHOLD
    size = 1.2 if many else 0.8 * style.marker_size(restored.points.u.size)
    (points,) = axes.plot(restored.distance / MM, restored.measured_stress / KPA, "o")
    points.set(color=COLOURS["measured"], ms=size, mfc="none", mew=0.6)
    points.set(label="scan, $S_{zz} = U/A$", rasterized=many)
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
    axes.set_xlim(0, max(r[-1], float(restored.distance.max()) / MM))
    axes.set_xlabel("distance from the centre (mm)")
    axes.set_ylabel("stress at the base (kPa)", labelpad=8)
    style.legend_above(axes, columns=2, points=restored.points.u.size)


def _draw_residuals(axes: Axes, restored: Restoration) -> None:
    """Draw residuals over their noise; those beyond the axis are drawn at its edge."""
    z = restored.residual / restored.noise
    limit = max(_LEAST_LIMIT, min(1.1 * float(np.abs(z).max()), 8.0))
    ordinary = np.abs(z) <= limit
    side = np.where(restored.points.free[0, 0], restored.points.x, restored.points.y) / MM
    axes.axhspan(-_RESTORATION_EXPANDED, _RESTORATION_EXPANDED, color="0.92", lw=0)
    axes.axhline(0.0, color="0.4", lw=0.6)
    size = style.marker_size(z.size)
    label = f"scan: rms {float(np.sqrt(np.mean(z**2))):.2f}"
    axes.plot(side[ordinary], z[ordinary], "o", color=COLOURS["measured"], ms=size, label=label)
    edge = 0.93 * limit * np.sign(z[~ordinary])
    axes.plot(side[~ordinary], edge, "^", color=COLOURS["failed"], ms=4, label="_beyond the axis")
    axes.set_ylim(-limit, limit)
    axes.set(xlabel="position (mm)", ylabel="residual / $u$")
    style.legend_above(axes, columns=1)


_MICROMETRE = 1e-6
#: Radii at which a contact is drawn.
_RADII = 601
# A rod's pressure has no largest value: the axis ends at this multiple of its mean.
_SHOWN_MEANS = 3.0
# Contacts that the legend names one by one.
_NAMED = 6


def contact_figure(contacts: Contact | Sequence[Contact]) -> Figure:
    """Draw pressure and shear of one contact or several; of several, load against depth, too."""
    if isinstance(contacts, Contact):
        contacts = [contacts]
    if not contacts:
        raise InputError("There is no contact to draw.")
    several = len(contacts) > 1
    with style.panels_of(2.9, 1, 3 if several else 2) as (figure, panels):
        colours = style.shades(len(contacts), 0.15)
        _draw_interface(panels[0], contacts, colours)
        _draw_base(panels[1], contacts, colours)
        if several:
            depth = np.array([contact.depth for contact in contacts]) / _MICROMETRE
            load = [contact.load for contact in contacts]
            panels[2].plot(depth, load, color=COLOURS["muted"], lw=0.8)
            panels[2].scatter(depth, load, c=list(colours), s=14, zorder=3)
            panels[2].set_ylim(bottom=0)
            panels[2].set_xlim(left=min(0.0, 1.05 * float(depth.min())))
            panels[2].set(xlabel="depth (um)", ylabel="load (N)")
    return figure


def _draw_interface(axes: Axes, contacts: Sequence[Contact], colours: Sequence[str]) -> None:
    r = np.linspace(0.0, 1.15 * max(contact.contact_radius for contact in contacts), _RADII)
    highest = 0.0
    for i, (contact, colour) in enumerate(zip(contacts, colours, strict=True)):
        pressure = contact.interface_pressure(r)
        label = f"{contact.load:.3g} N" if i < _NAMED else None
        axes.plot(r / MM, pressure / KPA, color=colour, label=label)
        if contact.friction > 0:
            axes.plot(r / MM, contact.interface_shear(r) / KPA, color=colour, ls="--")
        top = float(pressure.max())
        if not math.isfinite(contact.max_interface_stress):
            top = _SHOWN_MEANS * contact.load / (math.pi * contact.contact_radius**2)
        highest = max(highest, top)
        axes.plot(contact.contact_radius / MM, 0.0, marker="|", ms=8, mew=1.2, color=colour)
        if 0 < contact.stick_radius < contact.contact_radius:
            axes.plot(contact.stick_radius / MM, 0.0, "o", ms=3, mfc="none", color=colour)
    axes.set_ylim(top=1.08 * highest / KPA)
    axes.plot([], [], color="0.4", marker="|", ms=8, ls="none", label="contact radius")
    if any(0 < contact.stick_radius < contact.contact_radius for contact in contacts):
        label = "stick radius"
        axes.plot([], [], color="0.4", marker="o", ms=3, mfc="none", ls="none", label=label)
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
    axes.set(xlim=(0, r[-1] / MM), xlabel="radius (mm)", ylabel="at the interface (kPa)")
    style.legend_above(axes, columns=2)


def _draw_base(axes: Axes, contacts: Sequence[Contact], colours: Sequence[str]) -> None:
    widest = max(contact.contact_radius for contact in contacts)
    r = np.linspace(0.0, widest + 3 * contacts[0].film.thickness, _RADII)
    for contact, colour in zip(contacts, colours, strict=True):
        axes.plot(r / MM, contact.base_stress(r) / KPA, color=colour)
        axes.plot(r / MM, contact.base_shear(r) / KPA, color=colour, ls="--")
    axes.plot([], [], color="0.4", label="pressure")
    axes.plot([], [], color="0.4", ls="--", label="shear, outward")
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
    axes.set(xlim=(0, r[-1] / MM), xlabel="radius (mm)", ylabel="at the base (kPa)")
    style.legend_above(axes, columns=1)
