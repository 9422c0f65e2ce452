r"""The voltage of a calculated contact, and how it follows the load: what a scan is prepared with.

Under a curved indenter the stress is not proportional to the load.  The frictionless contact at
:math:`P` and :math:`P(1 \pm 2\,\%)` gives :math:`\partial U/\partial\ln P`, by which points that
were measured at a somewhat different load are brought to the nominal one, and by which the scatter
of the loads becomes noise of the voltage.  Friction changes this derivative by a few percent of
itself: of a correction of a few percent, nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import DomainError
from memscal.measurement.posterior import sensor_transfer
from memscal.measurement.single_loads import SingleLoad, place_of
from memscal.mechanics.indent import indent
from memscal.model.validation import FloatArray

__all__ = ["ContactSignal", "contact_signal"]

_LARGEST_KH = 20.0
_LOAD_STEP = 0.02
#: Enough for 1e-4 of the derivative, in half the time that convergence to 1e-4 takes.
_RINGS = 24
#: Distances at which the profile is tabulated, out to the scan's width.
_DISTANCES = 401


@dataclass(frozen=True, eq=False)
class ContactSignal:
    """The frictionless contact at a nominal load as the sensor reports it.

    ``r`` (n,): distances from the centre, in m; ``voltage`` and ``by_load`` (n,): the voltage and
    its derivative by the logarithm of the load, in V; ``contact_radius`` in m.
    """

    r: FloatArray
    voltage: FloatArray
    by_load: FloatArray
    contact_radius: float

    def slope(self, distance: FloatArray) -> FloatArray:
        """Derivative of the voltage by the logarithm of the load, at distances in m, in V."""
        return np.asarray(np.interp(distance, self.r, self.by_load))

    def share(self, distance: float) -> float:
        """Voltage at a distance (m) over the largest."""
        return float(np.interp(distance, self.r, self.voltage) / self.voltage.max())


def contact_signal(part: SingleLoad, apparatus: ApparatusFunction) -> ContactSignal:
    """Calculate the frictionless contact of a part at its nominal load, and near it.

    Raises
    ------
    DomainError
        If the load is beyond what the model of the contact holds for.
    """
    scan, load = part.scan, part.load
    loads = load * np.array([1 - _LOAD_STEP, 1.0, 1 + _LOAD_STEP])
    try:
        contacts = indent(scan.film, scan.indenter, load=loads, rings=_RINGS)
    except DomainError as failure:
        raise DomainError(
            f"{place_of(scan, part)}: {failure.problem}",
            why="The measured stress is compared with a contact that the model cannot hold for.",
            cure="Leave that load out; check its unit.",
        ) from failure
    width = float(np.hypot(np.ptp(scan.x), 0.0 if scan.y is None else np.ptp(scan.y)))
    r = np.linspace(0.0, 1.5 * width, _DISTANCES)
    nodes = Wavenumbers.covering(_LARGEST_KH / scan.film.thickness, 3 * width)
    through = apparatus.conversion_constant * sensor_transfer(apparatus, nodes.k)
    spectra = np.stack([through * contact.base_spectrum(nodes.k) for contact in contacts], axis=1)
    below, at, above = nodes.synthesise(spectra, r).T
    return ContactSignal(r, at, (above - below) / (2 * _LOAD_STEP), contacts[1].contact_radius)
