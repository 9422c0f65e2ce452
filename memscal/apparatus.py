"""Apparatus function: predicted voltages, convolved stresses, measured stresses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from functools import cached_property
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0

from memscal.axisymmetry.grids import Lattice
from memscal.axisymmetry.hankel import (
    ACROSS,
    RadialSpectrum,
    Wavenumbers,
    hankel_transform,
    radial_spline,
    ring_areas,
)
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.errors import InputError
from memscal.estimation.points import TANGENTIAL
from memscal.extensions import hook
from memscal.model.apparatus import ApparatusData, ApparatusField
from memscal.model.arrays import (
    ArrayPair,
    FloatArray,
    finite_vector,
    floats,
    keyword_array_record,
    require_increasing,
)
from memscal.model.provenance import SourceFile
from memscal.model.result import Result
from memscal.model.stress import IdealReference

#: A base stress reaches no farther than this, in m; a larger radius is in another unit.
_LARGEST_RADIUS = 1.0
#: What may be left of a stress at the end of its table.
_DECAYED = 0.01
_FEWEST_RADII = 4
#: A round G over the plane differs from its profile's by less, as a share of the largest G.
_ROUND = 1e-4
#: Positions of a field are even to this share of their step.
_UNEVEN = 1e-3
#: A slit of this share of G's width changes its line spread by less than 1e-7.
_THIN = 1e-3
#: An ideal reference is sampled at so many points for each width of G.
_PER_WIDTH = 8
#: Principal errors of G(r) below this share of the largest variance are left out over the plane.
_NEGLIGIBLE = 1e-5


@keyword_array_record
class ApparatusFunction(Result, ApparatusData):
    r"""A calibrated sensor: :math:`U_{zz} = A\,G \otimes \sigma_{zz}`.

    A tangential channel (``sensor.channel`` is ``"xz"`` or ``"yz"``) measures one component of the
    shear at the base.  Give its radial profile, as ``Contact.base_shear`` has it, in place of
    :math:`\sigma_{zz}`: what comes back is the radial profile of the blurred vector field, and of
    the voltage where the indenter stands at larger x (or y) than the sensor.

    Made by :func:`memscal.calibrate` or :func:`memscal.load_apparatus`; its data are described
    in ``ApparatusData``.  All quantities are in SI units.
    ``print(apparatus)`` shows the parameters with their standard uncertainties and the checks.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=3)).apparatus
    >>> contact = memscal.indent(apparatus.film, memscal.Sphere(radius=0.1), load=0.5)
    >>> r = np.linspace(0, 20e-3, 801)
    >>> volts = apparatus.predict(r, contact.base_stress(r))
    >>> bool(apparatus.stress(volts)[0] < contact.base_stress(0.0))
    True
    """

    source: SourceFile | None = field(default=None, init=False)
    """The file it was read from; ``None`` for a changed copy."""

    @cached_property
    def content_digest(self) -> str:
        """The digest that its artifact states, or would state if it were saved."""
        from memscal.formats.artifact import artifact_tree
        from memscal.formats.hdf5.writer import DIGEST_ATTRIBUTE

        return str(artifact_tree(self).attributes[DIGEST_ATTRIBUTE])

    @property
    def order(self) -> int:
        """Order of the channel's Hankel transforms: zero, or one of a tangential channel."""
        return int(self.sensor.channel in TANGENTIAL)

    def radial(self, r: ArrayLike) -> FloatArray:
        """Return G at radii ``r`` (m, any shape), in 1/m^2; zero beyond its support."""
        return self._at(self.radial_profile.g, r)

    def radial_uncertainty(self, r: ArrayLike) -> FloatArray:
        """Return the standard uncertainty (k = 1) of :meth:`radial`, in 1/m^2."""
        return self._at(self.radial_profile.g_errors, r)

    def line_spread(self, x: ArrayLike) -> ArrayPair:
        r"""Return the integral of G over y and its standard uncertainty (k = 1), both in 1/m.

        :math:`L(x) = \int G(\sqrt{x^2 + y^2})\,dy`: what a stress of unit integral along a line,
        the same all along it, is turned into at a distance x.  A scan across such a line has the
        shape of L, and its Fourier transform is that of G along a radius.

        Parameters
        ----------
        x : array_like, shape (n,)
            Distances from the line, in m, on either side.

        Returns
        -------
        value, uncertainty : ndarray, shape (n,)
            L, and its uncertainty by the stored covariance of G(r).

        Raises
        ------
        InputError
            If ``x`` is no vector of finite numbers.

        Examples
        --------
        >>> import memscal, numpy as np
        >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
        >>> x = np.linspace(-5e-3, 5e-3, 201)
        >>> value, uncertainty = apparatus.line_spread(x)
        >>> round(float(np.trapezoid(value, x)), 2), bool(uncertainty[100] < 0.1 * value[100])
        (1.0, True)
        """
        line = IdealReference("slit", _THIN * self.gaussian_sigma)
        value = self.convolve(x, line) / line.size
        return value, self.convolve_uncertainty(x, line) / line.size

    def convolve(
        self, r: ArrayLike, sigma_zz: ArrayLike | IdealReference, *, y: ArrayLike | None = None
    ) -> FloatArray:
        r"""Return :math:`G \otimes \sigma_{zz}`: a stress field as the sensor blurs it.

        Parameters
        ----------
        r : array_like, shape (n,)
            Increasing radii of the base stress, in m, from the axis to where it has decayed.
        sigma_zz : array_like, shape (n,), or IdealReference
            Normal stress at the base, in Pa; of a tangential channel the radial shear.  Of an
            ideal reference ``r`` (and ``y``) are any positions about its middle.
        y : array_like, shape (m,), optional
            With it ``sigma_zz`` is any field (m, n), on even positions ``y`` and ``x = r``, in m,
            and G is that over the plane: what a point sensor would measure with the indenter at
            each position is turned into what this sensor measures.

        Returns
        -------
        ndarray, of the shape of ``sigma_zz``
            The blurred stress at the same places, in Pa.

        Raises
        ------
        InputError
            If the table is not in metres, is coarser than G, begins off the axis, or ends
            before the stress has decayed.

        Examples
        --------
        >>> import memscal, numpy as np
        >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
        >>> x = np.linspace(-5e-3, 5e-3, 101)
        >>> stress = 1e3 * np.exp(-np.hypot.outer(x, x) ** 2 / 1e-6)
        >>> bool(apparatus.convolve(x, stress, y=x).max() < stress.max())
        True
        """
        if y is not None:
            if isinstance(sigma_zz, IdealReference):
                return self._of_ideal(self.convolve, r, y, sigma_zz)
            return _convolved(r, y, self._checked_field(r, y, sigma_zz), self.field)
        radii, spectrum = self._checked(r, sigma_zz)
        profile = self.radial_profile
        kernel = hankel_transform(profile.r, profile.g, spectrum.wavenumbers.k)
        return replace(spectrum, values=kernel * spectrum.values).at(radii)

    def predict(
        self, r: ArrayLike, sigma_zz: ArrayLike | IdealReference, *, y: ArrayLike | None = None
    ) -> FloatArray:
        r"""Return the reading :math:`A\,G \otimes \sigma_{zz}` of a base stress, in its unit (V).

        Of a relative A the stress is in units of the largest of its reference, not in Pa.

        Parameters and errors are those of :meth:`convolve`.

        Examples
        --------
        >>> import memscal, numpy as np
        >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
        >>> x = np.linspace(-5e-3, 5e-3, 101)
        >>> disc = memscal.IdealReference("disc", 1e-3)  # one unit within a radius of 1 mm
        >>> apparatus.predict(x, disc).shape, apparatus.predict(x, disc, y=x[:51]).shape
        ((101,), (51, 101))
        """
        return self.conversion_constant * self.convolve(r, sigma_zz, y=y)

    def convolve_uncertainty(
        self, r: ArrayLike, sigma_zz: ArrayLike | IdealReference
    ) -> FloatArray:
        r"""Return the standard uncertainty of :meth:`convolve` that G brings, in Pa.

        :math:`\sqrt{K C K^T}` for the operator :math:`K` that takes G(r) to the blurred stress, and
        the stored covariance :math:`C` of G(r).  Parameters and errors are those of
        :meth:`convolve`.
        """
        operator, _ = self._operator(r, sigma_zz)
        variance = np.einsum("ij,jk,ik->i", operator, self.radial_profile.g_covariance, operator)
        return floats(np.sqrt(np.maximum(variance, 0.0)))

    def predict_uncertainty(
        self, r: ArrayLike, sigma_zz: ArrayLike | IdealReference, *, y: ArrayLike | None = None
    ) -> FloatArray:
        r"""Return the standard uncertainty of :meth:`predict` that A and G bring, in its unit.

        The errors of A and G are correlated: a profile that is too narrow has too small a tail,
        and with it too small an A.  Artifacts that do not state the correlation count none.
        Over the plane (``y``) what ``field`` states beyond the profile's errors is taken as
        independent between places that the scan resolves.

        Examples
        --------
        >>> import memscal, numpy as np
        >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
        >>> x = np.linspace(-5e-3, 5e-3, 101)
        >>> stress = 1e3 * np.exp(-np.hypot.outer(x, x) ** 2 / 1e-6)
        >>> apparatus.predict_uncertainty(x, stress, y=x).shape
        (101, 101)
        """
        if y is not None and isinstance(sigma_zz, IdealReference):
            return self._of_ideal(self.predict_uncertainty, r, y, sigma_zz)
        profile = self.radial_profile
        a = self.conversion_constant
        u_a = self.parameters.uncertainty("conversion_constant")
        shared = np.zeros_like(profile.g)
        if profile.conversion_correlation is not None:
            shared = profile.conversion_correlation * profile.g_errors
        if y is None:
            operator, blurred = self._operator(r, sigma_zz)
            of_g = self.convolve_uncertainty(r, sigma_zz) ** 2
            with_a = operator @ shared
        else:
            blurred = self.convolve(r, sigma_zz, y=y)
            stress = np.asarray(sigma_zz, dtype=np.float64)
            of_g = self._field_variance(r, y, stress)
            lifted = ApparatusField.of_profile(replace(profile, g=shared))
            with_a = _convolved(r, y, stress, lifted)
        variance = a**2 * of_g + (blurred * u_a) ** 2 + 2 * a * blurred * u_a * with_a
        return np.sqrt(np.maximum(variance, 0.0))

    def stress_uncertainty(self, u_zz: ArrayLike) -> FloatArray:
        """Return the standard uncertainty of :meth:`stress` that A brings, in Pa."""
        relative = self.parameters.uncertainty("conversion_constant") / self.conversion_constant
        return np.abs(self.stress(u_zz)) * relative

    def stress(self, u_zz: ArrayLike) -> FloatArray:
        """Return the measured stress S_zz = U_zz / A, in Pa, for readings in V (or their unit).

        The paper's definition: the stress as the sensor blurs it, to be compared with
        :meth:`convolve`.  Baselines must have been subtracted.
        """
        self.require_pascals()
        return floats(u_zz) / self.conversion_constant

    def compact(self) -> ApparatusFunction:
        """Return a copy whose artifact leaves G over the plane out, where G is round.

        ``field`` of such an artifact is made from ``radial_profile``.  G stays where that differs
        from it by 1e-4 of the largest G: that of a sensor that is not round, or of a raster.

        Examples
        --------
        >>> import memscal
        >>> apparatus = memscal.calibrate(memscal.simulate(seed=3)).apparatus
        >>> apparatus.compact().plane is None
        True
        """
        if self.plane is None:
            return self
        of_profile = ApparatusField.of_profile(self.radial_profile)
        g = self.plane.g
        alike = g.shape == of_profile.g.shape and np.allclose(g, of_profile.g, 0, _ROUND * g.max())
        return replace(self, plane=None) if alike else self

    def save(self, path: str | PathLike[str], *, overwrite: bool = False) -> None:
        """Write the apparatus function to an artifact file.

        Raises
        ------
        OutputError
            If the file exists and ``overwrite`` is false, or cannot be written.
        """
        hook("write_artifact")(self, path, overwrite=overwrite)

    def _operator(self, r: ArrayLike, sigma_zz: ArrayLike | IdealReference) -> ArrayPair:
        """Matrix from G at its radii to the blurred stress at ``r``, and the latter."""
        radii, spectrum = self._checked(r, sigma_zz)
        profile = self.radial_profile
        # The radii are even and fine, so that the plain sum is as good as a quadrature rule.
        kernel = j0(np.outer(spectrum.wavenumbers.k, profile.r)) * ring_areas(profile.r)
        operator = replace(spectrum, values=spectrum.values[:, None] * kernel).at(radii)
        return operator, operator @ profile.g

    def _of_ideal(
        self, quantity: Callable[..., FloatArray], x: ArrayLike, y: ArrayLike, ideal: IdealReference
    ) -> FloatArray:
        """Sample an ideal reference over the plane, and interpolate a quantity of that field."""
        from scipy.interpolate import RectBivariateSpline

        if ideal.shape == "slit":
            raise InputError(
                "A slit is the same along itself.",
                cure="Give positions across it, without y.",
            )
        size = max(np.abs(x).max(), np.abs(y).max(), 8 * ideal.size)
        step = self.gaussian_sigma / _PER_WIDTH
        reach = int(np.ceil((size + np.abs(self.field.x).max()) / step))
        axis = floats(step * np.arange(-reach, reach + 1))
        sampled = Lattice(axis, axis).sampled(
            lambda ky, kx: ideal.transform(np.hypot.outer(ky, kx))
        )
        return RectBivariateSpline(axis, axis, quantity(axis, sampled, y=axis))(
            floats(y), floats(x)
        )

    def _field_variance(self, x: ArrayLike, y: ArrayLike, stress: FloatArray) -> FloatArray:
        """Variance of a convolved field that G brings: by the profile, and by what is not round."""
        profile = self.radial_profile
        g = self.field
        values, vectors = np.linalg.eigh(profile.g_covariance)
        kept = values > _NEGLIGIBLE * values[-1]
        total = np.zeros_like(stress)
        for column in (vectors[:, kept] * np.sqrt(values[kept])).T:
            lifted = ApparatusField.of_profile(replace(profile, g=column))
            total += _convolved(x, y, stress, lifted) ** 2
        radius = np.hypot.outer(g.y, g.x)
        round_errors = np.interp(radius, profile.r, profile.g_errors)
        rest = np.maximum(g.g_errors**2 - round_errors**2, 0.0)
        # Such errors are alike within a Gaussian patch, and independent beyond.
        width = 1 / self.resolved_wavenumber
        smooth = _convolved(x, y, stress, replace(g, g=unit_gaussian(radius, width)))
        patch = 4 * np.pi * width**2
        return total + patch * np.maximum(_convolved(x, y, smooth**2, replace(g, g=rest)), 0.0)

    def _checked_field(self, x: ArrayLike, y: ArrayLike, sigma_zz: ArrayLike) -> FloatArray:
        """Return a field with which G over the plane can be convolved."""
        if self.order:
            raise InputError(
                f"Channel {self.sensor.channel} measures a component of a vector field.",
                cure="Give the radial profile of the shear, without y.",
            )
        stress = floats(sigma_zz)
        if stress.ndim != 2 or not np.isfinite(stress).all():
            raise InputError(
                "sigma_zz is no field (y, x) of finite stresses.",
                cure="Give an array of two axes without missing values.",
            )
        for name, values, size in (("x", x, stress.shape[-1]), ("y", y, len(stress))):
            axis = finite_vector(name, values)
            require_increasing(name, axis)
            if axis.size != size:
                raise InputError(
                    f"sigma_zz has shape {stress.shape}, but there are {axis.size} positions along "
                    f"{name}.",
                    cure="Give a field of shape (y, x).",
                )
            step = _step(axis)
            if np.abs(np.diff(axis) - step).max() > _UNEVEN * step:
                raise InputError(
                    f"The positions along {name} are not even.",
                    why="The field is convolved on its own lattice.",
                    cure="Interpolate it to even positions.",
                )
            self._require_fine(step)
        sizes = np.abs(stress)
        edge = max(sizes[[0, -1]].max(), sizes[:, [0, -1]].max())
        self._require_decayed(edge, sizes.max(), "the edge of the field")
        return stress

    def _require_fine(self, step: float) -> None:
        """Refuse a stress whose step (m) does not resolve G."""
        if step > self.gaussian_sigma / 2:
            raise InputError(
                f"The stress is given every {step * 1e3:.3g} mm, coarser than half the "
                f"width of the apparatus function ({self.gaussian_sigma * 1e3:.3g} mm).",
                cure="Give the stress on a finer grid.",
            )

    def _require_decayed(self, left: float, peak: float, end: str) -> None:
        """Refuse a stress of which a share of its peak is left at its end."""
        if left > _DECAYED * peak:
            raise InputError(
                f"{left / peak:.1%} of the largest stress is left at {end}.",
                why="A convolution needs the stress out to where it has decayed.",
                cure="Extend the table.",
            )

    def _at(self, values: FloatArray, r: ArrayLike) -> FloatArray:
        radii = np.abs(floats(r))
        if np.isnan(radii).any():
            raise InputError("A radius is not a number.", cure="Leave missing radii out.")
        support = self.radial_profile.r
        spline = radial_spline(support, values)
        return np.where(radii <= support[-1], spline(np.minimum(radii, support[-1])), 0.0)

    def _checked(
        self, r: ArrayLike, sigma_zz: ArrayLike | IdealReference
    ) -> tuple[FloatArray, RadialSpectrum]:
        """Return radii and the transform of a stress with which G can be convolved."""
        radii = finite_vector("r", r)
        if isinstance(sigma_zz, IdealReference):
            radii = np.abs(radii)
            nodes = self._nodes(radii.max())
            order = ACROSS if sigma_zz.shape == "slit" else 0
            return radii, RadialSpectrum(nodes, sigma_zz.transform(nodes.k), order)
        stress = finite_vector("sigma_zz", sigma_zz)
        if radii.shape != stress.shape:
            raise InputError(f"r and sigma_zz differ in length: {radii.size} and {stress.size}.")
        require_increasing("r", radii)
        if radii[-1] > _LARGEST_RADIUS:
            raise InputError(
                f"r reaches {radii[-1]:g} m.", cure="Give radii in metres, not millimetres."
            )
        if radii.size < _FEWEST_RADII:
            raise InputError(f"A stress at {radii.size} radii cannot be interpolated.")
        if not 0 <= radii[0] <= radii[1] - radii[0]:
            raise InputError(
                f"r begins at {radii[0]:g} m.",
                cure="Give the stress from the axis (r = 0) outward.",
            )
        # A step matters only where there is stress.
        peak = np.abs(stress).max()
        strong = np.maximum(np.abs(stress[1:]), np.abs(stress[:-1])) > _DECAYED * peak
        coarse = np.diff(radii)[strong].max(initial=0.0)
        self._require_fine(coarse)
        end = f"the end of the table, r = {radii[-1] * 1e3:.4g} mm"
        self._require_decayed(abs(stress[-1]), peak, end)
        nodes = self._nodes(radii[-1])
        values = hankel_transform(radii, stress, nodes.k, order=self.order)
        return radii, RadialSpectrum(nodes, values, self.order)

    def _nodes(self, reach: float) -> Wavenumbers:
        """Nodes for a stress out to ``reach`` (m): G is zero beyond the last one of its grid."""
        return Wavenumbers.covering(self.transfer.k[-1], reach + self.radial_profile.r[-1])


def _step(axis: ArrayLike) -> float:
    """Mean step of positions."""
    return float(np.ptp(axis)) / max(np.size(axis) - 1, 1)


def _convolved(x: ArrayLike, y: ArrayLike, stress: FloatArray, g: ApparatusField) -> FloatArray:
    """Convolve a field with a kernel over the plane, on the field's own lattice."""
    from scipy.interpolate import RectBivariateSpline
    from scipy.signal import fftconvolve

    offsets = []
    cell = 1.0
    for axis, own in ((x, g.x), (y, g.y)):
        step = _step(axis)
        reach = int(np.abs(own).max() / step)
        offsets.append(step * np.arange(-reach, reach + 1))
        cell *= step
    kernel = RectBivariateSpline(g.y, g.x, g.g)(offsets[1], offsets[0])
    return fftconvolve(stress, kernel, mode="same") * cell


def load_apparatus(path: str | PathLike[str], *, accept_altered: bool = False) -> ApparatusFunction:
    """Read an apparatus function from its artifact.

    Parameters
    ----------
    path : path-like
        A file written by ``memscal calibrate`` or :meth:`ApparatusFunction.save`.
    accept_altered : bool
        Accept a file whose content does not fit its digest: ``source.altered`` records it.

    Returns
    -------
    ApparatusFunction
        The calibrated sensor; ``source`` names its file.

    Raises
    ------
    FormatError
        If the file is no artifact, is damaged, or was changed after it was written.
    SchemaVersionError
        If it was written under a newer major version of the format.

    Examples
    --------
    >>> import memscal, tempfile
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     apparatus.save(f"{folder}/sensor.h5")
    ...     memscal.load_apparatus(f"{folder}/sensor.h5").gaussian_sigma == apparatus.gaussian_sigma
    True
    """
    from memscal.formats.artifact import artifact_from
    from memscal.formats.hdf5.reader import open_hdf5
    from memscal.formats.hdf5.writer import DIGEST_ATTRIBUTE

    with open_hdf5(path, accept_altered=accept_altered) as file:
        apparatus = ApparatusFunction(**vars(artifact_from(file)))
        # Written again, it might have another digest by rounding: the file's is kept.
        digest = str(file.attribute("/", DIGEST_ATTRIBUTE))
        vars(apparatus).update(source=file.source, content_digest=digest)
    return apparatus


def opened_apparatus(
    apparatus: ApparatusFunction | str | PathLike[str], *, accept_altered: bool = False
) -> ApparatusFunction:
    """Return the apparatus function, read from its artifact where it is a path."""
    if isinstance(apparatus, str | PathLike):
        return load_apparatus(apparatus, accept_altered=accept_altered)
    if not isinstance(apparatus, ApparatusFunction):
        raise InputError(
            f"{type(apparatus).__name__} is given where an apparatus function is needed.",
            cure="Give one, such as Calibration.apparatus, or the path of its artifact.",
        )
    return apparatus
