r"""What a slip length means at each load: an effective friction coefficient, and a stiffness."""

from __future__ import annotations

import math

import numpy as np

from memscal.friction.compliance_results import ImpliedFriction, InterfaceLength
from memscal.friction.law_curves import Measured
from memscal.friction.predicted import Sensor, members_of
from memscal.model.validation import FloatArray

__all__ = ["implied_friction"]

_NODES = 401
#: A maximum this near to the largest one, relatively, is full stick: profiles are that accurate.
_STICK = 2e-4


def implied_friction(
    rigid: Measured, slipping: Measured, length: InterfaceLength, friction: float
) -> ImpliedFriction:
    r"""Return what a slip length, and the ends of its interval, mean at each load.

    Parameters
    ----------
    rigid, slipping : Measured
        Contacts of Amontons' law along its coefficient, and of the elasto-plastic one along the
        slip length.
    length : InterfaceLength
        The slip length.
    friction : float
        Macroscopic friction coefficient.

    Returns
    -------
    ImpliedFriction
        Effective coefficients as the paper reads them: from the largest stress behind G.
    """
    order = np.argsort(rigid.family.loads, kind="stable")
    high = math.inf if length.interval.high is None else length.interval.high
    lengths = np.array([length.interval.low, length.best, high])
    t = np.linspace(rigid.family.coordinates[0], rigid.family.coordinates[-1], _NODES)
    values = np.array([rigid.family.value_at(float(one)) for one in t])
    curves = _maxima(rigid.sensor, rigid, values)
    wanted = _maxima(slipping.sensor, slipping, lengths)
    found = [[_read(values, curves[:, load], top) for top in wanted[:, load]] for load in order]
    family = slipping.family
    best = family.coordinate(length.best)
    radii = np.array([np.interp(best, family.coordinates, r) for r in family.contact_radii.T])
    pressures = (family.loads / (np.pi * radii**2))[order]
    with np.errstate(divide="ignore"):
        stiffnesses = friction * pressures[:, None] / lengths
    return ImpliedFriction(family.loads[order], np.array(found), pressures, stiffnesses)


def _maxima(sensor: Sensor, measured: Measured, values: FloatArray) -> FloatArray:
    """Return stresses on the axis behind G, times A, shape (V, L)."""
    spectra = members_of(measured.family, values).spectra
    return np.asarray(spectra @ (sensor.transfer * sensor.wavenumbers.weights))


def _read(values: FloatArray, curve: FloatArray, top: float) -> float:
    """Return the first coefficient at which the maximum is as large."""
    if top >= curve.max() * (1 - _STICK):
        return math.inf
    above = int(np.argmax(curve >= top))
    if above == 0:
        return float(values[0])
    low, high = curve[above - 1], curve[above]
    last = values[above] if np.isfinite(values[above]) else values[above - 1]
    share = (top - low) / (high - low)
    return float(values[above - 1] + share * (last - values[above - 1]))
