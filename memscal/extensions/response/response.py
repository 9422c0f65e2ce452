r"""Response of a sensor under its film to waves of pressure that pass over it.

A pressure :math:`p = \mathrm{Re}\,p_0 e^{ikx}` on the film, with the shear :math:`\mu p` along x,
is read as :math:`\mathrm{Re}\,g\,p_0 e^{ikx}` with the gain

.. math::

    g(k) = A\,\hat G(k)\,[T(kh) + i\mu\,T_q(kh)], \qquad T_q = -N,

with the film's transfer functions :math:`T` and :math:`N` (:mod:`memscal.mechanics.film_response`):
:math:`T \to 1` and :math:`T_q \to -kh` for long waves, which is the balance of moments: the shear
moves the centroid of the normal stress by :math:`\mu h` along x.
"""

from collections.abc import Iterator
from os import PathLike
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import InputError
from memscal.formats.files import FilePath
from memscal.formats.scan import read_scan
from memscal.measurement.posterior import alike_films, input_changes, sensor_changes
from memscal.measurement.restore import require_covariance
from memscal.mechanics.film_response import base_response
from memscal.model.arrays import (
    BoolArray,
    FloatArray,
    array_record,
    finite_vector,
    floats,
    require_positive,
)
from memscal.model.film import ElasticFilm, more_and_less
from memscal.model.result import Shown
from memscal.model.scan import Scan
from memscal.readings.noise_record import noise_of

SIGMAS = 3.0
"""The smallest stress that is seen is so many standard uncertainties of an amplitude."""

#: Properties of a film on which its transfer functions depend.
_OF_FILM = ("thickness", "poisson_ratio")

ComplexArray = NDArray[np.complex128]


@runtime_checkable
class NoiseSpectrum(Protocol):
    """What is known of the noise of a sensor at rest.

    It may have ``band``, lowest and highest frequency in Hz at which its density holds.
    """

    @property
    def corner(self) -> float:
        """Frequency below which drift rules, in Hz."""
        ...

    def spectral_density(self, frequency: FloatArray) -> FloatArray:
        """Return the one-sided density at frequencies in Hz, in V^2/Hz, of their shape."""


class Wave(NamedTuple):
    """One wave: numbers of a :class:`Response`, in SI units; NaN where not known."""

    wavelength: float
    frequency: float
    gain: float  # its modulus
    gain_uncertainty: float
    phase: float
    smallest_stress: float
    resolved: bool


@array_record
class Response(Shown):
    """What a sensor under its film reads of waves of pressure, as :func:`memscal.response` finds.

    Parameters
    ----------
    apparatus, film, friction : ApparatusFunction, ElasticFilm, float
        The sensor, the film, and the shear over the pressure.
    wavelength : ndarray, shape (n,)
        In m.
    gain : ndarray of complex, shape (n,)
        Reading per pressure, in V/Pa (or the unit of the readings per Pa); NaN where not resolved.
    uncertainty : ndarray, shape (n,)
        Standard uncertainty (k = 1) of its modulus.
    resolved : ndarray of bool, shape (n,)
        Whether the calibration determines G at that wavenumber.
    speed : ndarray, shape (m,) or (), or None
        Speeds of the waves over the sensor, in m/s.
    noise_record, length : object, float, or None
        The noise, and the length over which a wave is observed, in m.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> seen = memscal.response(apparatus, [8e-3, 1e-3], speed=1e-3)
    >>> [bool(one) for one in seen.resolved], seen.frequency.tolist()
    ([True, False], [0.125, 1.0])
    """

    apparatus: ApparatusFunction
    film: ElasticFilm
    friction: float
    wavelength: FloatArray
    gain: ComplexArray
    uncertainty: FloatArray
    resolved: BoolArray
    speed: FloatArray | None = None
    noise_record: NoiseSpectrum | None = None
    length: float | None = None

    @property
    def frequency(self) -> FloatArray:
        """Frequencies of the waves at the sensor, in Hz: speed over wavelength.

        Shape (m, n), or (n,) of one speed; NaN without one.
        """
        return np.divide.outer(np.nan if self.speed is None else self.speed, self.wavelength)

    @property
    def smallest_stress(self) -> FloatArray:
        r"""Smallest amplitudes of pressure that are seen, in Pa, of the shape of ``frequency``.

        :math:`3\sqrt{S_n(V/\lambda)\,V/l}\,/\,|g|`: three standard uncertainties of the amplitude
        of a wave of known length that is fitted over the length :math:`l`, in noise of the
        one-sided spectral density :math:`S_n`.  NaN where that, or the gain, is not known: outside
        ``noise_band``, too.
        """
        frequency = self.frequency
        if self.noise_record is None or self.length is None:
            return np.full_like(frequency, np.nan)
        density = self.noise_record.spectral_density(frequency)
        bandwidth = frequency * self.wavelength / self.length
        smallest = SIGMAS * np.sqrt(density * bandwidth) / np.abs(self.gain)
        low, high = self.noise_band
        return np.where((low <= frequency) & (frequency <= high), smallest, np.nan)

    @property
    def noise_band(self) -> tuple[float, float]:
        """Frequencies in Hz between which the noise is known.

        Of a record: one over its duration, and half the rate of its readings; of an object its
        ``band``, or all frequencies.
        """
        low, high = getattr(self.noise_record, "band", (0.0, np.inf))
        return low, high

    @property
    def waves(self) -> Iterator[Wave]:
        """Every wave, speed by speed."""
        columns = np.broadcast_arrays(
            self.wavelength,
            self.frequency,
            np.abs(self.gain),
            self.uncertainty,
            np.angle(self.gain),
            self.smallest_stress,
            self.resolved,
        )
        for numbers in zip(*(column.ravel().tolist() for column in columns), strict=True):
            yield Wave(*numbers)


def response(
    apparatus: ApparatusFunction | FilePath,
    wavelength: ArrayLike,
    speed: ArrayLike | None = None,
    *,
    film: ElasticFilm | None = None,
    friction: float = 0.0,
    noise_record: NoiseSpectrum | Scan | FilePath | None = None,
    length: float | None = None,
) -> Response:
    r"""Find what a calibrated sensor reads of waves of pressure on its film.

    The gain is :math:`A\,\hat G(k)\,[T(kh) + i\mu\,T_q(kh)]`.  What calibration and film share, the
    thickness above all, is counted once and with its sign: a film that is thicker than stated makes
    G too wide, so that its transform is too small, and the calculated T too large.

    Parameters
    ----------
    apparatus : ApparatusFunction or path
        The calibrated sensor.
    wavelength : float or array_like, shape (n,)
        Wavelengths in m.
    speed : float or array_like, shape (m,), optional
        One speed or several with which they pass the sensor, in m/s.
    film : ElasticFilm, optional
        The film that is on the sensor, in place of that of the calibration.
    friction : float
        Shear over pressure along +x on the film; negative where the film is dragged to -x.
    noise_record : path, Scan or object, optional
        The noise at rest: a record, its file, or what has ``spectral_density(frequency)``,
        one-sided, in V^2/Hz, and ``corner``, the frequency in Hz below which drift rules.  Give
        ``speed`` and ``length`` with it.  The density of a record is not extrapolated: there is no
        smallest stress at frequencies below one over its duration or above half its rate, nor
        outside the ``band``, (lowest, highest) in Hz, of an object that has one.
    length : float, optional
        Length over which a wave is observed, in m.

    Returns
    -------
    Response
        Gain, its uncertainty, frequency, and the smallest stress that is seen.

    Raises
    ------
    InputError
        If a number is not above zero, the artifact has no film or gives no stress, or one of noise,
        length and speed is given without the others.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> seen = memscal.response(apparatus, [8e-3, 4e-3])
    >>> [round(float(share), 1) for share in abs(seen.gain) / apparatus.conversion_constant]
    [0.6, 0.2]
    """
    held = opened_apparatus(apparatus)
    _require_stress(held)
    present = film or held.film
    if present is None:
        raise InputError(
            "The artifact states no film.",
            why="How much of a wave reaches the sensor depends on the film's thickness.",
            cure="Give the film that is on the sensor (film=).",
        )
    if not np.isfinite(friction):
        raise InputError(f"The friction is {friction:g}.", cure="Give shear over pressure.")
    wavelengths = np.atleast_1d(_above_zero("The wavelength", wavelength, "m"))
    given = [speed is not None, noise_record is not None, length is not None]
    if any(given[1:]) and not all(given):
        raise InputError(
            "Of noise record, length and speed, one is not given.",
            why="The smallest stress depends on all three: on the density of the noise at the "
            "frequency V/wavelength, and on how long a wave is observed.",
            cure="Give all three, or the speed alone for the frequency.",
        )
    if length is not None and not wavelengths.max() <= length:
        raise InputError(
            f"The length of {length * 1e3:.4g} mm holds no wave of {wavelengths.max() * 1e3:.4g} "
            "mm.",
            cure="Give a length of one wavelength or more, or shorter waves.",
        )
    gain, uncertainty = _gain(held, present, friction, 2 * np.pi / wavelengths)
    resolved = 2 * np.pi / wavelengths <= held.resolved_wavenumber
    return Response(
        apparatus=held,
        film=present,
        friction=friction,
        wavelength=wavelengths,
        # Beyond the resolved band G is the prior's.
        gain=np.where(resolved, gain, np.nan),
        uncertainty=np.where(resolved, uncertainty, np.nan),
        resolved=resolved,
        speed=None if speed is None else _above_zero("The speed", speed, "m/s"),
        noise_record=None if noise_record is None else _noise_at_rest(noise_record, held),
        length=length,
    )


def _require_stress(apparatus: ApparatusFunction) -> None:
    """Refuse a sensor that gives no normal stress, or no uncertainty of it."""
    require_covariance(apparatus)
    apparatus.require_pascals()
    if apparatus.order:
        raise InputError(
            f"The artifact is of the tangential channel {apparatus.sensor.channel}.",
            why="The response is that of the normal stress at the base.",
            cure="Give the artifact of channel zz.",
        )


def _noise_at_rest(
    record: NoiseSpectrum | Scan | FilePath, apparatus: ApparatusFunction
) -> NoiseSpectrum:
    """Return the spectrum of a noise record, or of its file, in the unit of a sensor's readings."""
    if isinstance(record, str | PathLike):
        record = read_scan(record)
    if isinstance(record, Scan):
        if record.unit != apparatus.reading.si:
            raise InputError(
                f"The readings of the noise record are in {record.unit}, those of the artifact in "
                f"{apparatus.reading.si}.",
                cure="Give a record of this sensor, or correct the unit of its readings.",
            )
        return noise_of(record)
    if not isinstance(record, NoiseSpectrum):
        raise InputError(
            f"{type(record).__name__} is given where a noise record is needed.",
            why="The smallest stress follows from the spectral density of readings at rest.",
            cure="Give a record of the sensor at rest (memscal import --noise-record).",
        )
    return record


def _above_zero(name: str, values: ArrayLike, unit: str) -> FloatArray:
    """Return numbers as an array; refuse those that are not finite and above zero."""
    for value in finite_vector(name, np.ravel(values)):
        require_positive(name, value, unit)
    return floats(values)


def _gain(
    apparatus: ApparatusFunction, film: ElasticFilm, friction: float, k: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Return the gain at wavenumbers (rad/m), in V/Pa, and the uncertainty of its modulus."""
    # What is not resolved is not stated: its waves may be as short as a grid's.
    k = np.minimum(k, apparatus.resolved_wavenumber)
    known = apparatus.film
    same = known is not None and alike_films(film, known)
    shared = input_changes(apparatus, _OF_FILM if same else (), k)
    g, of_sensor = sensor_changes(apparatus, k, shared)
    kernel = apparatus.conversion_constant * g
    expected = film.expected
    passed = _passed(expected, friction, k)
    gain = kernel * passed
    changes = [column * passed for column in of_sensor.T]
    for name in _OF_FILM:
        # One error of the film changes both what was calibrated and what the film passes.
        change = shared.get(name, 0.0) * passed
        ends = more_and_less(expected, name)
        if ends:
            more, less, share = ends
            difference = _passed(more, friction, k) - _passed(less, friction, k)
            change = change + share * kernel * difference
        changes.append(change)
    along = np.conj(gain) / np.abs(gain)
    return gain, np.sqrt(np.sum(np.real(along * changes) ** 2, axis=0))


def _passed(film: ElasticFilm, friction: float, k: FloatArray) -> ComplexArray:
    """Normal stress at the base per pressure on the film, whose shear is along the wave."""
    by_pressure, by_shear = base_response(k * film.thickness, film.poisson_ratio)
    return by_pressure - 1j * friction * by_shear
