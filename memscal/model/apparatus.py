"""Data of an apparatus function, as its artifact stores them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field as dataclass_field
from functools import cached_property

import numpy as np
from scipy.special import stdtrit

from memscal.errors import InputError
from memscal.model.arrays import FloatArray, FrozenArrays, array_record, keyword_array_record
from memscal.model.assumptions import Assumption
from memscal.model.checks import Checked, QualityCheck, state_of_checks
from memscal.model.film import ElasticFilm
from memscal.model.indenter import RoundIndenter
from memscal.model.instrument import Equipment, LoadCell, StressSensor, User
from memscal.model.notation import VOLTS, Reading, format_measured
from memscal.model.provenance import Process
from memscal.model.stress import StressProfile

#: Wavenumbers of a decade; some of the one before.
_ROUND = np.array([0.1, 0.2, 0.5, 1.0, 2.0, 5.0])


def round_wavenumbers(resolved: float) -> FloatArray:
    """Return up to three resolved wavenumbers, in rad/m, that calibrations of a sensor share."""
    k = 10.0 ** np.floor(np.log10(resolved)) * _ROUND
    return np.asarray(k[k <= resolved][-3:])


@array_record
class ApparatusField(FrozenArrays):
    """The apparatus function on a Cartesian grid, with unit integral over it.

    ``x`` (n,) and ``y`` (m,) in m; ``g`` and ``g_errors`` (m, n) in 1/m^2.  ``g_scatter`` (m, n)
    is the part of ``g_errors`` that scatters from scan to scan, ``None`` where it is not known.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> field = apparatus.field
    >>> field.g.shape == (field.y.size, field.x.size)
    True
    """

    x: FloatArray
    y: FloatArray
    g: FloatArray
    g_errors: FloatArray
    g_scatter: FloatArray | None = None

    @classmethod
    def of_profile(cls, profile: ApparatusRadial) -> ApparatusField:
        """Return a round G on the lattice of its radii, by a cubic spline; zero beyond them."""
        from scipy.interpolate import CubicSpline

        axis = np.append(-profile.r[:0:-1], profile.r)
        radius = np.hypot.outer(axis, axis)
        g = CubicSpline(axis, np.append(profile.g[:0:-1], profile.g))(radius)
        errors = np.interp(radius, profile.r, profile.g_errors)
        return cls(axis, axis, np.where(radius <= profile.r[-1], g, 0.0), errors)


@array_record
class ApparatusRadial(FrozenArrays):
    """The radial profile of the apparatus function.

    ``r`` (n,) in m; ``g``, ``g_errors`` (k = 1) and ``g_gaussian`` (n,) in 1/m^2;
    ``g_covariance`` (n, n) in 1/m^4; ``conversion_correlation`` (n,): correlation of the errors
    of G and of the conversion constant, ``None`` where it is not known.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> profile = apparatus.radial_profile
    >>> bool(profile.g[0] > profile.g_errors[0])  # G on the axis, 1/m^2
    True
    """

    r: FloatArray
    g: FloatArray
    g_errors: FloatArray
    g_gaussian: FloatArray
    g_covariance: FloatArray
    conversion_correlation: FloatArray | None = None


@array_record
class TransferFunction(FrozenArrays):
    """Modulus of the apparatus function's 2-D Fourier transform along a radius.

    ``k`` (n,) in rad/m; ``modulus``, ``modulus_errors`` and ``window`` (the
    regularisation's, from 0 to 1) are dimensionless.  Up to ``resolved_wavenumber`` (rad/m) the
    scan determines the modulus, beyond it the regularisation does.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> transfer = apparatus.transfer
    >>> round(float(transfer.modulus[0]), 3), transfer.resolved_wavenumber > 2e3  # rad/m
    (1.0, True)
    """

    k: FloatArray
    modulus: FloatArray
    modulus_errors: FloatArray
    window: FloatArray
    resolved_wavenumber: float


@array_record
class Reconvolution(FrozenArrays):
    """The scan beside what the calibration predicts for it; all in V against ``x`` in m.

    In a raster ``x`` is the distance from the sensor's centre.  ``u_zz_predicted`` uses the
    deconvolved G, ``u_zz_gaussian`` the Gaussian fitted in data space; ``residual`` is measured
    minus predicted.  ``offset_x`` and ``offset_y`` (m) of a raster are the positions from the
    sensor's centre; of rasters and of several loads or scans, ``load`` (N) and ``background``
    (baseline and drift, V) are those of each point, else ``None``.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> reconvolution = apparatus.reconvolution
    >>> bool(abs(reconvolution.residual).max() < 0.02 * reconvolution.u_zz.max())
    True
    """

    x: FloatArray
    u_zz: FloatArray
    u_zz_errors: FloatArray
    u_zz_predicted: FloatArray
    u_zz_gaussian: FloatArray
    residual: FloatArray
    offset_x: FloatArray | None = None
    offset_y: FloatArray | None = None
    load: FloatArray | None = None
    background: FloatArray | None = None


@array_record
class ParameterSet(FrozenArrays):
    """Estimated scalars with their joint covariance, in SI units.

    Parameters
    ----------
    names, units : tuple of str
        Such as ``conversion_constant`` and ``gaussian_sigma``; their SI units, needed only for
        names that the file format does not define.
    values, covariance : ndarray, shape (n,), (n, n)
        Estimates and their joint covariance, systematic contributions included.
    reading : Reading
        The unit of the sensor's readings, in which baseline and conversion constant are shown.

    Examples
    --------
    >>> p = ParameterSet(("gaussian_sigma",), np.array([5.6e-4]), np.array([[1e-12]]))
    >>> p["gaussian_sigma"], p.uncertainty("gaussian_sigma")
    (0.00056, 1e-06)
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    units: tuple[str, ...] = ()
    reading: Reading = VOLTS

    def __post_init__(self) -> None:
        super().__post_init__()
        n = len(self.names)
        if self.units and len(self.units) != n:
            raise InputError(f"{n} parameter names, but {len(self.units)} units.")
        if self.values.shape != (n,) or self.covariance.shape != (n, n):
            raise InputError(
                f"{n} parameter names, {self.values.shape} values and a covariance of shape "
                f"{self.covariance.shape} do not fit together."
            )

    def __getitem__(self, name: str) -> float:
        return float(self.values[self._index(name)])

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def uncertainty(self, name: str) -> float:
        """Return the standard uncertainty (k = 1) of one parameter, in its SI unit."""
        i = self._index(name)
        return float(np.sqrt(self.covariance[i, i]))

    def only(self, names: Sequence[str]) -> ParameterSet:
        """Return some of the parameters, with their joint covariance."""
        chosen = [self._index(name) for name in names]
        units = tuple(self.units[i] for i in chosen) if self.units else ()
        covariance = self.covariance[np.ix_(chosen, chosen)]
        return ParameterSet(tuple(names), self.values[chosen], covariance, units, self.reading)

    def _index(self, name: str) -> int:
        if name not in self.names:
            raise InputError(
                f"There is no parameter {name}.", cure=f"There are {', '.join(self.names)}."
            )
        return self.names.index(name)


@array_record
class OtherEstimate:
    """A and G of the same scan by the route that was not chosen: a division, or ``bayesian``.

    ``parameters``: the conversion constant and the widths of G; ``radial_profile``: G(r).
    """

    method: str
    parameters: ParameterSet
    radial_profile: ApparatusRadial


@keyword_array_record
class ApparatusData(Checked):
    """Everything that an apparatus-function artifact stores, in SI units.

    ``plane`` is G over the plane, ``None`` in a compact artifact of a round G; ``field`` has it in
    any case.  ``film``, ``indenter`` and ``load`` are ``None`` where a scan with a reference states
    none.
    ``reference`` is the base stress that was divided by; ``budget`` has the standard uncertainty
    of the conversion constant and of both Gaussian widths by source; ``kernel_changes`` (n,), at
    the radii of ``radial_profile``, are those of A G over A by one standard uncertainty of each
    input, in 1/m^2, empty where inputs are correlated; ``shared_effects`` (2 + m,),
    likewise, and by noise and regularisation, whose sign is not known, are those of ln A, of the
    logarithm of the Gaussian width, and of ln A G(k) at the m ``round_wavenumbers``, as
    calibrations with the same film, rod or load cell share them; ``assumptions`` are what the
    result takes for granted; ``other`` is the estimate by the route that was not chosen, where
    there is one.
    """

    plane: ApparatusField | None
    radial_profile: ApparatusRadial
    transfer: TransferFunction
    reconvolution: Reconvolution
    parameters: ParameterSet
    checks: tuple[QualityCheck, ...]
    film: ElasticFilm | None
    indenter: RoundIndenter | None
    sensor: StressSensor
    load: float | None
    reference: StressProfile
    process: Process
    budget: Mapping[str, Mapping[str, float]]
    kernel_changes: Mapping[str, FloatArray] = dataclass_field(default_factory=dict)
    shared_effects: Mapping[str, FloatArray] = dataclass_field(default_factory=dict)
    assumptions: tuple[Assumption, ...] = ()
    other: OtherEstimate | None = None
    load_cell: LoadCell = dataclass_field(default_factory=LoadCell)
    stage: Equipment = dataclass_field(default_factory=Equipment)
    user: User = dataclass_field(default_factory=User)
    start_time: str = ""
    end_time: str = ""

    def __repr__(self) -> str:
        """Return the main numbers in place of thousands of array elements."""
        of_a = ("conversion_constant", self.reading.scale, self.reading.over(self.reading.unit))
        values = self.parameters
        a, sigma = (
            format_measured(values[name] / scale, values.uncertainty(name) / scale, unit)
            for name, scale, unit in (of_a, ("gaussian_sigma", 1e-3, "mm"))
        )
        state = state_of_checks(self.checks)
        return f"<{type(self).__name__}: A = {a}, sigma = {sigma}, {state}>"

    @cached_property
    def field(self) -> ApparatusField:
        """G over the plane: as stored, or of the radial profile in a compact artifact."""
        return self.plane or ApparatusField.of_profile(self.radial_profile)

    @property
    def reading(self) -> Reading:
        """Unit of the sensor's readings, and of the reference."""
        return self.parameters.reading

    def require_pascals(self) -> None:
        """Refuse to state pascals by a conversion constant that is not per pascal."""
        reading = self.reading
        if reading.per != "Pa":
            whose = "relative" if reading.relative else "per unit of a reference that is no stress"
            raise InputError(
                f"The conversion constant of the artifact is {whose}: it gives no stress in Pa.",
                why="The stress of its calibration was not known, and no reading tells another. "
                "Centre, widths and G hold, and the ratio to the A of another sensor.",
                cure="Calibrate with a known load and a stress in Pa, without --relative.",
            )

    @property
    def effective_degrees(self) -> Mapping[str, float]:
        """Degrees of freedom of each parameter's uncertainty, where the noise was estimated."""
        return dict(self.process.configuration.get("effective_degrees", {}))

    def coverage_factor(self, name: str) -> float:
        """Return k of a parameter's expanded uncertainty k u: Student's, of 95.45 %."""
        # GUM (JCGM 100:2008), G.3.2 and table G.2; two, where no noise was estimated.
        degrees = self.effective_degrees.get(name)
        return 2.0 if degrees is None else float(stdtrit(degrees, 0.97725))

    @property
    def conversion_constant(self) -> float:
        """Conversion constant A, in V/Pa, or in the unit of the readings per Pa."""
        return self.parameters["conversion_constant"]

    @property
    def gaussian_sigma(self) -> float:
        """Standard deviation of the Gaussian fitted in data space, in m."""
        return self.parameters["gaussian_sigma"]

    @property
    def resolved_wavenumber(self) -> float:
        """Wavenumber up to which the scan determines G, in rad/m."""
        return self.transfer.resolved_wavenumber
