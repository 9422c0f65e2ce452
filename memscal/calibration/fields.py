"""The two fields of the paper's Eq. (1): lifted from profiles, or measured as a raster."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.fft

from memscal.axisymmetry.grids import EvenGrid, FieldGrid, cut, on_grid
from memscal.deconvolution.fourier_ratio import Field
from memscal.deconvolution.problem import NOISE_RATIO, KernelProfile
from memscal.estimation.band import Band
from memscal.estimation.constrained import constrained_profile
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = [
    "Fields",
    "GridChoice",
    "LineFields",
    "choose_grid",
    "constrained_kernel",
    "taper",
]

_POINTS_PER_WIDTH = 6.0


@dataclass(frozen=True)
class GridChoice:
    """Spacing, half width of the support of G, and half extent of the fields, in m."""

    spacing: float
    support: float
    extent: float

    @property
    def reasons(self) -> Mapping[str, str]:
        """Why each was chosen, for the record."""
        return {
            "spacing": f"{self.spacing * 1e3:.4g} mm: {_POINTS_PER_WIDTH:g} points per Gaussian "
            "width, and the last wavenumber is at least twice the one where the window has closed",
            "support": f"{self.support * 1e3:.4g} mm: the largest distance from the centre; G is "
            "tapered to zero over its outer half",
            "extent": f"{self.extent * 1e3:.4g} mm: the whole length of the scan, about twice the "
            "support, so that nothing wraps around into it",
        }


class Fields(Protocol):
    """Both fields on one grid, with the ways back from the grid."""

    @property
    def grid(self) -> FieldGrid:
        """The grid."""
        ...

    @property
    def voltage(self) -> Field:
        """Voltage per newton, in V/N."""
        ...

    @property
    def stress(self) -> Field:
        """Base stress per newton, in 1/m^2."""
        ...

    @property
    def confinement(self) -> FloatArray:
        """Taper on the grid that confines a kernel to its support."""
        ...

    def kernel(self, profile: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """A radial function about a kernel's zero, on the grid."""
        ...

    def at_points(self, field: FloatArray) -> FloatArray:
        """Values of a field at the measured points."""
        ...

    def on_support(self, kernel: FloatArray, profile: KernelProfile | None) -> Field:
        """A kernel on its support; from its profile, where that is known."""
        ...

    def along_axis(self, spectral: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Wavenumbers along one axis and a spectral quantity there."""
        ...


def choose_grid(estimate: ProfileEstimate, band: Band) -> GridChoice:
    """Choose the grid from the scan: every length from a length of the data.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's profile.
    band : Band
        Its relevant band, which says where the window closes.
    """
    points = estimate.points
    support = float(estimate.distance.max())
    if points.as_raster:
        # A square of this half width lies within the raster's longer side.
        support = float(np.abs(points.x - estimate.centre[0]).max())
    reference = np.abs(estimate.model.reference.values)
    # A shear's transform vanishes at k = 0, too: only what lies beyond its largest counts.
    beyond = np.arange(reference.size) > np.argmax(reference)
    closed = beyond & (reference < 0.1 * NOISE_RATIO * band.weakest_reference)
    last = float(band.k[int(np.argmax(closed))] if closed.any() else band.k[-1])
    width = max(estimate.gaussian.sigma, 0.5 * points.step)
    spacing = min(width / _POINTS_PER_WIDTH, np.pi / (2 * last))
    spacing = support / np.ceil(support / spacing)
    span = max(float(np.ptp(offset)) for offset in estimate.offset)
    extent = max(span, 1.25 * support)
    return GridChoice(spacing=float(spacing), support=support, extent=extent)


def constrained_kernel(
    estimate: ProfileEstimate, fields: Fields
) -> Callable[[bool, bool], tuple[KernelProfile, FloatArray]]:
    """Return what gives A G of the estimate and its values on the grid, as constrained."""

    def posterior(nonnegative: bool, monotone: bool) -> tuple[KernelProfile, FloatArray]:
        profile = constrained_profile(estimate, nonnegative=nonnegative, monotone=monotone)
        return profile, fields.kernel(profile.radial)

    return posterior


def taper(radius: FloatArray, support: float) -> FloatArray:
    """One up to half of the support, then falling as a cosine to zero at its edge.

    A sharp edge would cut the ripples of G at full height: their integral, and with it A, would
    depend on where it lies.
    """
    phase = np.clip(2 * radius / support - 1, 0.0, 1.0)
    return np.asarray((1 + np.cos(np.pi * phase)) / 2)


@dataclass(frozen=True, eq=False)
class LineFields:
    """Both profiles, lifted to a quarter plane; of a vector field its potential."""

    grid: EvenGrid
    voltage: Field
    stress: Field
    support: int
    radius: FloatArray

    @classmethod
    def lift(cls, estimate: ProfileEstimate, choice: GridChoice) -> LineFields:
        """Lift the profile of the estimate, and the reference."""
        cells = scipy.fft.next_fast_len(int(np.ceil(choice.extent / choice.spacing)), real=True)
        grid = EvenGrid(cells + 1, choice.spacing)
        step = choice.spacing / 2
        # Both at once: they share the Bessel functions of their transforms.
        known = estimate.model.reference
        spectra = np.stack([estimate.spectrum.scalar.values, known.scalar.values], axis=1)
        wavenumbers = known.wavenumbers
        both = on_grid(lambda r: wavenumbers.synthesise(spectra, r), grid, step)
        voltage, stress = (Field(grid, v) for v in np.ascontiguousarray(np.moveaxis(both, -1, 0)))
        support = round(choice.support / choice.spacing)
        return cls(grid, voltage, stress, support, estimate.distance)

    @property
    def confinement(self) -> FloatArray:
        """Taper on the grid that confines a kernel to its support."""
        return taper(self.grid.radius, self.support * self.grid.spacing)

    def kernel(self, profile: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Lift a radial function about a kernel's zero."""
        return on_grid(profile, self.grid, self.grid.spacing / 2)

    def at_points(self, field: FloatArray) -> FloatArray:
        """Return the values of a field at the measured points."""
        return cut(field, self.grid, self.radius)

    def on_support(self, kernel: FloatArray, profile: KernelProfile | None) -> Field:  # noqa: ARG002
        """Return a kernel on its support."""
        # The lifted profile's grid is fine enough to be read as it is.
        inside = slice(0, self.support + 1)
        return Field(EvenGrid(self.support + 1, self.grid.spacing), kernel[inside, inside])

    def along_axis(self, spectral: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return wavenumbers along one axis and a spectral quantity there."""
        return self.grid.wavenumber_axis, spectral[0]
