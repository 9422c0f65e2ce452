"""The likelihood of one law of the interface along its free parameter, where it matters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from memscal.friction.effective import profiled
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import likelihood
from memscal.friction.marginal_likelihood import (
    Prior,
    Tables,
    evidence_of_each,
    evidence_of_one,
    log_likelihood,
)
from memscal.friction.prediction import LoadPoints, Sensor, members_of
from memscal.friction.results import ImpliedFriction, InterfaceLaw, InterfaceLength
from memscal.model.arrays import FloatArray

__all__ = [
    "LawCurve",
    "Measured",
    "curve",
    "implied_friction",
    "interface_length",
    "of_one_value",
    "one_of_all",
    "one_of_each",
]

#: Nodes over all values, and over those that the data do not exclude.
_COARSE, _FINE = 81, 161
#: Of one load: with others its parameter is known better than alone.
_FINER = 321
#: Values are excluded where twice the log-likelihood falls short of the best by this.
_EXCLUDED = 25.0
#: Sweeps over the loads that look for the best parameter of each.
_SWEEPS = 200
_SETTLED = 1e-3


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured points of several loads, the sensor, and the calculated contacts at these loads.

    ``family`` holds the loads of ``points``, in their order.
    """

    points: Sequence[LoadPoints]
    sensor: Sensor
    family: ProfileFamily

    @property
    def degrees(self) -> int:
        """Points less flat nuisances, of all loads."""
        return sum(points.degrees for points in self.points)

    def tables(self, values: FloatArray) -> Tables:
        """Return what the loads tell at values of the family's parameter."""
        members = members_of(self.family, values)
        loads = range(len(self.points))
        return likelihood(self.points, self.sensor, members, loads).tables()


@dataclass(frozen=True, eq=False)
class LawCurve:
    """The likelihood of a law along its parameter.

    Parameters
    ----------
    values, coordinates : ndarray, shape (M,)
        The parameter, increasing, and its bounded coordinate.
    edges : ndarray, shape (M + 1,)
        Values between which each of them stands for all others.
    tables : Tables
        What the loads tell there, of shape (M, 1).
    log_likelihood, chi_square : ndarray, shape (M,)
        Of all of them together.
    """

    values: FloatArray
    coordinates: FloatArray
    edges: FloatArray
    tables: Tables
    log_likelihood: FloatArray
    chi_square: FloatArray

    @property
    def best(self) -> int:
        """Index of the largest likelihood."""
        return int(np.argmax(self.log_likelihood))

    @property
    def deviance(self) -> FloatArray:
        """Chi-square at the largest likelihood, and above it elsewhere by twice its loss."""
        loss = self.log_likelihood[self.best] - self.log_likelihood
        return np.asarray(self.chi_square[self.best] + 2 * loss)

    def log_evidence(self, prior: Prior) -> float:
        """Return the logarithm of the likelihood averaged over a prior."""
        return evidence_of_one(self.log_likelihood, prior.weights(self.edges)).log


def curve(measured: Measured, *, load: int | None = None, also: Iterable[float] = ()) -> LawCurve:
    """Return the likelihood along a family's parameter, of all loads or of one by its index.

    Nodes are even in the bounded coordinate, with more of them where the likelihood is not
    negligible.

    Parameters
    ----------
    measured : Measured
        Points, sensor and calculated contacts.
    load : int, optional
        The load; all of them, with one parameter, by default.
    also : iterable of float
        Values of the parameter that are nodes too.
    """
    family = measured.family
    first, last = family.coordinates[0], family.coordinates[-1]
    extra = [family.coordinate(value) for value in also]
    coarse = np.unique(np.concatenate([np.linspace(first, last, _COARSE), extra]))
    rough = _group(_tables(measured, coarse), load)
    rough_log = log_likelihood(rough)[0][:, 0]
    near = np.flatnonzero(2 * (rough_log.max() - rough_log) < _EXCLUDED)
    low, high = coarse[max(near[0] - 1, 0)], coarse[min(near[-1] + 1, coarse.size - 1)]
    count = _FINE if load is None else _FINER
    fine = np.setdiff1d(np.linspace(low, high, count), coarse)
    close = _group(_tables(measured, fine), load)
    both = np.concatenate([coarse, fine])
    order = np.argsort(both)
    tables = Tables(
        *(np.concatenate(pair)[order] for pair in zip(rough.parts, close.parts, strict=True))
    )
    t = both[order]
    logs, chi_square = log_likelihood(tables)
    middles = np.concatenate([t[:1], (t[1:] + t[:-1]) / 2, t[-1:]])
    return LawCurve(
        values=np.array([family.value_at(float(one)) for one in t]),
        coordinates=t,
        edges=np.array([family.value_at(float(one)) for one in middles]),
        tables=tables,
        log_likelihood=logs[:, 0],
        chi_square=chi_square[:, 0],
    )


def _tables(measured: Measured, coordinates: FloatArray) -> Tables:
    values = [measured.family.value_at(float(t)) for t in coordinates]
    return measured.tables(np.array(values))


def _group(tables: Tables, load: int | None) -> Tables:
    return tables.together() if load is None else tables.group(load)


def one_of_all(name: str, found: LawCurve, prior: Prior, degrees: int) -> InterfaceLaw:
    """Return the law with one parameter for all loads.

    Parameters
    ----------
    name : str
        The law.
    found : LawCurve
        Its likelihood.
    prior : Prior
        Of its parameter.
    degrees : int
        Points less flat nuisances.
    """
    best = found.best
    return _law(
        name,
        (float(found.values[best]),),
        found.log_evidence(prior),
        0.0,
        float(found.log_likelihood[best]),
        float(found.chi_square[best]),
        degrees - 1,
    )


def of_one_value(name: str, found: LawCurve, index: int, degrees: int) -> InterfaceLaw:
    """Return the law that leaves nothing free, by the index of its parameter in a curve."""
    top, least = float(found.log_likelihood[index]), float(found.chi_square[index])
    return _law(name, (), top, 0.0, top, least, degrees)


def one_of_each(name: str, found: Sequence[LawCurve], prior: Prior, degrees: int) -> InterfaceLaw:
    """Return the law with one parameter of each load; arguments as for :func:`one_of_all`."""
    kept = [_where_it_matters(one) for one in found]
    tables = [part[0] for part in kept]
    weights = [prior.weights(one.edges)[part[1]] for one, part in zip(found, kept, strict=True)]
    evidence = evidence_of_each(tables, weights)
    start = [int(np.argmax(log_likelihood(table)[0][:, 0])) for table in tables]
    chosen, top, chi_square = _best_of_each(tables, start)
    best = tuple(
        float(one.values[part[1]][place])
        for one, part, place in zip(found, kept, chosen, strict=True)
    )
    return _law(name, best, evidence.log, evidence.error, top, chi_square, degrees - len(found))


def _law(
    name: str,
    best: tuple[float, ...],
    log_evidence: float,
    error: float,
    top: float,
    least: float,
    degrees: int,
) -> InterfaceLaw:
    from scipy.special import chdtrc

    p_value = float(chdtrc(degrees, least)) if degrees > 0 else 1.0
    return InterfaceLaw(name, best, log_evidence, top, error, least, degrees, p_value)


def _where_it_matters(found: LawCurve) -> tuple[Tables, FloatArray]:
    """Leave out the nodes that one load alone excludes."""
    near = 2 * (found.log_likelihood.max() - found.log_likelihood) < _EXCLUDED
    return Tables(*(part[near] for part in found.tables.parts)), near


def _best_of_each(tables: Sequence[Tables], start: list[int]) -> tuple[list[int], float, float]:
    """Climb the likelihood, one load after the other, from node to node."""
    chosen, top, chi_square = list(start), -np.inf, 0.0
    for _ in range(_SWEEPS):
        before = top
        for j, table in enumerate(tables):
            others = [
                tuple(part[chosen[i]] for part in other.parts)
                for i, other in enumerate(tables)
                if i != j
            ]
            sums = [np.sum(parts, axis=0) for parts in zip(*others, strict=True)] or [0.0] * 4
            both = Tables(*(p + s for p, s in zip(table.parts, sums, strict=True)))
            logs, squares = log_likelihood(both)
            chosen[j] = int(np.argmax(logs[:, 0]))
            top, chi_square = float(logs[chosen[j], 0]), float(squares[chosen[j], 0])
        if top - before < _SETTLED:
            break
    return chosen, top, chi_square


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


_UM = 1e-6


def interface_length(found: LawCurve, family: ProfileFamily, what: str) -> InterfaceLength:
    """Return a length by profile likelihood, one-sided where the data give only a bound.

    Parameters
    ----------
    found : LawCurve
        The likelihood along the length.
    family : ProfileFamily
        The contacts that were calculated.
    what : str
        Name of the length, for the reason.
    """
    curve = profiled(found.coordinates, found.deviance, family.value_at)
    known = not curve.open_low and not curve.open_high
    return InterfaceLength(
        value=curve.best if known else None,
        standard_uncertainty=curve.standard_uncertainty if known else None,
        interval=curve.interval,
        reason=_reason(what, curve.interval.low, curve.interval.high, family),
        values=found.values,
        deviance=found.deviance,
    )


def _reason(what: str, low: float, high: float | None, family: ProfileFamily) -> str:
    if low > 0 and high is not None:
        return ""
    last = float(family.values[-1])
    end = (
        "one that bears no shear"
        if math.isinf(last)
        else f"the largest that was calculated, {last / _UM:.3g} um,"
    )
    if low > 0:
        return (
            f"The {what} is not identifiable above {low / _UM:.3g} um: larger ones, {end} "
            "included, agree with the data as well. This is a lower bound."
        )
    if high is not None:
        return (
            f"The {what} is not identifiable below {high / _UM:.3g} um: a rigid interface agrees "
            "with the data as well. This is an upper bound."
        )
    return (
        f"The {what} is not identifiable: a rigid interface and {end} agree with the data "
        "equally well."
    )
