"""Contact of a rigid indenter with a bonded film: tractions, displacements, stress at the base."""

import math
from collections.abc import Callable
from dataclasses import field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import DomainError, InputError
from memscal.mechanics.film_response import InterfaceTraction
from memscal.mechanics.interface import Interface
from memscal.mechanics.surface import FilmField
from memscal.model.arrays import FloatArray, floats, keyword_array_record
from memscal.model.field_mesh import FieldMesh
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm
from memscal.model.indenter import Indenter, Rod
from memscal.model.result import Result
from memscal.model.stress import StressProfile

# Steps and reach of a profile's default radii near the contact and far from it, in film
# thicknesses: a cubic spline through them is good to 1e-6 of the maximum.
_NEAR_STEP = 0.02
_FAR_STEP = 0.05
_NEAR_REACH = 6.0
_FAR_REACH = 26.0
# The profile ends where the stress stays below this fraction of its maximum.
_PROFILE_FLOOR = 1e-9
# Radii at which the largest interface pressure and base stress are sought; the latter is smooth.
_PRESSURE_SAMPLES = 2001
_BASE_SAMPLES = 128


@keyword_array_record
class Contact(Result):
    r"""A rigid indenter pressed on a bonded film, solved; from :func:`memscal.indent`.

    Parameters
    ----------
    film, indenter, interface
        What was pressed on what, and what was between them.
    load, depth : float
        Normal load :math:`P`, in N, and indentation depth :math:`\delta`, in m.
    contact_radius, stick_radius : float
        Radius of the contact, and of its part that sticks, in m.  Where the interface is normally
        compliant the contact ends where the pressure has fallen to a thousandth of its largest.
    friction : float
        Amontons' coefficient; ``inf`` for a contact that sticks wherever it touches, ``nan``
        midway between sticking and sliding.
    loading, strain, backend : str
        As of :func:`memscal.indent`; ``loading`` is ``""`` where it makes no difference (a rod).
    convergence : float
        Largest change of base stress, load and depth under refinement, relative to the largest
        stress, the load and the depth.
    steps, discretisation : int, str
        Steps of the loading from the untouched film; what was refined, in words.
    traction, inside : InterfaceTraction, FilmField
        Pressure and shear at the interface; the field in the film.
    elastic_energy : float
        Energy stored in the film, in J.
    work, dissipated_energy : float or None
        Work done by the indenter and lost to friction on the way, in J; ``None`` for a contact
        that is loaded in one step, which has no way.

    Notes
    -----
    Stresses are in Pa at radii in m.  Normal stress is positive in compression.  Shear is the
    traction on the film, positive outward, at both faces: that of the base is negative.

    Examples
    --------
    >>> from memscal.mechanics.indent import indent
    >>> from memscal.model.indenter import Rod
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> contact = indent(film, Rod(radius=0.25e-3), load=1.0)
    >>> [round(float(s)) for s in contact.base_stress([0.0, 1e-3, 4e-3])]
    [181805, 92873, 102]
    """

    film: ElasticFilm
    indenter: Indenter
    load: float
    depth: float
    contact_radius: float
    stick_radius: float
    friction: float
    loading: str
    backend: str
    convergence: float
    steps: int
    discretisation: str
    traction: InterfaceTraction
    inside: FilmField
    elastic_energy: float
    work: float | None
    dissipated_energy: float | None
    interface: Interface = field(default_factory=Interface)
    strain: str = "linear"

    unit = "Pa"
    form = None

    def __repr__(self) -> str:
        """Return what was pressed, load, depth and radius in place of the field."""
        return (
            f"<Contact: {self.indenter.shape}, {self.load:.4g} N, depth {self.depth * 1e6:.4g} um, "
            f"radius {self.contact_radius * 1e3:.4g} mm, friction {self.friction:.4g}>"
        )

    @property
    def film_of_law(self) -> ElasticFilm:
        """The film, with the law by which it was solved."""
        if self.strain == "linear":
            return replace(self.film, law=LINEAR, mooney_rivlin_ratio=None)
        law = self.film.law if self.film.law not in ("", LINEAR) else NEO_HOOKEAN
        return replace(self.film, law=law)

    def base_stress(self, r: ArrayLike) -> FloatArray:
        r"""Return the normal stress :math:`\sigma_{zz}` at the base in Pa, compression positive.

        At radii ``r`` from 0 upward, in m, of any shape; zero where it has decayed below 1e-13 of
        its maximum.
        """
        return self.inside.base(_radii(r), 0)

    def base_spectrum(self, k: ArrayLike) -> FloatArray:
        r"""Return the two-dimensional Fourier transform of the base stress, in N.

        At ``k`` in rad/m, of any shape and sign:
        :math:`2\pi\int\sigma_{zz}\,J_0(kr)\,r\,dr`, which is the load at k = 0.
        """
        return self.inside.spectrum(abs(floats(k)), 0)

    def base_shear(self, r: ArrayLike) -> FloatArray:
        r"""Return the radial traction of the base on the film, in Pa, positive outward.

        As :meth:`base_stress`; with the third axis from base to surface it is
        :math:`-\sigma_{rz}`, and it is negative where the film is squeezed outward.
        """
        return self.inside.base(_radii(r), 1)

    def base_shear_spectrum(self, k: ArrayLike) -> FloatArray:
        r"""Return the Hankel transform of order one of the base shear, in N.

        At ``k`` in rad/m, of any shape and sign: :math:`2\pi\int\tau\,J_1(kr)\,r\,dr` of
        :meth:`base_shear`, which is odd in k and zero at k = 0.
        """
        signed = floats(k)
        return np.sign(signed) * self.inside.spectrum(abs(signed), 1)

    def interface_pressure(self, r: ArrayLike) -> FloatArray:
        """Return the pressure between indenter and film in Pa; zero outside the contact.

        Under a rod it grows without bound towards the edge; the edge itself counts as outside.
        """
        return self.traction.pressure(_radii(r))

    def interface_shear(self, r: ArrayLike) -> FloatArray:
        """Return the radial traction on the film in Pa, positive outward; zero outside."""
        return self.traction.shear(_radii(r))

    @property
    def max_interface_stress(self) -> float:
        """Largest pressure at the interface in Pa; ``inf`` under a rod, at its edge."""
        if isinstance(self.indenter, Rod):
            return math.inf
        r = np.linspace(0.0, self.contact_radius, _PRESSURE_SAMPLES)
        return float(np.max(self.traction.pressure(r)))

    @cached_property
    def max_base_stress(self) -> float:
        """Largest normal stress at the base, in Pa."""
        r = np.linspace(0.0, self.contact_radius + self.film.thickness, _BASE_SAMPLES)
        return float(np.max(self.base_stress(r)))

    def surface_depression(self, r: ArrayLike) -> FloatArray:
        """Return the normal displacement of the film's surface in m, positive into the film."""
        return self.inside.surface(_radii(r), 0)

    def surface_outward(self, r: ArrayLike) -> FloatArray:
        """Return the radial displacement of the film's surface in m, positive outward."""
        return self.inside.surface(_radii(r), 1)

    def mesh(self) -> FieldMesh:
        """Return displacement and stress in the whole film, on the mesh of its finite elements."""
        mesh: Callable[[], FieldMesh] | None = getattr(self.inside, "mesh", None)
        if not mesh:
            raise InputError(
                f'A contact that was solved with backend="{self.backend}" has no mesh.',
                cure='Press the indenter with backend="fem".',
            )
        return mesh()

    def profile(self, r: ArrayLike | None = None) -> StressProfile:
        """Return the stress at the base as a table, such as a calibration divides by.

        ``r`` (n,): increasing radii in m; by default 50 per film thickness near the contact and 20
        far from it, out to where the stress stays below 1e-9 of its maximum: a cubic spline
        through them is accurate to 1e-6 of the maximum.
        """
        if r is None:
            return self._default_profile
        return StressProfile(
            r=np.asarray(r),
            sigma_zz=self.base_stress(r),
            sigma_rz=self.base_shear(r),
            load=self.load,
            depth=self.depth,
            contact_radius=self.contact_radius,
            stick_radius=self.stick_radius,
            friction_coefficient=None if math.isnan(self.friction) else self.friction,
            loading=self.loading,
            film=self.film_of_law,
            indenter=self.indenter,
            solver=f"memscal, {self.backend} backend, {self.strain} strain",
            discretisation=self.discretisation,
            convergence=self.convergence,
            notes=f"Interface: {self.interface.description}." if not self.interface.rigid else "",
        )

    @cached_property
    def _default_profile(self) -> StressProfile:
        near = np.arange(0.0, self.contact_radius / self.film.thickness + _NEAR_REACH, _NEAR_STEP)
        far = near[-1] + np.arange(_FAR_STEP, _FAR_REACH - _NEAR_REACH, _FAR_STEP)
        radii = np.append(near, far) * self.film.thickness
        sigma_zz = abs(self.base_stress(radii))
        last = np.flatnonzero(sigma_zz >= _PROFILE_FLOOR * sigma_zz.max())[-1] + 2
        return self.profile(radii[:last])


BaseStress = StressProfile | Contact
"""A calculated stress at the base of a film, as a table or as the contact itself."""


def stress_table(stress: BaseStress) -> StressProfile:
    """Return a base stress as a table over the radius."""
    return stress.profile() if isinstance(stress, Contact) else stress


def too_deep(film: ElasticFilm, indenter: Indenter, load: float, depth: float) -> DomainError:
    """Return the error for an indenter that would pass through the film."""
    return DomainError(
        f"Under {load:g} N the {indenter.shape} would sink {depth * 1e6:.4g} um into a film of "
        f"{film.thickness * 1e6:.4g} um.",
        why="A film cannot be compressed by its whole thickness or more.",
        cure="Lower the load or the depth, or check the film's modulus and thickness and the size "
        f"of the {indenter.shape}.",
    )


def _radii(r: ArrayLike) -> FloatArray:
    radii = floats(r)
    if not np.all(np.isfinite(radii)):
        raise InputError("A radius is not finite.", cure="Leave missing positions out.")
    if np.any(radii < 0):
        raise InputError(
            f"A radius is {radii.min():g} m, but radii are not negative.",
            cure="Give distances from the indenter's axis, such as abs(x - centre).",
        )
    return radii
