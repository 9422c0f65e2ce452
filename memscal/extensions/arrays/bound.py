"""The least uncertainty with which an array locates a contact: the Cramer-Rao bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.locate import Seeking, Touch, fields_of, steps
from memscal.model.arrays import FloatArray, finite_vector, frozen_array, require_positive


def bound(
    array: ArrayData,
    places: ArrayLike,
    force: ArrayLike = 1.0,
    indenter: Touch = "point",
    shear: float = 0.3,
) -> FloatArray:
    """Covariance of x, y and force by the noise, (m, 3, 3): :meth:`SensorArray.bound`."""
    stated = states(places, force, 0.0)
    require_positive("The least force", stated[:, 2].min(initial=np.inf), "N")
    seeking = replace(Seeking.on(array, indenter, shear), near=np.inf)
    residual, slopes = seeking.rows(np.zeros(1), stated)
    _, inverse = steps(residual, slopes)
    return seeking.covariance(inverse)


def predict(
    array: ArrayData, places: ArrayLike, force: ArrayLike, indenter: Touch, shear: ArrayLike
) -> FloatArray:
    """Readings of contacts, (m, n): :meth:`SensorArray.predict`."""
    fields = fields_of(array, indenter)
    state = states(places, force, shear)
    readings = np.full((len(state), len(array.sensors)), np.nan)
    readings[:, fields.sensors], _ = fields.forward(state[:, :2], state[:, 2], state[:, 3:])
    return readings


def states(places: ArrayLike, force: ArrayLike, shear: ArrayLike) -> FloatArray:
    """Return contacts as rows of x, y, force, and shear over force along x and y, (m, 5)."""
    at = np.atleast_2d(frozen_array(places, name="The array of places"))
    if at.ndim != 2 or at.shape[1] != 2:
        raise InputError(
            f"The places have shape {np.shape(places)}, but x and y of each are needed, (m, 2).",
            cure="Give rows of x and y in m.",
        )
    count = len(at)
    try:
        forces = np.broadcast_to(frozen_array(force), count)
        shears = np.broadcast_to(frozen_array(shear), (count, 2))
    except ValueError as error:
        raise InputError(
            f"Of {count} places the forces have shape {np.shape(force)}, and the shears "
            f"{np.shape(shear)}.",
            cure="Give one for all places, or one for each: a force, and x and y of the shear.",
        ) from error
    stated = np.column_stack([at, forces, shears])
    finite_vector("The array of places, forces and shears", stated.ravel())
    return stated
