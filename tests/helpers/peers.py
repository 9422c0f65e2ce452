"""Other programs that find G from a scan: what each can do at its best, by one signature.

A peer takes a scan along a line and the truth, and returns G at :data:`RADII`, of unit integral
over the plane.  Of the truth every peer is given centre, baseline and drift, which our own
estimator has to find; those that leave their regularisation to the user are also given the G that
is looked for, and return the best that any of their settings finds.  Repeats are averaged.
"""

import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from helpers.direct import Kernel
from helpers.scans import plane_error
from scipy.special import j0

import memscal
from memscal import Scan
from memscal.axisymmetry.hankel import Wavenumbers, radial_spline
from memscal.model.arrays import FloatArray

RADII = np.linspace(0.0, 3e-3, 121)
"""Where every peer gives G, in m."""

PIXEL = 0.125e-3
"""Half the step of the scans: neither a finer nor a coarser plane brings the peers nearer to G."""

RING_STEP = 0.05e-3
OUTERMOST_RING = 4e-3
"""The rings of which G is made where a program inverts a linear model, in m."""

LARGEST_KH = 20.0
"""The film passes nothing of finer detail to its base."""


@contextmanager
def others_warnings() -> Iterator[None]:
    """Let other programs warn: their deprecations are no failure of ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def plain_points(scan: Scan) -> tuple[FloatArray, FloatArray]:
    """Distances from the true centre (m), and voltages there less true baseline and drift (V)."""
    truth = scan.synthetic
    voltage = np.atleast_2d(scan.u_zz).mean(axis=0)
    slope = 0.5 * truth["drift"] / np.abs(scan.x).max()
    return np.abs(scan.x - truth["centre"]), voltage - truth["baseline"] - slope * scan.x


@dataclass(frozen=True)
class Plane:
    """A scan and its base stress per newton as images, as programs for images want them.

    The sensor is at the middle pixel; between the scan's points its voltage runs straight.
    """

    scan: Scan

    @cached_property
    def axis(self) -> FloatArray:
        half = round(np.abs(self.scan.x).max() / PIXEL)
        return np.arange(-half, half + 1) * PIXEL

    @cached_property
    def voltage(self) -> FloatArray:
        distance, voltage = plain_points(self.scan)
        order = np.argsort(distance)
        return np.interp(self._radius, distance[order], voltage[order], right=0.0)

    @cached_property
    def stress(self) -> FloatArray:
        contact = memscal.indent(self.scan.film, self.scan.indenter, load=1.0)
        # Most pixels share their distance with seven others.
        radius, back = np.unique(np.round(self._radius, 12), return_inverse=True)
        return contact.base_stress(radius)[back].reshape(self._radius.shape)

    @cached_property
    def _radius(self):
        return np.hypot.outer(self.axis, self.axis)

    def radial(self, image: FloatArray) -> FloatArray:
        """G at :data:`RADII` from its image in any unit."""
        middle = self.axis.size // 2
        unit = image[middle, middle:] / (image.sum() * PIXEL**2)
        return radial_spline(self.axis[middle:], unit)(RADII)

    def best(self, images: Iterable[FloatArray], truth: Kernel) -> FloatArray:
        """Of several images of G the one with the least error."""
        wanted = truth.radial(RADII)
        return min(images, key=lambda image: plane_error(RADII, self.radial(image), wanted))


def linear_model(scan: Scan) -> tuple[FloatArray, ...]:
    """Voltages as shares of the largest, responses (points, rings) to a ring, rings and areas."""
    ring = np.arange(round(OUTERMOST_RING / RING_STEP) + 1) * RING_STEP
    area = 2 * np.pi * ring * RING_STEP
    area[0] = np.pi * RING_STEP**2 / 4
    distance, voltage = plain_points(scan)
    contact = memscal.indent(scan.film, scan.indenter, load=1.0)
    reach = float(distance.max() + OUTERMOST_RING)
    wavenumbers = Wavenumbers.covering(LARGEST_KH / scan.film.thickness, reach)
    k = wavenumbers.k
    # A unit ring of radius q has the transform J_0(kq).
    spectra = (wavenumbers.weights * contact.base_spectrum(k))[:, None] * j0(np.outer(k, ring))
    response = (j0(np.outer(distance, k)) @ spectra) * area
    # DeerLab looks for its regularisation between 1e-8 and 1e3, for voltages and G near one.
    return voltage / voltage.max(), response / response.sum(axis=1).max(), ring, area


def deerlab(scan: Scan, truth: Kernel) -> FloatArray:
    """DeerLab's non-negative least squares, smoothed by as much as Akaike's criterion asks for.

    Neither slope nor height are asked for on the axis, where an operator that includes the edges
    would hold G down.
    """
    with others_warnings():
        import deerlab as dl

        voltage, response, ring, area = linear_model(scan)
        fit = dl.snlls(
            voltage,
            response,
            lbl=np.zeros(ring.size),
            reg=True,
            regparam="aic",
            regop=dl.regoperator(ring / RING_STEP, 2),
            uq=False,
        )
    return np.interp(RADII, ring, fit.lin) / (area @ fit.lin)


def inference_tools(scan: Scan, truth: Kernel) -> FloatArray:
    """inference-tools' Gaussian process of the rings' heights, at the true noise.

    Mean, height and length of its squared-exponential covariance have the largest marginal
    likelihood, of three lengths to start from.
    """
    with others_warnings():
        from inference.gp import GpLinearInverter

    voltage, response, ring, area = linear_model(scan)
    noise = scan.synthetic["noise"] / plain_points(scan)[1].max()
    noises = np.full(voltage.size, noise / np.sqrt(scan.u_zz.size / voltage.size))
    inverter = GpLinearInverter(voltage, noises, response, ring[:, None] * 1e3)
    starts = [np.array([0.0, 2.0, np.log(length)]) for length in (0.2, 0.5, 1.0)]  # in mm
    optima = [inverter.optimize_hyperparameters(start) for start in starts]
    best = max(optima, key=inverter.marginal_likelihood)
    heights = inverter.calculate_posterior_mean(best)
    return np.interp(RADII, ring, heights) / (area @ heights)


def skimage(scan: Scan, truth: Kernel) -> FloatArray:
    """scikit-image's Wiener filter with the best of 25 balances."""
    from skimage.restoration import wiener

    plane = Plane(scan)
    stress = plane.stress / plane.stress.sum()
    images = (
        wiener(plane.voltage, stress, balance, clip=False) for balance in np.logspace(-9, 1, 25)
    )
    return plane.radial(plane.best(images, truth))


def photutils(scan: Scan, truth: Kernel) -> FloatArray:
    """The kernel of photutils that turns the stress into the voltage, with the best of 49 windows.

    A window is flat to a share of the largest wavenumber and tapers off over another share.
    """
    with others_warnings():
        from photutils.psf_matching import SplitCosineBellWindow, make_kernel

    plane = Plane(scan)
    kernels = (
        make_kernel(plane.stress, plane.voltage, window=SplitCosineBellWindow(taper, flat))
        for flat in (0.04, 0.06, 0.08, 0.10, 0.12, 0.15, 0.20)
        for taper in (0.03, 0.06, 0.09, 0.12, 0.18, 0.24, 0.30)
    )
    return plane.radial(plane.best(kernels, truth))


PEERS = {
    "deerlab": deerlab,
    "inference": inference_tools,
    "photutils": photutils,
    "skimage": skimage,
}
"""By the name that is imported."""
