"""Contacts on an array of sensors, as they are located frame by frame."""

from __future__ import annotations

import numpy as np

from memscal.model.arrays import FloatArray, FrozenArrays, IndexArray, keyword_array_record
from memscal.model.indenter import RoundIndenter
from memscal.model.quantities import MM
from memscal.model.result import Told


@keyword_array_record
class Contacts(FrozenArrays, Told):
    """Where contacts press on an array, and how strongly, as :meth:`SensorArray.locate` finds them.

    Attributes
    ----------
    x, y : ndarray, shape (frames,)
        Place of the contact, in m; NaN where none is found.  Of a row of sensors y is the row's.
    force : ndarray, shape (frames,)
        Normal force, in N; of an array of measured fields in presses like those of its scan.
    radius : ndarray, shape (frames,)
        Contact radius of the assumed indenter under that force, in m; 0 of a point.
    shear : ndarray, shape (frames, 2)
        Shear force along x and y, in N, as its prior and the readings have it.
    covariance : ndarray, shape (frames, 3, 3)
        Of x, y and force, by the noise, the unknown shear and the array's own uncertainty; NaN in
        the row and column of a place that the sensors do not tell (y of a row).
    p_value : ndarray, shape (frames,)
        Chance of residuals as large as these, or larger, if nothing is wrong (chi-square).
    flags : tuple of str
        What is to be said of each frame, parted by semicolons; empty where all is well:
        ``no reading``, ``too few readings``, ``no contact``, ``saturated`` (readings at a ceiling
        are left out), ``edge`` (more than half a film's thickness outside the sensors, or such a
        place, where small changes of readings are large forces, is not excluded), ``strong``
        (beyond the forces for which fields are calculated, 16 times that of the scan, or fewer
        where the film ends or is not linear: their field per newton holds), ``ambiguous`` (a place
        more than half a thickness away, or two steps of the raster of measured fields, explains
        the readings nearly as well), ``misfit`` (a p-value below 0.001).
    assumed_shear : float
        Standard deviation of each component of shear over normal force, before the readings.
    indenter : Rod, Sphere or None
        What was assumed to press; ``None``: a point.
    frame : ndarray, shape (frames,)
        Number of each frame.
    time : ndarray, shape (frames,), or None
        Time of each frame, in s.
    unit : str
        Unit of the forces: ``N``, or ``1`` of presses.

    Examples
    --------
    >>> import memscal
    >>> array = memscal.load_array("array.h5")  # doctest: +SKIP
    >>> contacts = array.locate(u, indenter=memscal.Rod(radius=0.25e-3))  # doctest: +SKIP
    >>> contacts.x, contacts.force, contacts.flags  # doctest: +SKIP
    """

    x: FloatArray
    y: FloatArray
    force: FloatArray
    radius: FloatArray
    shear: FloatArray
    covariance: FloatArray
    p_value: FloatArray
    flags: tuple[str, ...]
    assumed_shear: float
    indenter: RoundIndenter | None
    frame: IndexArray | FloatArray
    time: FloatArray | None = None
    unit: str = "N"

    def __repr__(self) -> str:
        """Return how many contacts there are, in place of arrays."""
        return f"<Contacts: {np.isfinite(self.force).sum()} in {len(self.flags)} frames>"

    @property
    def uncertainties(self) -> FloatArray:
        """Standard uncertainties (k = 1) of x, y and force, shape (frames, 3)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def pressed_by(self) -> str:
        """The assumed indenter, as the command line has it: ``point``, ``rod:0.25`` (in mm)."""
        one = self.indenter
        return "point" if one is None else f"{one.shape}:{one.radius / MM:g}"

    @property
    def assumed(self) -> str:
        """What was assumed of the contacts, in words."""
        if self.unit != "N":
            return "Assumed: presses like those of the scan; forces are in such presses."
        shear = f"shear over normal force of 0 ± {self.assumed_shear:g} (k = 1) along each axis"
        # Of a place that is not told the row's own holds.
        on_row = np.isnan(self.uncertainties[np.isfinite(self.force)]).any()
        where = ", on the line of the row" * bool(on_row)
        return f"Assumed: {self.pressed_by}{where}, {shear if self.assumed_shear else 'no shear'}."
