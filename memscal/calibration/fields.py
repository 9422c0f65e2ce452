"""Fields of voltage and stress (the paper's Eq. 1), and their grid: lifted, or a raster's own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np
import scipy.fft

from memscal.axisymmetry.grids import EvenGrid, Lattice, on_grid
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers, radial_spline
from memscal.deconvolution.division import NOISE_RATIO
from memscal.deconvolution.fourier_ratio import Field, reconvolve
from memscal.errors import InputError
from memscal.estimation.band import Band
from memscal.estimation.forward import wave_table
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.smoothing import SmoothedProfile, rounded_reach
from memscal.estimation.voltage_map import VoltageMap
from memscal.model.arrays import (
    ArrayFunction,
    FloatArray,
    IndexArray,
    array_record,
    floats,
    value_record,
)
from memscal.model.places import EvenAxis
from memscal.readings.find_places import even_lattice

_POINTS_PER_WIDTH = 6.0
#: Points within the support are multiples of this, so that scans of one layout share their grid.
_COUNTED = 4
#: A lifted reference of fewer points along its side is kept.
_MOST_KEPT = 512


@value_record
class GridChoice:
    """Spacing, half width of the support of G, and half extent of the fields, in m."""

    spacing: float
    support: float
    extent: float
    reasons: Mapping[str, str]  # why each was chosen, for the record


def choose_grid(estimate: ProfileEstimate, band: Band) -> GridChoice:
    """Choose the grid from the scan: every length from a length of the data."""
    points = estimate.points
    support = rounded_reach(estimate.distance.max(), points.step)
    if points.as_raster:
        # A square of this half width lies within the raster's longer side.
        support = float(abs(points.x - estimate.centre[0]).max())
    reference = abs(estimate.model.reference.values)
    # A shear's transform vanishes at k = 0, too: only what lies beyond its largest counts.
    beyond = np.arange(reference.size) > np.argmax(reference)
    closed = np.flatnonzero(beyond & (reference < 0.1 * NOISE_RATIO * band.weakest_reference))
    last = estimate.model.k[closed[0] if closed.size else -1]
    spacing = min(estimate.gaussian.width / _POINTS_PER_WIDTH, np.pi / (2 * last))
    spacing = float(support / (_COUNTED * np.ceil(support / spacing / _COUNTED)))
    extent = max(1.25 * support, *map(np.ptp, estimate.offset))
    reasons = {
        "spacing": f"{spacing * 1e3:.4g} mm: {_POINTS_PER_WIDTH:g} points per Gaussian "
        "width, and the last wavenumber is at least twice the one where the window has closed",
        "support": f"{support * 1e3:.4g} mm: the largest distance from the centre, of a "
        "line rounded up to half a step; G is tapered to zero over its outer half",
        "extent": f"{extent * 1e3:.4g} mm: the whole length of the scan, about twice the "
        "support, so that nothing wraps around into it",
    }
    return GridChoice(spacing, support, extent, reasons)


def cosine_taper(radius: FloatArray, support: float) -> FloatArray:
    """One up to half of the support, then a cosine that falls to zero at its edge."""
    # A sharp edge would cut G's ripples at full height, and A would depend on where it lies.
    return (1 + np.cos(np.pi * np.clip(2 * radius / support - 1, 0.0, 1.0))) / 2


@array_record
class LineFields:
    """Both profiles, lifted to a quarter plane; of a vector field its potential."""

    grid: EvenGrid
    voltage: Field
    stress: Field
    support: float  # half its width, in m
    inside: EvenGrid  # of the support
    confinement: FloatArray  # taper on the grid that confines a kernel to the support
    radius: FloatArray
    even = True  # so that they can be divided

    @classmethod
    def lift(
        cls, estimate: ProfileEstimate, spectrum: RadialSpectrum, choice: GridChoice
    ) -> LineFields:
        """Lift the profile of the voltages, by its transform, and the reference."""
        spacing = choice.spacing
        cells = scipy.fft.next_fast_len(math.ceil(choice.extent / spacing), real=True)
        grid = EvenGrid(cells + 1, spacing)
        reference = estimate.model.reference
        if reference.source:
            # The grid does not sample the edge of a source, but its transform.
            k = grid.wavenumber_axis
            voltage = Field(grid, grid.inverse(RadialSpectrum.plane(spectrum, k, k)))
            stress = Field(grid, grid.inverse(RadialSpectrum.plane(reference, k, k)))
        else:
            nodes = reference.wavenumbers
            arrays = (a.tobytes() for a in (nodes.k, nodes.weights, reference.scalar.values))
            lifted = _lifted if grid.count < _MOST_KEPT else _lifted.__wrapped__
            stress = lifted(grid, *arrays)
            voltage = Field(grid, on_grid(spectrum.scalar.at, grid, spacing / 2))
        inside = EvenGrid(round(choice.support / spacing) + 1, spacing)
        support = (inside.count - 1) * inside.spacing
        confinement = cosine_taper(grid.radius, support)
        return cls(grid, voltage, stress, support, inside, confinement, estimate.distance)

    def kernel(self, profile: ArrayFunction) -> FloatArray:
        """Lift a radial function about a kernel's zero, as far as its support goes."""
        values = on_grid(profile, self.inside, self.grid.spacing / 2)
        return np.pad(values, (0, self.grid.count - self.inside.count))

    def convolved(self, kernel: Field) -> FloatArray:
        """Convolve a kernel with the stress: its values at the measured points."""
        line = self.grid.inverse_on_axis(kernel.transform * self.stress.transform)
        return radial_spline(self.grid.axis, line[0])(self.radius)

    def on_support(self, kernel: FloatArray, _: ProfileEstimate | None) -> Field:
        """Return a kernel on its support."""
        # The lifted profile's grid is fine enough to be read as it is.
        count = self.inside.count
        return Field(self.inside, kernel[:count, :count])


@array_record
class RasterFields:
    """A measured raster on its own lattice, continued by the fitted profile around it."""

    grid: Lattice
    central: Lattice  # about the zero of a kernel
    voltage: Field
    stress: Field
    support: float  # half its width, in m
    confinement: FloatArray  # taper on the grid that confines a kernel to the support
    step: float
    oval: Callable[[FloatArray, FloatArray], FloatArray]
    index: tuple[IndexArray, IndexArray]
    share: FloatArray  # (n,): what each reading adds to its node, over its voltage, in 1/N
    even: bool

    @classmethod
    def place(
        cls, estimate: ProfileEstimate, smoothed: SmoothedProfile, choice: GridChoice, divided: bool
    ) -> RasterFields:
        """Place the raster, continued by its smoothed profile; a field that is divided is even."""
        points = estimate.points
        # Of several rasters there is no one field of voltages.
        lattice = None
        if points.as_raster:
            lattice = even_lattice(points.x, points.y, points.places[0].count)
        even = lattice is not None
        if divided and not lattice:
            raise InputError(
                f"The raster's {points.u.size} points are not evenly spaced: they lie on no "
                "lattice of rows and columns within a tenth of its step.",
                why="A raster is divided as a field, on its own lattice, as in a sweep.",
                cure='Use method="bayesian" (--method bayesian) without a sweep, which needs no '
                "lattice; or scan evenly.",
            )
        if not lattice:
            steps = next(places.steps for places in points.places if all(places.steps))
            nowhere = np.zeros(0, np.intp)
            lattice = (
                EvenAxis(points.x.min(), steps[0], nowhere),
                EvenAxis(points.y.min(), steps[1], nowhere),
            )
        x, columns = _continued(lattice[0], np.ptp(points.x), choice.extent)
        y, rows = _continued(lattice[1], np.ptp(points.y), choice.extent)
        grid = Lattice(x - estimate.centre[0], y - estimate.centre[1])
        step = choice.spacing / 2
        reference = estimate.model.reference
        # The lattice of a kernel has its zero at the central point, wherever the sensor is.
        central = Lattice(grid.x - grid.x[x.size // 2], grid.y - grid.y[y.size // 2])
        round_ = on_grid(reference.at, grid, step)
        # The lattice does not sample the edge of a source.
        stress = grid.sampled(reference.plane) if reference.source else round_
        voltage = on_grid(smoothed.spectrum.at, grid, step)
        voltage += grid.convolve(estimate.oval_kernel(*central.axes), stress)
        if reference.model:
            # The profile is that of the field's mean over directions.
            voltage += grid.convolve(on_grid(estimate.radial, central, step), stress - round_)
        share = np.zeros(0)
        if rows.size:
            readings = np.zeros(voltage.shape)
            np.add.at(readings, (rows, columns), 1.0)
            share = estimate.outlier_weight / (points.load * readings[rows, columns])
            # A point that is missing keeps what was fitted; an outlier keeps most of it.
            np.add.at(voltage, (rows, columns), share * (smoothed.signal - smoothed.predicted))
        return cls(
            grid,
            central,
            Field(grid, voltage),
            Field(grid, stress),
            choice.support,
            cosine_taper(central.radius, choice.support),
            step,
            estimate.oval_kernel,
            (rows, columns),
            share,
            even,
        )

    def kernel(self, profile: ArrayFunction) -> FloatArray:
        """Lift a radial function about a kernel's zero, with what of the sensor is not round."""
        return self._lifted(profile, self.central)

    def _lifted(self, profile: ArrayFunction, grid: Lattice) -> FloatArray:
        return on_grid(profile, grid, self.step) + self.oval(*grid.axes)

    def convolved(self, kernel: Field) -> FloatArray:
        """Convolve a kernel with the stress: its values at the measured points."""
        return reconvolve(1.0, kernel, self.stress).values[self.index]

    def gain(self, smoothed: SmoothedProfile) -> VoltageMap:
        """Derivative of the field's transform by the voltages, (k, n), its mean over directions."""
        # The transform is a sum over the lattice: of the points, and of the profile elsewhere.
        profiled = np.ones_like(self.voltage.values)
        np.subtract.at(profiled, self.index, self.share * smoothed.estimate.points.load)
        radius = self.grid.radius
        table = wave_table(0, False, radius.max(), smoothed.estimate.model.k.tobytes())
        coefficients = table.spline.c
        everywhere = table.interpolation(radius.ravel())
        # J0(k r) J0(k' r) over what has something of the profile, by the table's splines.
        both = (everywhere.T @ everywhere.multiply(profiled.reshape(-1, 1))) @ coefficients
        elsewhere = (coefficients.T @ both) * smoothed.spectrum.wavenumbers.weights
        own = table.interpolation(radius[self.index]).multiply(self.share[:, None]).tocsr()
        by_points = VoltageMap(((coefficients.T, own),))
        by_profile: VoltageMap = elsewhere @ smoothed.gain
        return (by_points + by_profile) * self.grid.cell_area

    def on_support(self, kernel: FloatArray, profile: ProfileEstimate | None) -> Field:
        """Return a kernel on its support."""
        step = self.grid.x[1] - self.grid.x[0]
        # Odd, so that the kernel's zero stays a point of the lattice.
        least = math.ceil(step / (2.0 * self.step)) | 1
        finer = math.ceil(step / (2.0 / 3 * self.step)) | 1
        fine, values = self.grid.refined(kernel, max(min(5, finer), least))
        if profile:
            values = self._lifted(profile.radial, fine)
        inside_x = abs(fine.x) <= self.support
        inside_y = abs(fine.y) <= self.support
        inside = np.ix_(inside_y, inside_x)
        return Field(Lattice(fine.x[inside_x], fine.y[inside_y]), values[inside])


@lru_cache(maxsize=6)
def _lifted(grid: EvenGrid, k: bytes, weights: bytes, values: bytes) -> Field:
    """Field of a reference by its transform, kept for the next scans of one layout."""
    nodes = Wavenumbers(np.frombuffer(k), np.frombuffer(weights))
    spectrum = RadialSpectrum(nodes, np.frombuffer(values))
    return Field(grid, on_grid(spectrum.at, grid, grid.spacing / 2))


Fields = LineFields | RasterFields
"""Voltage and stress on one grid, with the ways back from the grid."""


def _continued(axis: EvenAxis, reach: float, extent: float) -> tuple[FloatArray, IndexArray]:
    """Continue a raster's axis on both sides, to an odd number of nodes; index the points."""
    steps = round(reach / axis.step)
    padding = math.ceil(max(2 * extent - reach, 0.0) / (2 * axis.step)) + 1
    count = steps + 1 + 2 * padding + steps % 2
    nodes = axis.start + axis.step * (np.arange(count) - padding)
    return floats(nodes), axis.index + padding
