"""The figures of contacts and of designs: what is drawn is what was calculated."""

import numpy as np
import pytest
from helpers.paper import FILM, SPHERE

import memscal
from memscal import indent
from memscal.errors import InputError
from memscal.extensions.planning.figure import design_figure
from memscal.figures.stress import contact_figure


def curve(axes, color, style):
    (found,) = (
        line
        for line in axes.lines
        if line.get_color() == color and line.get_linestyle() == style and len(line.get_xdata()) > 9
    )
    return found


def test_one_contact_shows_its_tractions_and_its_base():
    contact = indent(FILM, SPHERE, load=1.0, friction=0.2)
    figure = contact_figure(contact)
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
    places = {
        float(np.atleast_1d(line.get_xdata())[0])
        for line in interface.lines
        if np.size(line.get_xdata()) == 1
    }
    assert places >= {contact.contact_radius * 1e3, contact.stick_radius * 1e3}


@pytest.fixture(scope="module")
def planned():
    return memscal.design(step=0.5e-3, repeats=2)


def test_curves_are_the_designs_own(planned):
    radial, transfer, varied = design_figure(planned, vary="repeats").axes
    (g,) = (line for line in radial.lines if line.get_label() == "G expected")
    shown = planned.r <= g.get_xdata()[-1] * 1e-3
    drawn = np.interp(planned.r[shown] * 1e3, *g.get_data())
    np.testing.assert_allclose(drawn, planned.g[shown] * 1e-6, atol=1e-4 * drawn.max())
    (band,) = (line for line in transfer.lines if line.get_label() == "resolved")
    assert band.get_xdata()[0] == pytest.approx(planned.resolved_wavenumber * 1e-3)
    (a,) = (line for line in varied.lines if line.get_label() == "A")
    here = list(a.get_xdata()).index(2)
    assert a.get_ydata()[here] == pytest.approx(
        200 * planned.relative_uncertainty("conversion_constant")
    )


def test_what_cannot_be_varied_is_refused(planned):
    with pytest.raises(InputError, match="'weather'"):
        design_figure(planned, vary="weather")
