r"""Receptive fields of an array: what each sensor reads of a contact, by its place.

Per newton of a contact at r, sensor i reads :math:`H_i(r) = \sum_j C_{ij} A_j f_j(|r - c_j|)`, with

.. math::

    f_j(R) = \frac{1}{2\pi}\int \hat G_j T \hat p\,J_0(kR)\,k\,dk, \qquad
    g_j(R) = \frac{1}{2\pi}\int \hat G_j N \hat p\,J_1(kR)\,k\,dk,

the pressure's transform :math:`\hat p` per newton, and the film's transfer functions T and N
(:mod:`memscal.mechanics.film_response`).  A shear force Q along x that is spread as the pressure is
adds :math:`\cos\phi\,g_j` per newton: its first moment along x is h, which is the balance of
moments.  T is that by which the rod of the scan makes the calculated stress of the calibration, so
that a contact like it reads what was measured, whatever the law of the film.
"""

from __future__ import annotations

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers, radial_spline
from memscal.errors import DomainError
from memscal.estimation.reference_spectra import rod_spectrum
from memscal.extensions.arrays.array_data import ALL, ArrayData
from memscal.measurement.posterior import film_changes, film_transfer, per_pressure
from memscal.mechanics.film_response import base_response
from memscal.mechanics.indent import indent
from memscal.model.arrays import (
    ArrayPair,
    Arrays,
    ArrayTriple,
    FloatArray,
    IndexArray,
    array_record,
    floats,
)
from memscal.model.film import LINEAR, ElasticFilm, more_and_less
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.scan import SetUp

#: The film passes nothing beyond this wavenumber times its thickness.
_LARGEST_KH = 20.0
#: Contacts are sought so many thicknesses beyond the sensors; steps of the tables in one thickness.
MARGIN = 2.0
_STEPS = 200
#: Loads over that of the calibration at which a sphere is pressed.
_LOADS = tuple(np.geomspace(0.01, 20.0, 12))
#: A radius in place of zero, as a share of the tables' step.
_AXIS = 1e-6
#: Parameters of a contact: x, y, force, and shear over force along x and y.
CONTACT = 5


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
    step: float  # of the radii, in m
    owner: IndexArray  # (n,): which kernel
    loads: FloatArray  # (q,): of the tables, in N
    contact_radii: FloatArray  # (q,): in m
    # f, f'/R, -g/R and -(g/R)'/R per newton, (kernels, loads, radii, 4).
    profiles: FloatArray
    of_modes: FloatArray  # (radii, modes): changes of f by the kernels' modes
    of_inputs: Arrays  # (radii,) each: changes of f by stated inputs that the contact has, too

    @property
    def unit(self) -> str:
        """Unit of what the fields are given per."""
        return "N"

    def radius(self, force: FloatArray) -> FloatArray:
        """Contact radii (m) under forces."""
        return np.interp(force, self.loads, self.contact_radii)

    def normal(self, places: FloatArray, force: FloatArray | None = None) -> ArrayTriple:
        """Fields per newton without shear, and their derivatives by x and y, (m, n) each."""
        offsets = places[:, None] - self.centres
        table, _ = self._looked_up(offsets, force, 2)
        along = offsets * table[..., 1:]
        fields = (
            self.mixing @ values.T for values in (table[..., 0], along[..., 0], along[..., 1])
        )
        h, by_x, by_y = (values.T for values in fields)
        return h, by_x, by_y

    def forward(self, places: FloatArray, force: FloatArray, shear: FloatArray) -> ArrayPair:
        """Readings (m, n), and their derivatives by x, y, force and the two shears, (m, n, 5)."""
        value, along, towards, growth = self._sources(places, force, shear)
        scale = force[:, None, None]
        slopes = np.concatenate([scale * along, (value + growth)[..., None], scale * towards], -1)
        mixed = self.mixing @ np.concatenate([value[..., None], slopes], axis=-1)
        return force[:, None] * mixed[..., 0], mixed[..., 1:]

    def errors(self, places: FloatArray, force: FloatArray, shear: FloatArray) -> FloatArray:
        """Changes of the readings by one u of each independent error of the array, (m, n, c)."""
        array = self.array
        value, along, *_ = self._sources(places, force, shear)
        inputs = [*array.effects, *(self.of_inputs.keys() - array.effects.keys())]
        unmoved = np.zeros(len(array.root))
        by_input = [array.effects.get(name, unmoved) for name in inputs]
        columns = np.column_stack([array.root, *by_input])
        strengths, x, y, by_pair, by_mode = array.split(columns)
        by_strength, by_x, by_y = (rows[self.sensors] for rows in (strengths, x, y))
        own = value[..., None] * by_strength
        own -= along[..., :1] * by_x + along[..., 1:] * by_y
        apart = np.linalg.norm(places[:, None] - self.centres, axis=-1)
        if by_mode.size:
            owner = array.modes.owner
            has = np.equal(owner, ALL) | np.equal.outer(self.sensors, owner)
            own += (has * self._interpolated(self.of_modes, apart)) @ by_mode
        first = array.root.shape[1]
        for i, name in enumerate(inputs, first):
            if name in self.of_inputs:
                own[..., i] += self._interpolated(self.of_inputs[name], apart)
        changes: FloatArray = self.mixing @ own
        number = np.full(len(array.sensors), -1)
        number[self.sensors] = np.arange(self.sensors.size)
        pairs = number[array.pairs]
        known = (pairs >= 0).all(axis=1)
        rows, others = pairs[known].T
        read = value * array.conversion_constants[self.sensors]
        by_crosstalk = read[:, others, None] * by_pair[known]
        # Several pairs have the same row.
        np.add.at(changes.swapaxes(0, 1), rows, by_crosstalk.swapaxes(0, 1))
        return np.asarray(force[:, None, None] * changes)

    def _sources(self, places: FloatArray, force: FloatArray, shear: FloatArray) -> FieldParts:
        """Return f of each sensor alone, and its derivatives by place, shear, and ln force."""
        offsets = places[:, None] - self.centres
        table, growth = self._looked_up(offsets, force, 4)
        pull = np.einsum("mnk,mk->mn", offsets, shear)
        value = table[..., 0] + pull * table[..., 2]
        along = offsets * (table[..., 1] + pull * table[..., 3])[..., None]
        along += shear[:, None] * table[..., 2:3]
        return value, along, offsets * table[..., 2:3], growth[..., 0] + pull * growth[..., 2]

    def _looked_up(self, offsets: FloatArray, force: FloatArray | None, columns: int) -> ArrayPair:
        """Return the profiles at offsets, (m, n, columns), and their change with ln force."""
        _, loads, radii, _ = self.profiles.shape
        table = self.profiles[..., :columns].reshape(-1, columns)
        apart = np.sqrt(np.einsum("mnk,mnk->mn", offsets, offsets)) / self.step
        apart = np.minimum(apart, radii - 1.001)
        start = apart.astype(np.intp)
        share = (apart - start)[..., None]
        start += self.owner * (loads * radii)

        def at(first: IndexArray) -> FloatArray:
            lower = table.take(first, axis=0)
            return floats(lower + share * (table.take(first + 1, axis=0) - lower))

        if loads == 1:
            found = at(start)
            return found, np.zeros_like(found)
        force = np.full(len(offsets), self.array.load) if force is None else force
        steps = np.log(self.loads)
        wanted = np.clip(np.log(np.maximum(force, self.loads[0])), steps[0], steps[-1])
        level = np.minimum(np.searchsorted(steps, wanted, side="right"), loads - 1) - 1
        less, more = (at(start + radii * (level + i)[:, None]) for i in (0, 1))
        slope = (more - less) / (steps[level + 1] - steps[level])[:, None, None]
        return less + (wanted - steps[level])[:, None, None] * slope, slope

    def _interpolated(self, table: FloatArray, apart: FloatArray) -> FloatArray:
        """Return what stands in a table (radii,) or (radii, c) at distances."""
        place = np.minimum(apart / self.step, len(table) - 1.001)
        start = place.astype(np.intp)
        share = (place - start).reshape(*place.shape, *(1,) * (table.ndim - 1))
        return (1 - share) * table[start] + share * table[start + 1]


#: Value, by place, by shear, by ln force.
FieldParts = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def receptive_fields(array: ArrayData, indenter: RoundIndenter | None = None) -> ReceptiveFields:
    """Return the fields of an array under a rod or a sphere that slides freely, or at a point."""
    film = array.film.expected
    sensors = np.flatnonzero(array.used)
    centres = array.places[sensors]
    reach = float(np.linalg.norm(np.ptp(centres, axis=0) + 2 * MARGIN * film.thickness))
    nodes = Wavenumbers.covering(_LARGEST_KH / film.thickness, reach)
    radii = np.arange(0.0, reach, film.thickness / _STEPS)
    step = radii[1]
    radii[0] = _AXIS * step
    at = np.minimum(nodes.k, array.k[-1])
    own = array.kernels[sensors] if len(array.kernels) > 1 else array.kernels
    kernels = radial_spline(array.k, own.T)(at).T
    loads, contact_radii, pressures = _pressures(film, indenter, array.load, nodes.k)
    set_up = SetUp(film, array.indenter, array.load, None)
    by_pressure, by_shear = base_response(nodes.k * film.thickness, film.poisson_ratio)
    transfer = film_transfer(set_up, nodes)
    if array.reference is not None:
        linear = RadialSpectrum(nodes, by_pressure)
        stress = array.load * radial_spline(array.k, array.reference)(at)
        change = stress - rod_spectrum(set_up, linear, LINEAR)
        transfer = by_pressure + per_pressure(set_up, linear, change)

    spectra = (kernels[:, None] * (transfer * pressures)).reshape(-1, nodes.k.size).T
    falling = -nodes.k[:, None] * spectra
    # A sensor is seen from the contact in the direction opposite to their offset.
    ratio = -(by_shear / by_pressure)[:, None]
    r = radii[:, None]
    columns = np.array(
        [
            nodes.synthesise(spectra, radii),
            nodes.synthesise(falling, radii, order=1) / r,
            nodes.synthesise(ratio * spectra, radii, order=1) / r,
            nodes.synthesise(ratio * falling, radii, order=2) / r**2,
        ]
    )
    shape = (len(kernels), loads.size, radii.size, len(columns))
    # From (columns, radii, kernels and loads).
    profiles = np.ascontiguousarray(columns.transpose(2, 1, 0)).reshape(shape)

    # What is uncertain is taken at the middle load, and of the mean kernel.
    pressure = pressures[len(pressures) // 2]
    modes = radial_spline(array.k, array.modes.changes.T)(at)
    mean = kernels.mean(axis=0)
    changes = {name: change * pressure for name, change in film_changes(set_up, nodes).items()}
    ends = more_and_less(indenter, "radius") if indenter else None
    if ends:
        more, less, share = ends
        upper, lower = (_pressures(film, i, array.load, nodes.k)[2] for i in (more, less))
        name = "rod_radius" if indenter == array.indenter else "indenter"
        middle = len(upper) // 2
        changes[name] = share * transfer * (upper[middle] - lower[middle])
    return ReceptiveFields(
        array=array,
        sensors=sensors,
        centres=centres,
        mixing=(array.crosstalk * array.conversion_constants)[np.ix_(sensors, sensors)],
        step=step,
        owner=np.arange(sensors.size) % len(kernels),
        loads=loads,
        contact_radii=contact_radii,
        profiles=profiles,
        of_modes=nodes.synthesise(modes * (transfer * pressure)[:, None], radii),
        of_inputs={
            name: nodes.synthesise(mean * change, radii) for name, change in changes.items()
        },
    )


def _pressures(
    film: ElasticFilm, indenter: RoundIndenter | None, load: float, k: FloatArray
) -> ArrayTriple:
    """Return loads, contact radii, and transforms of the pressure per newton, (loads, nodes)."""
    if indenter is None:
        return np.array([load]), np.zeros(1), np.ones((1, k.size))
    loads = [load]
    if not isinstance(indenter, Rod):
        loads = [load * share for share in _LOADS]
    while True:
        try:
            contacts = indent(film, indenter, load=loads, strain="linear")
            break
        except DomainError:
            # The largest loads go through the film.
            loads = loads[:-1]
            if not loads:
                raise
    transforms = [2 * np.pi * one.traction.pressure_transform(k) / one.load for one in contacts]
    radii = [one.contact_radius for one in contacts]
    return np.array(loads), np.array(radii), np.array(transforms)
