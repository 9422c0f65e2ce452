"""Laws of the interface against an effective friction coefficient, by evidence.

All dry loads together are explained by Amontons' law with one effective coefficient, by one of
each load, and by an interface that yields over a slip length before it slips: they differ in how
the stress changes with the load.  From lubricated loads, which bear no shear, follows likewise
whether the interface yields normally.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import logsumexp

from memscal.apparatus import ApparatusFunction
from memscal.errors import InputError
from memscal.extensions.interface_laws.families import (
    family_at_loads,
    normal_compliance_family,
    slipping_family,
)
from memscal.extensions.interface_laws.results import (
    ImpliedFriction,
    InterfaceComparison,
    InterfaceLaw,
    LawComparison,
)
from memscal.formats.cache import CacheFolder
from memscal.friction.calculated import amontons_family
from memscal.friction.family import ProfileFamily, bounded, unbounded
from memscal.friction.interval import profile_estimate
from memscal.friction.likelihood import Channel, likelihood, points_of, sensor_of
from memscal.friction.marginal_likelihood import (
    Prior,
    Statistics,
    added,
    evidence_of_each,
    log_likelihood,
    log_uniform_prior,
)
from memscal.friction.results import BoundedEstimate, Interval
from memscal.model.arrays import BoolArray, FloatArray, array_record, require_positive
from memscal.model.bayes_factor import BayesFactor
from memscal.model.checks import Message
from memscal.model.measured_stress import MeasuredProfile

#: Slip lengths that are thought possible, in m: about the roughness of surfaces that touch.
_SLIP_LENGTHS = (1e-7, 1e-4)
#: Lengths of the normal law that are, as shares of the largest that was calculated.
_NORMAL_SHARES = (1e-2, 1.0)
#: The likelihood is calculated over a wider range, at as many lengths.
_SLIP_LENGTHS_CALCULATED = (1e-8, 1e-3)
_NORMAL_SHARES_CALCULATED = (1e-3, 1.0)
_LENGTHS = 81
#: Nodes over all values, over those that the data do not exclude, and over those of one load,
#: whose parameter is known better with others than alone.
_COARSE = 81
_FINE = 161
_FINER = 321
#: Values are excluded where twice the log-likelihood falls short of the best by this.
_EXCLUDED = 25.0
#: Sweeps over the loads that look for the best parameter of each.
_SWEEPS = 200
_SETTLED = 1e-3
_UM = 1e-6


def weigh_slip_length(
    rigid: Channel, slipping: Channel, *, macroscopic: float, lubrication: str = "dry"
) -> LawComparison:
    """Weigh a slip length (``slipping``) against effective coefficients of a rigid interface."""
    # Uniform in the bounded coordinate.
    friction_prior = partial(bounded, scale=rigid.family.scale)
    length_prior = log_uniform_prior(*_SLIP_LENGTHS)
    degrees = sum(points.degrees for points in rigid.points)
    name = "effective Amontons, one coefficient"
    laws = [one_of_all(name, curve(rigid), friction_prior, degrees)]
    if len(rigid.points) > 1:
        curves = [curve(rigid.only([i]), fine=_FINER) for i in range(len(rigid.points))]
        name = "effective Amontons, one for each load"
        laws.append(one_of_each(name, curves, friction_prior, degrees))
    along = curve(slipping, also=np.geomspace(*_SLIP_LENGTHS_CALCULATED, _LENGTHS))
    name = f"elasto-plastic at {macroscopic:g}, slip length"
    laws.append(one_of_all(name, along, length_prior, degrees))
    length = interface_length(along, slipping.family, "slip length")
    return LawComparison(
        lubrication=lubrication,
        loads=rigid.family.loads,
        laws=tuple(laws),
        factors=_factors(laws),
        length=length,
        implied=implied_friction(rigid, slipping, length, macroscopic),
    )


def weigh_normal_compliance(channel: Channel) -> LawComparison:
    """Weigh a normal compliance against a rigid interface, both without friction."""
    largest = channel.family.values[-1]
    prior = log_uniform_prior(*(share * largest for share in _NORMAL_SHARES))
    low, high = (share * largest for share in _NORMAL_SHARES_CALCULATED)
    along = curve(channel, also=np.geomspace(low, high, _LENGTHS))
    top = float(along.log_likelihood[0])
    least = float(along.chi_square[0])
    degrees = sum(points.degrees for points in channel.points)
    rigid = InterfaceLaw("rigid, frictionless", (), top, top, 0.0, least, degrees)
    yielding = one_of_all("normal compliance, length", along, prior, degrees)
    return LawComparison(
        lubrication="lubricated",
        loads=channel.family.loads,
        laws=(rigid, yielding),
        factors=_factors([rigid, yielding]),
        length=interface_length(along, channel.family, "length of the normal law"),
    )


def _factors(laws: Sequence[InterfaceLaw]) -> tuple[BayesFactor, ...]:
    """Weigh the last law against each of the others."""
    *others, last = laws
    factors = []
    for law in others:
        best, worse = sorted((last, law), key=lambda each: -each.log_evidence)
        log_factor = best.log_evidence - worse.log_evidence
        ratio = best.log_likelihood - worse.log_likelihood
        factors.append(BayesFactor(best.name, worse.name, log_factor, ratio))
    return tuple(factors)


#: Stresses are calculated out to this multiple of the largest distance from the centre.
_REACH = 1.1
#: Chance of a misfit below which a law is not believed.
_MISFIT = 1e-3


def compare_interface(
    profiles: Sequence[MeasuredProfile],
    apparatus: ApparatusFunction,
    *,
    macroscopic: float,  # coefficient at which the indenter slides
    macroscopic_uncertainty: float | None = None,
    amontons: ProfileFamily | None = None,  # incremental, from 0 to inf
    slipping: ProfileFamily | None = None,  # elasto-plastic at the macroscopic coefficient
    cache: CacheFolder = None,
    workers: int = 1,
) -> InterfaceComparison:
    """Weigh laws of the interface; a family without a load within 1 % of each is calculated."""
    if not profiles:
        raise InputError(
            "Laws of the interface are compared with measured profiles, but none is given."
        )
    require_positive("macroscopic friction coefficient", macroscopic)
    if macroscopic_uncertainty is not None:
        require_positive("uncertainty of the macroscopic coefficient", macroscopic_uncertainty)
    lubricated = [profile for profile in profiles if profile.lubrication == "lubricated"]
    dry = [profile for profile in profiles if profile.lubrication != "lubricated"]
    scan = profiles[0].scan
    contacts = {
        "film": scan.film,
        "indenter": scan.indenter,
        "reach": _REACH * max(profile.r[-1] for profile in profiles),
        "cache": cache,
        "workers": workers,
    }
    tangential = normal = None
    if dry:
        if amontons is not None and tuple(amontons.values[[0, -1]]) != (0.0, math.inf):
            amontons = None
        law = partial(slipping_family, macroscopic, macroscopic_uncertainty, **contacts)
        rigid = family_at_loads(dry, amontons, partial(amontons_family, **contacts))
        tangential = weigh_slip_length(
            _channel(dry, apparatus, rigid),
            _channel(dry, apparatus, family_at_loads(dry, slipping, law)),
            macroscopic=macroscopic,
            lubrication=dry[0].lubrication,
        )
    if lubricated:
        family = family_at_loads(lubricated, None, partial(normal_compliance_family, **contacts))
        normal = weigh_normal_compliance(_channel(lubricated, apparatus, family))
    messages = tuple(_messages(tangential, normal, macroscopic_uncertainty, dry))
    return InterfaceComparison((macroscopic, macroscopic_uncertainty), tangential, normal, messages)


def _channel(
    profiles: Sequence[MeasuredProfile], apparatus: ApparatusFunction, family: ProfileFamily
) -> Channel:
    """Return what was measured with the contacts of a family, one for each profile."""
    reach = max(profile.r[-1] for profile in profiles)
    points = []
    for profile, stated, load in zip(profiles, points_of(profiles), family.loads, strict=True):
        # Loads count from that of the calculated contact.
        log_load = stated.log_load + math.log(profile.load / load)
        points.append(replace(stated, log_load=log_load))
    scans = [profile.scan for profile in profiles]
    return Channel(points, sensor_of(apparatus, family, reach, scans), family)


def _messages(
    tangential: LawComparison | None,
    normal: LawComparison | None,
    uncertainty: float | None,
    dry: Sequence[MeasuredProfile],
) -> Iterator[Message]:
    """Say what was assumed, and what the comparison cannot tell."""
    if any(not profile.lubrication for profile in dry):
        yield Message(
            "lubrication_unstated", "Scans that do not state their lubrication were taken as dry."
        )
    if tangential is not None and uncertainty is None:
        yield Message(
            "uncertainty_unstated",
            "The macroscopic friction coefficient was taken as exact: the slip length's "
            "uncertainty lacks its share (relatively the same as the coefficient's).",
        )
    if tangential is not None and tangential.loads.size < 2:
        yield Message(
            "one_load", "One load cannot tell a slip length from a smaller friction coefficient."
        )
    for compared in (tangential, normal):
        if compared is None:
            continue
        best = max(compared.laws, key=lambda law: law.p_value)
        if best.p_value < _MISFIT:
            yield Message(
                "misfit",
                f"No law of the {compared.lubrication or 'dry'} interface explains the data: the "
                f"best one's chi-square, {best.least:.0f} of {best.degrees} degrees of freedom, "
                f"has p = {best.p_value:.1g}. Their Bayes factors compare laws that are all wrong.",
            )


@array_record
class LawCurve:
    """The likelihood of a law along its parameter, at M values."""

    values: FloatArray
    coordinates: FloatArray
    edges: FloatArray  # (M + 1,): between them each value stands for all others
    statistics: Statistics
    log_likelihood: FloatArray
    chi_square: FloatArray

    @property
    def near(self) -> BoolArray:
        """Nodes that the likelihood does not exclude."""
        fall = 2 * (self.log_likelihood.max() - self.log_likelihood)
        return np.asarray(fall < _EXCLUDED)


def curve(channel: Channel, *, also: Iterable[float] = (), fine: int = _FINE) -> LawCurve:
    """Return the likelihood along the parameter of a family, one for all loads of a channel."""
    family = channel.family
    # Nodes are even in the bounded coordinate, closer where it matters.
    even = np.linspace(family.coordinates[0], family.coordinates[-1], _COARSE)
    coarse = np.union1d(even, bounded([*also], family.scale))
    rough = likelihood(channel.at(unbounded(coarse, family.scale))).statistics
    fall = log_likelihood(rough)[0]
    near = np.flatnonzero(2 * (fall.max() - fall) < _EXCLUDED)
    low = coarse[max(near[0] - 1, 0)]
    high = coarse[min(near[-1] + 1, coarse.size - 1)]
    t = np.union1d(coarse, np.linspace(low, high, fine))
    values = unbounded(t, family.scale)
    statistics = likelihood(channel.at(values)).statistics
    middles = (t[1:] + t[:-1]) / 2
    edges = unbounded([t[0], *middles, t[-1]], family.scale)
    return LawCurve(values, t, edges, statistics, *log_likelihood(statistics))


def one_of_all(name: str, along: LawCurve, prior: Prior, degrees: int) -> InterfaceLaw:
    """Return the law with one parameter for all loads; degrees are points less nuisances."""
    # The evidence is the likelihood averaged over the prior.
    evidence = logsumexp(along.log_likelihood, b=np.diff(prior(along.edges)))
    best = np.argmax(along.log_likelihood)
    chi_square = float(along.chi_square[best])
    return InterfaceLaw(
        name=name,
        best=(float(along.values[best]),),
        log_evidence=float(evidence),
        log_likelihood=float(along.log_likelihood[best]),
        numerical_error=0.0,
        least=chi_square,
        degrees=degrees - 1,
    )


def one_of_each(name: str, curves: Sequence[LawCurve], prior: Prior, degrees: int) -> InterfaceLaw:
    """Return the law with one parameter of each load; arguments as for :func:`one_of_all`."""
    loads = []
    weights = []
    for along in curves:
        loads.append(along.statistics.at(along.near))
        weights.append(np.diff(prior(along.edges))[along.near])
    log_evidence, error = evidence_of_each(loads, weights)
    chosen, top, chi_square = _best_of_each(loads)
    pairs = zip(curves, chosen, strict=True)
    return InterfaceLaw(
        name=name,
        best=tuple(float(along.values[along.near][node]) for along, node in pairs),
        log_evidence=log_evidence,
        log_likelihood=top,
        numerical_error=error,
        least=chi_square,
        degrees=degrees - len(curves),
    )


def _best_of_each(loads: Sequence[Statistics]) -> tuple[list[int], float, float]:
    """Climb the likelihood, one load after the other, from node to node."""
    chosen = [int(np.argmax(log_likelihood(load)[0])) for load in loads]
    top = -math.inf
    for _ in range(_SWEEPS):
        before = top
        for j, load in enumerate(loads):
            others = [other.at(chosen[i]) for i, other in enumerate(loads) if i != j]
            logs, chi_square = log_likelihood(added([load, *others]))
            chosen[j] = int(np.argmax(logs))
            top = float(logs[chosen[j]])
            least = float(chi_square[chosen[j]])
        if top - before < _SETTLED:
            break
    return chosen, top, least


_NODES = 401
#: A maximum this near to the largest one, relatively, is full stick: profiles are that accurate.
_STICK = 2e-4


def implied_friction(
    rigid: Channel, slipping: Channel, length: BoundedEstimate, friction: float
) -> ImpliedFriction:
    """Return what a slip length and its interval mean at each load, read from the maximum."""
    order = np.argsort(rigid.family.loads, kind="stable")
    lengths = np.array([length.interval.low, length.best, length.interval.upper])
    t = np.linspace(rigid.family.coordinates[0], rigid.family.coordinates[-1], _NODES)
    values = unbounded(t, rigid.family.scale)
    curves = _maxima(rigid, values)
    maxima = _maxima(slipping, lengths)
    implied = np.array(
        [[_read(values, curves[:, load], top) for top in maxima[:, load]] for load in order]
    )
    family = slipping.family
    areas = np.pi * family.at(length.best).contact_radii[0] ** 2
    pressures = (family.loads / areas)[order]
    with np.errstate(divide="ignore"):
        stiffnesses = friction * pressures[:, None] / lengths
    return ImpliedFriction(family.loads[order], implied, pressures, stiffnesses)


def _maxima(channel: Channel, values: FloatArray) -> FloatArray:
    """Return stresses on the axis behind G, times A, shape (V, L)."""
    sensor = channel.sensor
    return channel.family.at(values).spectra @ (sensor.transfer * sensor.wavenumbers.weights)


def _read(values: FloatArray, curve: FloatArray, top: float) -> float:
    """Return the first coefficient at which the maximum is as large."""
    if top >= curve.max() * (1 - _STICK):
        return math.inf
    finite = np.isfinite(values)
    return np.interp(top, np.maximum.accumulate(curve[finite]), values[finite])


#: Intervals of a length are wider by this factor: contacts are linearised about the stated film.
WIDENED = 1.55


def interface_length(along: LawCurve, family: ProfileFamily, what: str) -> BoundedEstimate:
    """Return a length by profile likelihood, one-sided where the data give only a bound."""
    return profile_estimate(
        along.values,
        along.coordinates,
        -2 * along.log_likelihood / WIDENED**2,
        along.chi_square,
        family.scale,
        reason=partial(_length_reason, what),
        two_sided=True,
        unit="m",
    )


def _length_reason(what: str, interval: Interval, last: float) -> str:
    """Say why there is no length, ``last`` being the last one that was calculated."""
    low = interval.low
    high = interval.high
    if interval.two_sided:
        return ""
    largest = f"the largest that was calculated, {last / _UM:.3g} um,"
    end = "one that bears no shear" if math.isinf(last) else largest
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
