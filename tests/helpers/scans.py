"""Scans of known truth: with a rod, with a sphere, with a tangential channel; and their steps."""

from dataclasses import fields, replace
from functools import lru_cache
from typing import Any
from unittest.mock import patch

import numpy as np
from helpers.builders import make_artifact
from scipy.special import i0e

import memscal
import memscal.extensions.simulation.contact_scan as contacts
from memscal import Contact, MeasuredStress, Process, RadialKernel, Scan, StressSensor
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.estimation.points import ScanPoints, calibration_points
from memscal.estimation.profile import ProfileEstimate, estimate_profile
from memscal.estimation.reference_spectra import reference_spectra
from memscal.extensions.simulation.rod_scan import PAPER_FILM, PAPER_ROD
from memscal.model.apparatus import ApparatusData, ApparatusRadial, ParameterSet, TransferFunction

CONVERSION = 1e-7
SIGMA = 561e-6
CENTRE = 0.14e-3
RING = memscal.GaussianMixture((1.3, -0.3), (0.6e-3, 0.3e-3))
TAILS = memscal.GaussianMixture((0.75, 0.25), (0.5e-3, 1.0e-3))

# Inputs without uncertainty and a law that is known, so that what is left in a budget is noise
# alone.
LINEAR_FILM = replace(PAPER_FILM, law="linear")
EXACT_FILM = replace(
    LINEAR_FILM,
    young_modulus_uncertainty=None,
    poisson_ratio_uncertainty=None,
    thickness_uncertainty=None,
)
EXACT_ROD = replace(PAPER_ROD, radius_uncertainty=None)
STILL = {"noise": 0.0, "baseline": 0.0, "drift": 0.0}


def in_record(options: dict[str, Any]) -> dict[str, Any]:
    """Put the disturbances among the options of a simulation into their record."""
    disturbances = {f.name for f in fields(memscal.Disturbances)} & options.keys()
    record = memscal.Disturbances(**{name: options.pop(name) for name in disturbances})
    return options | {"disturbances": record}


def simulate(**options) -> Scan:
    """Simulate a rod scan; options are those of the simulation and of its disturbances."""
    return memscal.simulate(**in_record(options))


def simulate_contacts(**options) -> Scan:
    """Simulate a scan of a sphere's contacts likewise."""
    return contacts.simulate_contacts(**in_record(options))


def simulate_experiment(**options) -> memscal.Experiment:
    """Simulate an experiment likewise."""
    return memscal.simulate_experiment(**in_record(options))


def simulated(branch=None, **options) -> Scan:
    """Simulate a scan whose film, rod and load are exact; its branches may be named."""
    exact = {"film": EXACT_FILM, "rod": EXACT_ROD, "load_uncertainty": None}
    return replace(simulate(**(exact | options)), branch=branch)


def estimated(scan: Scan, *, angular=False) -> ProfileEstimate:
    """Estimate the profile of a scan with the rod's own solution as reference."""
    points = calibration_points(scan)
    contact = memscal.indent(scan.film, scan.indenter, load=scan.load)
    return estimate_profile(points, reference_spectrum(contact, points), angular=angular)


def reference_spectrum(reference, points: ScanPoints, nodes=None) -> RadialSpectrum:
    """Transform of one scan's reference per newton."""
    return reference_spectra([reference], [points], nodes)[0]


def as_points(scan: Scan, seed=0) -> Scan:
    """Return the same readings as single points, in random order."""
    order = np.random.default_rng(seed).permutation(scan.u_zz.size)
    x, y = (positions.ravel()[order] for positions in scan.positions)
    along = y if scan.direction == "y" else x
    names = ("branch", "u_zz", "u_zz_errors", "normal_load", "normal_load_errors")
    values = {name: getattr(scan, name) for name in names if getattr(scan, name) is not None}
    if scan.x_errors is not None:
        values["x_errors"] = np.broadcast_to(scan.x_errors, scan.u_zz.shape)
    changes = {name: array.ravel()[order] for name, array in values.items()}
    changes |= {"x": along, "y": y} if scan.planar else {"x": along}
    return replace(scan, **changes, repeat=scan.passes.ravel()[order], channels={})


def with_outlier(scan: Scan, place, share) -> Scan:
    """Add a share of the largest reading to the reading at a place."""
    u = scan.u_zz.copy()
    u[place] += share * u.max()
    return replace(scan, u_zz=u)


def plane_error(r: np.ndarray, found: np.ndarray, truth: np.ndarray) -> float:
    """Relative L2 error over the plane, for a radial function on even radii."""
    return float(np.sqrt(np.sum(r * (found - truth) ** 2) / np.sum(r * truth**2)))


def added_ring(scan: Scan, share: float, radius: float, width: float) -> Scan:
    """Add a ring of this share of the largest voltage, with the transform J0(kq) exp(-(kb)^2/2).

    q is the radius and b the width, in m.
    """
    r = np.abs(scan.x - CENTRE)
    ring = np.exp(-(((r - radius) / width) ** 2) / 2) * i0e(r * radius / width**2)
    return replace(scan, u_zz=scan.u_zz + share * scan.u_zz.max() * ring / ring.max())


SPHERE = memscal.Sphere(radius=0.1288)
GAUSSIAN = memscal.GaussianMixture((1.0,), (SIGMA,))
SENSOR = StressSensor(name="a simulated sensor", channel="zz")


def pressed(load=1.0, friction=0.0, *, film=EXACT_FILM, indenter=SPHERE) -> Contact:
    """Press the paper's sphere on the film; the contact is remembered."""
    return memscal.indent(film, indenter, load=load, friction=friction)


def sphere_scan(contact: Contact, *, kernel: RadialKernel = GAUSSIAN, noise=0.005, seed=0) -> Scan:
    """Scan a contact: its base stress convolved by Hankel transforms, noise, offset and drift."""
    x = np.linspace(-8e-3, 8e-3, 33)
    nodes = Wavenumbers.covering(40 / contact.film.thickness, 24e-3)
    spectrum = contact.base_spectrum(nodes.k) * kernel.transform(nodes.k)
    signal = CONVERSION * nodes.synthesise(spectrum, np.abs(x - CENTRE))
    top = float(signal.max())
    rng = np.random.default_rng(seed)
    u = signal + top * (0.01 + 0.0025 * x / 8e-3 + rng.normal(0.0, noise, x.size))
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
    conversion_uncertainty=0.0,
    width_uncertainty=0.0,
) -> memscal.ApparatusFunction:
    """Return a sensor whose G is known, or wrong in one way only: wider or narrower.

    The uncertainties are relative.
    """
    r = np.linspace(0.0, 6e-3, 301)
    k = np.linspace(0.0, 12e3, 241)
    g = kernel.radial(r)
    spread = width_uncertainty * (2 * g + r * np.gradient(g, r))
    names = ("conversion_constant", "gaussian_sigma")
    values = np.array([CONVERSION, SIGMA])
    covariance = np.diag([(conversion_uncertainty * CONVERSION) ** 2, 0.0])
    contact = {"film": EXACT_FILM, "indenter": EXACT_ROD, "reference": pressed().profile()}
    empty = {"checks": (), "budget": {}, "process": Process(program="test", version="0", date="")}
    data = make_artifact(
        radial_profile=ApparatusRadial(r, g, np.abs(spread), g, np.outer(spread, spread)),
        transfer=TransferFunction(k, np.abs(kernel.transform(k)), 0 * k, 0 * k + 1, 5e3),
        parameters=ParameterSet(names, values, covariance),
        **(contact | empty | {"sensor": SENSOR}),
    )
    return as_function(data)


def as_function(data: ApparatusData) -> memscal.ApparatusFunction:
    """Return the apparatus function of what a file holds of it."""
    return memscal.ApparatusFunction(**{f.name: getattr(data, f.name) for f in fields(data)})


LOADS = (0.34, 0.69, 1.37, 2.75)


def contact_scan(seed=0, **options) -> Scan:
    """Scan contacts on an exactly known film, at exactly known nominal loads."""
    exact = {"film": EXACT_FILM, "sphere": SPHERE, "load": LOADS, "load_uncertainty": None}
    return simulate_contacts(seed=seed, **(exact | options))


@lru_cache
def measured(seed=0, conversion_uncertainty=0.0, **options) -> MeasuredStress:
    """Measure such a scan with a sensor whose G is known."""
    known = known_apparatus(conversion_uncertainty=conversion_uncertainty)
    return memscal.measure_stress(contact_scan(seed, **options), known)


SHEAR_CONVERSION = 5e-8
SHEAR_SIGMA = 400e-6
SHEAR_KERNEL = memscal.GaussianMixture(sigmas=(SHEAR_SIGMA,))


def shear_scan(*, kernel: RadialKernel = SHEAR_KERNEL, channel="xz", **options) -> Scan:
    """Simulate a rod scan whose tangential channel has a G and an A of its own."""
    settings = {"film": LINEAR_FILM, "centre": (CENTRE, 0.0)} | options
    scan = simulate(shear=(kernel, SHEAR_CONVERSION), **settings)
    channels = {name.replace("xz", channel): values for name, values in scan.channels.items()}
    return replace(scan, channels=channels, direction=channel[0])


def calibrated(scan: Scan, **options) -> memscal.Calibration:
    """Calibrate a scan, and spend no time on what explains the checks that it fails."""
    with patch("memscal.calibration.calibrate.explained", lambda _, checks: (checks, [])):
        return memscal.calibrate(scan, **options)
