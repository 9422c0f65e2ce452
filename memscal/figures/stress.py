"""Figures of measured stress, of restored stress, and of contacts."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from memscal.figures.style import (
    ALONG_RADIUS,
    COVERAGE_NOTE,
    DECONVOLVED,
    FAILED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    REFERENCE,
    SCATTER_THRESHOLD,
    along_radius,
    coverage,
    draw_band,
    draw_measured,
    draw_residual_band,
    draw_zero,
    entry_columns,
    legend_above,
    load_looks,
    mark,
    marker_size,
    panels_of,
    shades,
)
from memscal.measurement.restoration import Restoration
from memscal.mechanics.contact import Contact
from memscal.model.arrays import BoolArray, Values
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.quantities import KPA, MM

_DECADES = 1e-3


def measured_stress_figure(measured: MeasuredStress) -> Figure:
    """Draw the measured profiles of all loads against the distance from the centre."""
    # Dots of many points have no bars.
    profiles = measured.profiles
    many = min(profile.r.size for profile in profiles) > SCATTER_THRESHOLD
    with panels_of(3.6, 1, 2, "" if many else COVERAGE_NOTE) as (figure, panels):
        linear, logarithmic = panels
        looks = load_looks(profile.load for profile in profiles)
        for profile in profiles:
            colour, _ = looks[profile.load]
            clear = profile.s_zz > coverage() * profile.s_zz_errors
            _draw(linear, profile, colour, np.ones_like(clear))
            _draw(logarithmic, profile, colour, clear)
        for axes in panels:
            axes.set(xlabel=ALONG_RADIUS, ylabel="blurred stress $S_{zz}$ (kPa)")
            axes.set_xlim(left=0.0)
        linear.set_title("linear scale", fontsize=8, loc="left")
        draw_zero(linear)
        logarithmic.set_title(
            f"logarithmic scale; pale: less than {coverage():g}u", fontsize=8, loc="left"
        )
        top = max(profile.s_zz.max() for profile in profiles) / KPA
        logarithmic.set_yscale("log")
        logarithmic.set_ylim(_DECADES * top, 1.6 * top)
        logarithmic.yaxis.set_major_formatter("{x:g}")
        # Loads by colour and states by mark, once for both panels.
        handles = [
            Line2D([], [], color=colour, lw=2.0, label=name)
            for colour, name in dict.fromkeys(looks.values())
        ]
        for state in dict.fromkeys(profile.lubrication for profile in profiles):
            look = mark(state, "0.2")
            words = state or "measured"
            if many:
                look["marker"] = "."
            else:
                words += f", ±{coverage():g}u"
            dashes = "--" if state == "lubricated" else "-"
            handles.append(Line2D([], [], lw=0.8, ms=3.2, ls=dashes, label=words, **look))
        label = "contact radius, µ = 0"
        handles.append(Line2D([], [], color="0.2", marker="|", ms=6, ls="none", label=label))
        figure.legend(
            handles=handles, loc="outside upper center", ncols=entry_columns(len(handles))
        )
    return figure


def _draw(axes: Axes, profile: MeasuredProfile, colour: str, clear: BoolArray) -> None:
    """Draw a profile; points that are not clear of zero are pale, without bars."""
    dashes = "--" if profile.lubrication == "lubricated" else "-"
    curve = profile.curve_s_zz / KPA
    axes.plot(profile.curve_r / MM, curve, color=colour, lw=0.8, ls=dashes, alpha=0.7)
    look = mark(profile.lubrication, colour) | {
        "ls": "none",
        "mew": 0.7,
        "ms": 2.6,
        "many": profile.r.size > SCATTER_THRESHOLD,
        "elinewidth": 0.6,
    }
    r = profile.r / MM
    stress = profile.s_zz / KPA
    bars = coverage() * profile.s_zz_errors / KPA
    draw_measured(axes, r[clear], stress[clear], bars[clear], **look)
    if not clear.all():
        draw_measured(axes, r[~clear], stress[~clear], None, alpha=0.3, **look)
    axes.axvline(profile.contact_radius / MM, ymin=0.94, color=colour, lw=1.2, ls=dashes)


_LEAST_LIMIT = 3.5


def restoration_figure(restored: Restoration) -> Figure:
    """Draw the stress at the base as restored, as blurred by the sensor, and as calculated."""
    with panels_of(3.3, 1, 2, width_ratios=(1.6, 1)) as (figure, panels):
        _draw_stress(panels[0], restored)
        _draw_residuals(panels[1], restored)
    return figure


def _draw_stress(axes: Axes, restored: Restoration) -> None:
    r = restored.r / MM
    stress = restored.sigma_zz / KPA
    band = coverage() * np.sqrt(np.maximum(np.diag(restored.covariance), 0.0)) / KPA
    draw_band(axes, r, stress - band, stress + band)
    axes.plot(r, stress, color=DECONVOLVED, label=rf"restored $\sigma_{{zz}}$, ±{coverage():g}u")
    blurred = restored.blurred_stress(restored.r) / KPA
    axes.plot(r, blurred, color=GAUSSIAN, ls="-.", label=r"blurred again, $S_{zz} = G*\sigma_{zz}$")
    compared = restored.comparison
    if compared:
        label = "expected"
        if isinstance(compared.stress, Contact):
            friction = compared.stress.friction
            words = f"friction {friction:.3g}" if friction else "no friction"
            label = rf"calculated $\sigma_{{zz}}$, {words}"
        axes.plot(r, compared.sigma_zz / KPA, color=REFERENCE, ls="--", label=label)
    count = restored.points.u.size
    many = count > SCATTER_THRESHOLD
    (points,) = axes.plot(
        restored.distance / MM,
        restored.measured_stress / KPA,
        "o",
        color=MEASURED,
        mfc="none",
        mew=0.6,
        ms=1.2 if many else 0.8 * marker_size(count),
        label="scan, blurred stress $S_{zz} = U/A$",
        rasterized=many,
    )
    draw_zero(axes)
    axes.set_xlim(0, max(r[-1], restored.distance.max() / MM))
    axes.set_xlabel(ALONG_RADIUS)
    axes.set_ylabel(r"stress $\sigma_{zz}$ at the base, blurred stress $S_{zz}$ (kPa)")
    legend_above(axes, points=count, first=points)


def _draw_residuals(axes: Axes, restored: Restoration) -> None:
    """Draw residuals over their noise; those beyond the axis are drawn at its edge."""
    z = restored.residual / restored.noise
    limit = max(_LEAST_LIMIT, min(1.1 * abs(z).max(), 8.0))
    ordinary = abs(z) <= limit
    along = "x" if restored.points.free[0, 0] else "y"
    side = getattr(restored.points, along) / MM
    draw_residual_band(axes)
    size = marker_size(z.size)
    label = f"scan: rms {np.sqrt(np.mean(z**2)):.2f}"
    axes.plot(side[ordinary], z[ordinary], "o", color=MEASURED, ms=size, label=label)
    edge = 0.93 * limit * np.sign(z[~ordinary])
    axes.plot(side[~ordinary], edge, "^", color=FAILED, ms=4)
    axes.set_ylim(-limit, limit)
    axes.set(xlabel=f"position ${along}$ (mm)", ylabel="residual / $u$")
    legend_above(axes, columns=1)


_MICROMETRE = 1e-6
#: Radii at which a contact is drawn.
_RADII = 601
# A rod's pressure has no largest value: the axis ends at this multiple of its mean.
_SHOWN_MEANS = 3.0
# Contacts that the legend names one by one.
_NAMED = 6


def contact_figure(contact: Contact, *, beside: Sequence[Contact] = ()) -> Figure:
    """Draw pressure and shear of one contact or several; of several, load against depth, too."""
    contacts = [contact, *beside]
    with panels_of(2.9, 1, 3 if beside else 2, note="") as (figure, panels):
        colours = shades(len(contacts), 0.15)
        _draw_interface(panels[0], contacts, colours)
        _draw_base(panels[1], contacts, colours)
        if beside:
            axes = panels[2]
            depth = np.array([contact.depth for contact in contacts]) / _MICROMETRE
            load = [contact.load for contact in contacts]
            axes.plot(depth, load, color=MUTED, lw=0.8)
            axes.scatter(depth, load, c=colours, s=14, zorder=3)
            axes.set_ylim(bottom=0)
            axes.set_xlim(left=min(0.0, 1.05 * depth.min()))
            axes.set(xlabel="depth (µm)", ylabel="load (N)")
    return figure


def _draw_interface(axes: Axes, contacts: Sequence[Contact], colours: Sequence[str]) -> None:
    r = np.linspace(0.0, 1.15 * max(contact.contact_radius for contact in contacts), _RADII)
    highest = 0.0
    stick: Values = {"marker": "o", "ms": 3, "mfc": "none"}
    slipping = False
    for i, (contact, colour) in enumerate(zip(contacts, colours, strict=True)):
        pressure = contact.interface_pressure(r)
        label = f"{contact.load:.3g} N" if i < _NAMED else None
        axes.plot(r / MM, pressure / KPA, color=colour, label=label)
        if contact.friction > 0:
            axes.plot(r / MM, contact.interface_shear(r) / KPA, color=colour, ls="--")
        top = pressure.max()
        if not math.isfinite(contact.max_interface_stress):
            top = _SHOWN_MEANS * contact.load / (math.pi * contact.contact_radius**2)
        highest = max(highest, top)
        axes.plot(contact.contact_radius / MM, 0.0, marker="|", ms=8, mew=1.2, color=colour)
        if 0 < contact.stick_radius < contact.contact_radius:
            axes.plot(contact.stick_radius / MM, 0.0, color=colour, ls="none", **stick)
            slipping = True
    axes.set_ylim(top=1.08 * highest / KPA)
    axes.plot([], [], color="0.4", marker="|", ms=8, ls="none", label="contact radius")
    if slipping:
        axes.plot([], [], color="0.4", ls="none", label="stick radius", **stick)
    along_radius(axes, r, "stress at the interface (kPa)")
    legend_above(axes)


def _draw_base(axes: Axes, contacts: Sequence[Contact], colours: Sequence[str]) -> None:
    widest = max(contact.contact_radius for contact in contacts)
    r = np.linspace(0.0, widest + 3 * contacts[0].film.thickness, _RADII)
    for contact, colour in zip(contacts, colours, strict=True):
        axes.plot(r / MM, contact.base_stress(r) / KPA, color=colour)
        axes.plot(r / MM, contact.base_shear(r) / KPA, color=colour, ls="--")
    axes.plot([], [], color="0.4", label=r"normal, $\sigma_{zz}$")
    axes.plot([], [], color="0.4", ls="--", label=r"shear, outward, $\sigma_{rz}$")
    along_radius(axes, r, "stress at the base (kPa)")
    legend_above(axes, columns=1)
