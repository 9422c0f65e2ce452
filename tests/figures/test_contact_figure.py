"""The figure of contacts: what is drawn is what was solved."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.lines import Line2D

from memscal.errors import InputError
from memscal.figures.stress import contact_figure
from memscal.figures.style import render_figure
from memscal.mechanics.indent import indent
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, Sphere

FILM = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
SPHERE = Sphere(radius=128.8e-3)


def curve(axes, color: str, style: str) -> Line2D:
    (found,) = (
        line
        for line in axes.lines
        if line.get_color() == color and line.get_linestyle() == style and len(line.get_xdata()) > 9
    )
    return found


def test_one_contact_shows_its_tractions_and_its_base() -> None:
    contact = indent(FILM, SPHERE, load=1.0, friction=0.2)
    figure = contact_figure([contact])
    interface, base = figure.axes
    colour = interface.lines[0].get_color()
    pressure = curve(interface, colour, "-")
    r = np.asarray(pressure.get_xdata()) * 1e-3
    np.testing.assert_allclose(pressure.get_ydata(), contact.interface_pressure(r) * 1e-3)
    shear = curve(interface, colour, "--")
    np.testing.assert_allclose(shear.get_ydata(), contact.interface_shear(r) * 1e-3)
    normal = curve(base, colour, "-")
    r = np.asarray(normal.get_xdata()) * 1e-3
    np.testing.assert_allclose(normal.get_ydata(), contact.base_stress(r) * 1e-3)
    places = {float(np.atleast_1d(line.get_xdata())[0]) for line in interface.lines if
              np.size(line.get_xdata()) == 1}  # fmt: skip
    assert places >= {contact.contact_radius * 1e3, contact.stick_radius * 1e3}


def test_several_contacts_show_load_against_depth() -> None:
    contacts = indent(FILM, SPHERE, load=[0.5, 1.0, 2.0])
    figure = contact_figure(contacts)
    loading = figure.axes[2]
    points = loading.collections[0].get_offsets()
    np.testing.assert_allclose(points, [[c.depth * 1e6, c.load] for c in contacts])
    named = {text.get_text() for text in figure.axes[0].get_legend().get_texts()}
    assert {"0.5 N", "1 N", "2 N", "contact radius"} <= named


def test_a_rod_s_unbounded_pressure_does_not_hide_the_rest() -> None:
    contact = indent(FILM, Rod(radius=0.25e-3), load=1.0, friction=math.inf)
    figure = contact_figure([contact])
    mean = 1.0 / (math.pi * 0.25e-3**2) * 1e-3
    assert mean < figure.axes[0].get_ylim()[1] < 5 * mean
    assert render_figure(figure, "png").startswith(b"\x89PNG")


def test_no_contact_is_no_figure() -> None:
    with pytest.raises(InputError, match="no contact"):
        contact_figure([])
