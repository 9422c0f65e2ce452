r"""Receptive fields of an array: what each sensor reads of a contact, by its place.

Per newton of a contact at r, sensor i reads :math:`H_i(r) = \sum_j C_{ij} A_j f_j(|r - c_j|)`, with

.. math::

    f_j(R) = \frac{1}{2\pi}\int \hat G_j T \hat p\,J_0(kR)\,k\,dk, \qquad
    g_j(R) = \frac{1}{2\pi}\int \hat G_j N \hat p\,J_1(kR)\,k\,dk,

the pressure's transform :math:`\hat p` per newton, and the film's transfer functions T and N
(:mod:`memscal.mechanics.film_response`).  A shear force Q along x that is spread as the pressure is
adds :math:`\cos\phi\,g_j` per newton: its first moment along x is h, which is the balance of
moments.  T is that of a linear film and, where the film's law is another one, a change of it that
grows with the depth of the contact in a linear film.  At the depth of the scan's rod it is the one
that makes the calculated stress of the calibration: a contact like it reads what was measured.
"""

from __future__ import annotations

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers, radial_spline
from memscal.errors import DomainError
from memscal.estimation.reference_spectra import rod_spectrum
from memscal.extensions.arrays.array_data import ALL, ArrayData
from memscal.measurement.posterior import film_changes, film_transfer, per_pressure
from memscal.mechanics.contact import Contact
from memscal.mechanics.film_response import base_response
from memscal.mechanics.indent import indent
from memscal.model.arrays import (
    ArrayPair,
    FloatArray,
    IndexArray,
    array_record,
    floats,
)
from memscal.model.film import LINEAR
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.scan import SetUp

#: The film passes nothing beyond this wavenumber times its thickness.
_LARGEST_KH = 20.0
#: Contacts are sought so many thicknesses beyond the sensors; steps of the tables in one thickness.
MARGIN = 2.0
_STEPS = 200
#: Loads of the tables over that of the calibration, which is one of them.
_LOADS = np.geomspace(1 / 64, 16.0, 21)
#: A film of another law than a linear one is known to so many depths of the scan's rod: at two the
#: stress per newton is 4 % off.
_DEEPEST = 1.5
#: A radius in place of zero, as a share of the tables' step.
_AXIS = 1e-6


@array_record
class ReceptiveFields:
    """Tables of the fields of an array under an indenter; n sensors are used of it.

    Made by :func:`receptive_fields`.  Places are (m, 2) in m, forces (m,) in N, shears (m, 2)
    forces along x and y over the normal one.
    """

    array: ArrayData
    sensors: IndexArray  # (n,): which are used
    centres: FloatArray  # (n, 2)
    mixing: FloatArray  # (n, n): C_ij A_j
    radii: FloatArray  # (r,): evenly spaced, in m
    loads: FloatArray  # (q,): of the tables, in N
    contact_radii: FloatArray  # (q,): in m
    # f, f'/R, -g/R and -(g/R)'/R per newton: (4, loads, kernels, radii).
    profiles: FloatArray
    # Changes of f by the kernels' modes and by inputs that the contact has, too, (changes, radii);
    # whose sensor's each is, or ALL; and their sizes by one u of each independent error.
    changes: FloatArray
    owner: IndexArray
    sizes: FloatArray  # (changes, c)

    unit = "N"

    @property
    def most(self) -> float:
        """The force (N) up to which the tables reach; of one table, any."""
        return float(self.loads[-1]) if self.loads.size > 1 else np.inf

    def radius(self, force: FloatArray) -> FloatArray:
        """Contact radii (m) under forces."""
        # Hertz has them as P^(1/3).
        return np.interp(np.cbrt(force), np.cbrt(self.loads), self.contact_radii)

    def value(self, places: FloatArray, force: FloatArray | float = 1.0) -> FloatArray:
        """Fields per newton without shear, (m, n)."""
        [value] = self._looked_up(self._offsets(places), force, columns=1)
        return floats(value @ self.mixing.T)

    def normal(self, places: FloatArray, force: FloatArray | float = 1.0) -> FloatArray:
        """Their derivatives by x and y, and they themselves, (3, m, n)."""
        offsets = self._offsets(places)
        value, slope = self._looked_up(offsets, force, columns=2)
        return floats(np.stack([*(offsets * slope), value]) @ self.mixing.T)

    def forward(self, places: FloatArray, force: FloatArray, shear: FloatArray) -> ArrayPair:
        """Readings (m, n), and their derivatives by x, y, force and the two shears, (m, n, 5)."""
        slopes = self.mixing @ self._sources(places, force, shear)
        slopes[..., [0, 1, 3, 4]] *= force[:, None, None]
        # How the stress per newton changes with the force is left out of its derivative.
        return force[:, None] * slopes[..., 2], slopes

    def errors(self, places: FloatArray, force: FloatArray, shear: FloatArray) -> FloatArray:
        """Changes of the readings by one u of each independent error of the array, (m, n, c)."""
        array = self.array
        sources = self._sources(places, force, shear)[..., :3]
        by_strength, by_x, by_y, by_pair, _ = array.split(array.columns)
        # A sensor that is elsewhere is one whose contact is on the other side.
        moves = np.stack([-by_x, -by_y, by_strength])[:, self.sensors]
        own = np.einsum("mnf,fnc->mnc", sources, moves)
        apart = np.linalg.norm(places[:, None] - self.centres, axis=-1)
        for change, owner, size in zip(self.changes, self.owner, self.sizes, strict=True):
            has = (owner == ALL) | (self.sensors == owner)
            own += (has * np.interp(apart, self.radii, change))[..., None] * size
        moved = self.mixing @ own
        known = array.used[array.pairs].all(axis=1)
        rows_of, others = (np.cumsum(array.used) - 1)[array.pairs[known]].T
        read = sources[..., 2] * array.conversion_constants[self.sensors]
        for row, other, size in zip(rows_of, others, by_pair[known], strict=True):
            moved[:, row] += read[:, other, None] * size
        return floats(force[:, None, None] * moved)

    def _sources(
        self, places: FloatArray, force: FloatArray | float, shear: FloatArray
    ) -> FloatArray:
        """Return what :meth:`forward` does per newton, of each sensor alone, (m, n, 5)."""
        offsets = self._offsets(places)
        value, slope, towards, turned = self._looked_up(offsets, force, columns=4)
        pull = np.einsum("kmn,mk->mn", offsets, shear)
        along = offsets * (slope + pull * turned)
        along += shear.T[..., None] * towards
        return np.stack([*along, value + pull * towards, *offsets * towards], axis=-1)

    def _offsets(self, places: FloatArray) -> FloatArray:
        """Return places from the centre of each sensor, (2, m, n)."""
        return np.subtract(places.T[..., None], self.centres.T[:, None], order="C")

    def _looked_up(
        self, offsets: FloatArray, force: FloatArray | float, *, columns: int
    ) -> FloatArray:
        """Return the first of the profiles at offsets and forces, (columns, m, n), interpolated."""
        _, loads, kernels, radii = self.profiles.shape
        table = self.profiles[:columns].reshape(columns, -1)
        x, y = offsets
        apart = np.sqrt(x**2 + y**2) / self.radii[1]
        apart = np.minimum(apart, radii - 1 - _AXIS)
        near = apart.astype(np.intp)
        share = apart - near
        near += radii * (np.arange(self.sensors.size) % kernels)
        # The stress falls by the square of the contact radius, which Hertz has as P^(2/3).
        pressed = np.maximum(force, 0.0)
        place = np.interp(np.power(pressed, 2 / 3), self.loads ** (2 / 3), np.arange(loads))
        place = np.reshape(place, (-1, 1))
        found = np.zeros((columns, *apart.shape))
        for above in range(min(loads, 2)):
            level = np.floor(place) + above
            first = near + kernels * radii * np.minimum(level, loads - 1).astype(np.intp)
            lower = table.take(first, axis=1)
            between = lower + share * (table.take(first + 1, axis=1) - lower)
            found += (1 - np.abs(place - level)) * between
        return found


def receptive_fields(array: ArrayData, indenter: RoundIndenter | None = None) -> ReceptiveFields:
    """Return the fields of an array under a rod or a sphere that slides freely, or at a point."""
    film = array.film.expected
    sensors = np.flatnonzero(array.used)
    centres = array.places[sensors]
    reach = float(np.linalg.norm(np.ptp(centres, axis=0) + 2 * MARGIN * film.thickness))
    nodes = Wavenumbers.covering(_LARGEST_KH / film.thickness, reach)
    radii = np.arange(0.0, reach, film.thickness / _STEPS)
    kernels = array.kernels[sensors] if len(array.kernels) > 1 else array.kernels
    at = np.minimum(nodes.k, array.k[-1])
    kernels = radial_spline(array.k, kernels.T)(at).T
    set_up = SetUp(film, array.indenter, array.load, None)
    linear_film = film.law == LINEAR
    depth = indent(film, array.indenter, load=array.load, strain="linear").depth
    deepest = np.inf if linear_film else _DEEPEST * depth
    contacts = _contacts(set_up, indenter, deepest)
    loads, depths, contact_radii = floats([[c.load, c.depth, c.contact_radius] for c in contacts]).T
    pressures = np.ones((loads.size, nodes.k.size))
    if indenter is None:
        contact_radii = np.zeros(loads.size)
    else:
        transforms = [one.traction.pressure_transform(nodes.k) for one in contacts]
        pressures = 2 * np.pi * floats(transforms) / loads[:, None]
    by_pressure, by_shear = base_response(nodes.k * film.thickness, film.poisson_ratio)
    linear = RadialSpectrum(nodes, by_pressure)
    if array.reference is None:
        change = film_transfer(set_up, nodes) - by_pressure
    else:
        of_rod = array.load * radial_spline(array.k, array.reference)(at)
        change = per_pressure(set_up, linear, of_rod - rod_spectrum(set_up, linear, LINEAR))
    share = np.where(linear_film, 1.0, depths / depth)
    transfers = by_pressure + share[:, None] * change

    spectra = ((pressures * transfers)[:, None] * kernels).reshape(-1, nodes.k.size).T
    # A sensor is seen from the contact in the direction opposite to their offset.
    columns = _by_radius(nodes, radii, spectra, -(by_shear / by_pressure)[:, None])
    shape = (len(columns), loads.size, len(kernels), radii.size)

    # What is uncertain is taken at the middle load, and of the mean kernel.
    modes = radial_spline(array.k, array.modes.changes.T)(at).T * (by_pressure + change)
    names = [*array.effects]
    inputs = {n: c for n, c in film_changes(set_up, nodes).items() if n in names}
    changes = np.vstack([modes, *(kernels.mean(axis=0) * change for change in inputs.values())])
    changes = changes * pressures[loads.size // 2]
    first = array.root.shape[1]
    column = [first + names.index(name) for name in inputs]
    by_input = np.eye(array.columns.shape[1])[column]
    return ReceptiveFields(
        array=array,
        sensors=sensors,
        centres=centres,
        mixing=(array.crosstalk * array.conversion_constants)[np.ix_(sensors, sensors)],
        radii=radii,
        loads=loads,
        contact_radii=contact_radii,
        profiles=np.ascontiguousarray(columns.swapaxes(1, 2)).reshape(shape),
        changes=nodes.synthesise(changes.T, radii).T,
        owner=np.append(array.modes.owner, np.full(len(inputs), ALL)),
        sizes=np.vstack([array.split(array.columns)[4], by_input]),
    )


def _by_radius(
    nodes: Wavenumbers, radii: FloatArray, spectra: FloatArray, ratio: FloatArray
) -> FloatArray:
    """Return fields and their slopes over the radius, by pressure and by shear, (4, radii, m)."""
    falling = -nodes.k[:, None] * spectra
    r = np.maximum(radii, _AXIS * radii[1])
    columns = np.array(
        [
            nodes.synthesise(spectra, r),
            nodes.synthesise(falling, r, order=1) / r[:, None],
            nodes.synthesise(ratio * spectra, r, order=1) / r[:, None],
            nodes.synthesise(ratio * falling, r, order=2) / r[:, None] ** 2,
        ]
    )
    # Beyond the tables there is nothing.
    columns[:, -1] = 0.0
    return columns


def _contacts(set_up: SetUp, indenter: RoundIndenter | None, deepest: float) -> list[Contact]:
    """Press an indenter, or the scan's rod, on a linear film, as deep as it goes or is asked."""
    film, rod, load, _ = set_up
    pressed = indenter or rod
    # Where nothing changes with the load one table serves them all.
    constant = film.law == LINEAR and isinstance(pressed, Rod)
    contacts: list[Contact] = []
    for factor in [1.0] if constant else _LOADS:
        try:
            contact = indent(film, pressed, load=factor * load, strain="linear")
        except DomainError:
            if contacts:
                break
            raise
        if contact.depth > deepest:
            break
        contacts.append(contact)
    return contacts
