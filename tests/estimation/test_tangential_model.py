"""The forward model of a tangential channel, against a 2-D convolution that knows no transform."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import LINEAR_FILM, shear_scan

import memscal
from memscal import GaussianMixture
from memscal.errors import InputError
from memscal.estimation.forward import ForwardModel
from memscal.estimation.points import ScanPoints, measured_points
from memscal.estimation.reference_spectra import reference_spectra
from memscal.extensions.simulation.rod_scan import PAPER_ROD

KERNEL = GaussianMixture((1.4, -0.4), (450e-6, 250e-6))


def planar_points(x, y, channel):
    """Points anywhere on the plane, at a load of 2 N."""
    n = x.size
    return ScanPoints(
        x=x,
        y=y,
        u=np.zeros(n),
        load=np.full(n, 2.0),
        u_errors=None,
        x_errors=np.zeros(n),
        repeat=np.zeros(n, np.intp),
        owner=np.zeros(n, np.intp),
        anew=np.zeros(n, np.bool_),
        branch=np.zeros(n, np.int64),
        scan=np.zeros(n, np.intp),
        free=np.array([[True, True]]),
        averaging=np.zeros((1, 2)),
        velocity=np.zeros(x.size),
        missing=0,
        channel=channel,
    )


def model_at(x, y, channel="xz"):
    scan = memscal.simulate()
    contact = memscal.indent(scan.film, scan.indenter, load=1.0, strain="linear")
    points = planar_points(x, y, channel)
    return ForwardModel(points, reference_spectra([contact], [points]))


@pytest.mark.parametrize("channel", ["xz", "yz"])
def test_the_signal_is_the_plain_sum_of_traction_times_sensitivity_over_the_sensor(channel):
    # The film's traction on every element of the base, weighed by G: in Cartesian coordinates,
    # with the indenter at (x, y) and the sensor at the centre.
    contact = memscal.indent(LINEAR_FILM, PAPER_ROD, load=2.0)
    rng = np.random.default_rng()
    x, y = rng.uniform(-4e-3, 4e-3, (2, 6))
    x0, y0 = rng.uniform(-0.5e-3, 0.5e-3, 2)
    axis = np.linspace(-3e-3, 3e-3, 241)
    cell = (axis[1] - axis[0]) ** 2
    sx, sy = np.meshgrid(axis, axis)
    sensitivity = KERNEL.radial(np.hypot(sx, sy)) * cell
    table_r = np.linspace(0.0, 15e-3, 3001)
    table = contact.base_shear(table_r)
    expected = []
    for px, py in zip(x, y, strict=True):
        from_indenter = x0 + sx - px, y0 + sy - py
        r = np.hypot(*from_indenter)
        on_film = np.interp(r, table_r, table) / r  # radial traction of the base on the film
        component = from_indenter[0 if channel == "xz" else 1]
        expected.append(np.sum(sensitivity * -on_film * component))  # of the film on the base
    model = model_at(x, y, channel)
    found = model.signal(model.geometry(np.array([[x0, y0]])), KERNEL.transform(model.k))
    np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(contact.base_shear(1e-3)))


def test_derivatives_by_centre_and_distance_are_those_of_the_signal():
    rng = np.random.default_rng()
    # One point exactly at the centre, where a shear changes fastest.
    centre = np.array([[0.2e-3, -0.1e-3]])
    x = np.append(rng.uniform(-4e-3, 4e-3, 7), centre[0, 0])
    y = np.append(rng.uniform(-4e-3, 4e-3, 7), centre[0, 1])
    model = model_at(x, y)
    kernel = KERNEL.transform(model.k)

    def signal(at):
        return model.signal(model.geometry(at), kernel)

    step = 1e-7
    found = model.by_free_centres(model.shift_derivative(model.geometry(centre), kernel))
    for axis in range(2):
        shift = step * np.eye(2)[axis]
        expected = (signal(centre + shift) - signal(centre - shift)) / (2 * step)
        np.testing.assert_allclose(found[:, axis], expected, atol=1e-5 * np.abs(found).max())
    # Away from the centre along the way to it: every distance grows in proportion to itself.
    slope = model.radial_derivative(model.geometry(centre), kernel) * model.geometry(centre).radius
    scaled = [
        replace(
            model,
            points=replace(
                model.points,
                x=centre[0, 0] + s * (x - centre[0, 0]),
                y=centre[0, 1] + s * (y - centre[0, 1]),
            ),
        )
        for s in (1 + 1e-4, 1 - 1e-4)
    ]
    wide, narrow = (m.signal(m.geometry(centre), kernel) for m in scaled)
    np.testing.assert_allclose(slope, (wide - narrow) / 2e-4, atol=1e-5 * np.abs(slope).max())


def test_a_reference_whose_shear_has_the_other_sign_is_refused():
    scan = shear_scan(seed=1)
    profile = memscal.indent(scan.film, scan.indenter, load=1.0, strain="linear").profile()
    points = [measured_points(scan, "xz")]

    wrong = replace(profile, sigma_rz=-profile.sigma_rz)
    with pytest.raises(InputError, match="outward") as refusal:
        reference_spectra([wrong], points)
    assert "--shear-sign -1" in refusal.value.cure
