"""Figure of contacts: tractions at the interface, stress at the base, load against depth."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.errors import InputError
from memscal.figures.style import COLOURS, house_style, legend_above, new_figure, panel_letter
from memscal.mechanics.contact import Contact
from memscal.model.arrays import FloatArray
from memscal.model.quantities import MM

__all__ = ["contact_figure"]

_KPA, _UM = 1e3, 1e-6
_POINTS = 601
# A rod's pressure has no largest value: the axis ends at this multiple of its mean.
_SHOWN_MEANS = 3.0
# Contacts that the legend names one by one.
_NAMED = 6


def contact_figure(contacts: Contact | Sequence[Contact]) -> Figure:
    """Draw one contact, or several such as the states of a loading.

    Panel a, pressure and shear at the interface; b, the same at the base; with several contacts,
    c, load against depth.
    """
    if isinstance(contacts, Contact):
        contacts = [contacts]
    if not contacts:
        raise InputError("There is no contact to draw.")
    several = len(contacts) > 1
    with house_style():
        figure = new_figure(2.9)
        panels = figure.subplots(1, 3 if several else 2)
        colours = _colours(len(contacts))
        _draw_interface(panels[0], contacts, colours)
        _draw_base(panels[1], contacts, colours)
        if several:
            _draw_loading(panels[2], contacts, colours)
        for axes, letter in zip(panels, "abc", strict=False):
            panel_letter(axes, letter)
    return figure


def _colours(count: int) -> list[str]:
    """Return colours that get darker along the path, also in grey."""
    import matplotlib as mpl

    if count == 1:
        return [COLOURS["deconvolved"]]
    shades = mpl.colormaps["viridis_r"](np.linspace(0.15, 1.0, count))
    return [mpl.colors.to_hex(shade) for shade in shades]


def _draw_interface(axes: Axes, contacts: Sequence[Contact], colours: Sequence[str]) -> None:
    widest = max(contact.contact_radius for contact in contacts)
    r = np.linspace(0.0, 1.15 * widest, _POINTS)
    highest = 0.0
    for i, (contact, colour) in enumerate(zip(contacts, colours, strict=True)):
        pressure = contact.interface_pressure(r)
        label = f"{contact.load:.3g} N" if i < _NAMED else None
        axes.plot(r / MM, pressure / _KPA, color=colour, label=label)
        if contact.friction > 0:
            axes.plot(r / MM, contact.interface_shear(r) / _KPA, color=colour, ls="--")
        highest = max(highest, _shown_pressure(contact, pressure))
        _mark_radii(axes, contact, colour)
    axes.set_ylim(top=1.08 * highest / _KPA)
    axes.plot([], [], color="0.4", marker="|", ms=8, ls="none", label="contact radius")
    if any(0 < contact.stick_radius < contact.contact_radius for contact in contacts):
        label = "stick radius"
        axes.plot([], [], color="0.4", marker="o", ms=3, mfc="none", ls="none", label=label)
    axes.set_xlim(0, r[-1] / MM)
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
    axes.set(xlabel="radius (mm)", ylabel="at the interface (kPa)")
    legend_above(axes, columns=2)


def _shown_pressure(contact: Contact, pressure: FloatArray) -> float:
    if math.isfinite(contact.max_interface_stress):
        return float(pressure.max())
    return _SHOWN_MEANS * contact.load / (math.pi * contact.contact_radius**2)


def _mark_radii(axes: Axes, contact: Contact, colour: str) -> None:
    """Mark the contact radius, and the radius within which the film sticks."""
    axes.plot(contact.contact_radius / MM, 0.0, marker="|", ms=8, mew=1.2, color=colour)
    if 0 < contact.stick_radius < contact.contact_radius:
        axes.plot(contact.stick_radius / MM, 0.0, marker="o", ms=3, mfc="none", color=colour)


def _draw_base(axes: Axes, contacts: Sequence[Contact], colours: Sequence[str]) -> None:
    widest = max(contact.contact_radius for contact in contacts)
    r = np.linspace(0.0, widest + 3 * contacts[0].film.thickness, _POINTS)
    for contact, colour in zip(contacts, colours, strict=True):
        axes.plot(r / MM, contact.base_stress(r) / _KPA, color=colour)
        axes.plot(r / MM, contact.base_shear(r) / _KPA, color=colour, ls="--")
    axes.plot([], [], color="0.4", label="pressure")
    axes.plot([], [], color="0.4", ls="--", label="shear, outward")
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
    axes.set_xlim(0, r[-1] / MM)
    axes.set(xlabel="radius (mm)", ylabel="at the base (kPa)")
    legend_above(axes, columns=1)


def _draw_loading(axes: Axes, contacts: Sequence[Contact], colours: Sequence[str]) -> None:
    depth = np.array([contact.depth for contact in contacts]) / _UM
    load = np.array([contact.load for contact in contacts])
    axes.plot(depth, load, color=COLOURS["muted"], lw=0.8)
    axes.scatter(depth, load, c=list(colours), s=14, zorder=3)
    axes.set_ylim(bottom=0)
    axes.set_xlim(left=min(0.0, 1.05 * float(depth.min())))
    axes.set(xlabel="depth (um)", ylabel="load (N)")
