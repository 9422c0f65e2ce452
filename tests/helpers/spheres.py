"""Synthetic scans with a sphere through a known apparatus function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from helpers.scans import CONVERSION, EXACT_FILM, SIGMA

import memscal
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.axisymmetry.kernels import RadialKernel
from memscal.model.apparatus import (
    ApparatusField,
    ApparatusRadial,
    ParameterSet,
    Reconvolution,
    TransferFunction,
)
from memscal.model.provenance import Process
from memscal.model.scan import Scan, StressSensor

SPHERE = memscal.Sphere(radius=0.1288)
GAUSSIAN = memscal.GaussianMixture((1.0,), (SIGMA,))
SENSOR = StressSensor(name="a simulated sensor", channel="zz")


def pressed(
    load: float = 1.0,
    friction: float = 0.0,
    *,
    film: memscal.ElasticFilm = EXACT_FILM,
    indenter: memscal.Rod | memscal.Sphere = SPHERE,
) -> memscal.Contact:
    """Press the paper's sphere on the film; the contact is remembered."""
    contact = memscal.indent(film, indenter, load=load, friction=friction)
    assert isinstance(contact, memscal.Contact)
    return contact


def sphere_scan(
    contact: memscal.Contact,
    *,
    kernel: RadialKernel = GAUSSIAN,
    noise: float = 0.005,
    seed: int = 0,
    centre: float = 0.14e-3,
    half_range: float = 8e-3,
    points: int = 33,
) -> Scan:
    """Scan a contact: its base stress convolved by Hankel transforms, noise, offset and drift."""
    x = np.linspace(-half_range, half_range, points)
    nodes = Wavenumbers.covering(40 / contact.film.thickness, 3 * half_range)
    spectrum = contact.base_spectrum(nodes.k) * kernel.transform(nodes.k)
    signal = CONVERSION * nodes.synthesise(spectrum, np.abs(x - centre))
    top = float(signal.max())
    rng = np.random.default_rng(seed)
    u = signal + top * (0.01 + 0.0025 * x / half_range + rng.normal(0.0, noise, x.size))
    assert isinstance(contact.indenter, memscal.Sphere | memscal.Rod)
    return Scan(
        x=x,
        u_zz=u,
        u_zz_errors=np.full(x.size, noise * top) if noise > 0 else None,
        load=contact.load,
        indenter=contact.indenter,
        film=contact.film,
        sensor=SENSOR,
    )


def known_apparatus(
    kernel: RadialKernel = GAUSSIAN,
    *,
    conversion_uncertainty: float = 0.0,
    width_uncertainty: float = 0.0,
    conversion: float = CONVERSION,
) -> memscal.ApparatusFunction:
    """Return a sensor whose G is known, or wrong in one way only: wider or narrower.

    The uncertainties are relative.
    """
    r = np.linspace(0.0, 6e-3, 301)
    g = kernel.radial(r)
    spread = width_uncertainty * (2 * g + r * np.gradient(g, r))
    k = np.linspace(0.0, 12e3, 241)
    plane = np.zeros((3, 3))
    line = np.linspace(-1e-3, 1e-3, 3)
    zeros = np.zeros(3)
    scan = memscal.simulate(points=33)
    return memscal.ApparatusFunction(
        field=ApparatusField(line, line, plane, plane),
        radial_profile=ApparatusRadial(r, g, np.abs(spread), g, np.outer(spread, spread)),
        transfer=TransferFunction(k, np.abs(kernel.transform(k)), 0 * k, 0 * k + 1, 5e3),
        reconvolution=Reconvolution(line, zeros, zeros + 1, zeros, zeros, zeros),
        parameters=ParameterSet(
            ("conversion_constant", "gaussian_sigma"),
            np.array([conversion, SIGMA]),
            np.diag([(conversion_uncertainty * conversion) ** 2, 0.0]),
        ),
        checks=(),
        film=EXACT_FILM,
        indenter=replace(scan.indenter, radius_uncertainty=None),
        sensor=SENSOR,
        load=1.0,
        reference=pressed().profile(),
        process=Process(program="test", version="0", date=""),
        budget={},
    )
