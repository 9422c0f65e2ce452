r"""Laws of the interface against an effective friction coefficient, by evidence.

A rigid interface that slips at less shear than the one that was measured macroscopically, or one
that slips there but yields before: both make the stress under a sphere less than full stick does.
They differ in how that changes with the load.  All dry loads together are explained

(a) by Amontons' law with one effective coefficient,
(b) by Amontons' law with a coefficient of each load, and
(c) by the elasto-plastic law at the macroscopic coefficient, with a slip length,

each with what A, G, film, sphere and loads leave uncertain, and weighed by evidence
(:mod:`memscal.friction.marginal_likelihood`).  From lubricated loads,
which bear no shear, follows likewise whether the interface yields normally.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.errors import InputError
from memscal.formats.cache import CacheFolder
from memscal.friction.calculated import LawFamilies
from memscal.friction.family import ProfileFamily
from memscal.friction.interface_laws import (
    LawCurve,
    Measured,
    curve,
    implied_friction,
    interface_length,
    of_one_value,
    one_of_all,
    one_of_each,
)
from memscal.friction.likelihood import load_points, sensor_of
from memscal.friction.marginal_likelihood import (
    Prior,
    bounded_prior,
    log_uniform_prior,
    uniform_prior,
)
from memscal.friction.results import (
    InterfaceComparison,
    InterfaceLaw,
    LawComparison,
    PriorChoice,
)
from memscal.model.arrays import require_positive
from memscal.model.bayes_factor import BayesFactor
from memscal.model.checks import Message

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile

#: Slip lengths that are thought possible: of the order of the roughness of surfaces that touch.
_SLIP_LENGTHS = (1e-7, 1e-4)
#: Other ranges of them, whose Bayes factors are stated beside.
_OTHER_SLIP_LENGTHS = ((1e-6, 1e-5), (1e-8, 1e-3))
#: Over these the likelihood is looked at.
_WIDEST, _DECADES = _OTHER_SLIP_LENGTHS[-1], 81
#: Lengths of the normal law, as shares of the largest that was calculated.
_NORMAL_SHARES = (1e-2, 1.0)
_UM = 1e-6


def weigh_slip_length(
    rigid: Measured, slipping: Measured, *, macroscopic: float, lubrication: str = "dry"
) -> LawComparison:
    """Weigh a slip length (``slipping``) against effective coefficients of a rigid interface."""
    of_friction = bounded_prior(rigid.family.scale, f"uniform in mu/(mu + {rigid.family.scale:g})")
    of_length = _log_prior("slip length", *_SLIP_LENGTHS)
    of_all = curve(rigid)
    along = curve(slipping, also=np.geomspace(*_WIDEST, _DECADES))
    degrees = rigid.degrees
    laws = [one_of_all("effective Amontons, one coefficient", of_all, of_friction, degrees)]
    if len(rigid.points) > 1:
        of_each = [curve(rigid, load=j) for j in range(len(rigid.points))]
        laws.append(
            one_of_each("effective Amontons, one for each load", of_each, of_friction, degrees)
        )
    name = f"elasto-plastic at {macroscopic:g}, slip length"
    laws.append(one_of_all(name, along, of_length, degrees))
    length = interface_length(along, slipping.family, "slip length")
    return LawComparison(
        lubrication=lubrication,
        loads=rigid.family.loads,
        laws=tuple(laws),
        factors=_factors(laws),
        length=length,
        priors=_other_priors(of_all, along, of_friction, of_length, slipping.family.scale),
        implied=implied_friction(rigid, slipping, length, macroscopic),
    )


def weigh_normal_compliance(
    measured: Measured, *, lubrication: str = "lubricated"
) -> LawComparison:
    """Weigh a normal compliance against a rigid interface, both without friction."""
    largest = float(measured.family.values[-1])
    low, high = (share * largest for share in _NORMAL_SHARES)
    prior = _log_prior("length", low, high)
    others = (
        _log_prior("length", low / 10, high),
        uniform_prior(high, f"length uniform up to {high / _UM:.3g} um"),
    )
    along = curve(measured, also=np.geomspace(low / 10, high, _DECADES))
    rigid = of_one_value("rigid, frictionless", along, 0, measured.degrees)
    yielding = one_of_all("normal compliance, length", along, prior, measured.degrees)
    return LawComparison(
        lubrication=lubrication,
        loads=measured.family.loads,
        laws=(rigid, yielding),
        factors=_factors([rigid, yielding]),
        length=interface_length(along, measured.family, "length of the normal law"),
        priors=tuple(
            PriorChoice(p.words, along.log_evidence(p) - rigid.log_evidence)
            for p in (prior, *others)
        ),
    )


def _log_prior(what: str, low: float, high: float) -> Prior:
    words = f"{what} log-uniform from {low / _UM:.3g} to {high / _UM:.3g} um"
    return log_uniform_prior(low, high, words)


def _other_priors(
    rigid: LawCurve, slipping: LawCurve, of_friction: Prior, of_length: Prior, scale: float
) -> tuple[PriorChoice, ...]:
    """Weigh the slip length against one coefficient under the usual priors and under others."""
    pairs = [(of_length, of_friction)]
    pairs += [(_log_prior("slip length", *ends), of_friction) for ends in _OTHER_SLIP_LENGTHS]
    words = f"slip length uniform in l/(l + {scale / _UM:.3g} um)"
    pairs.append((bounded_prior(scale, words), of_friction))
    pairs.append((of_length, uniform_prior(2.0, "coefficient uniform from 0 to 2")))
    pairs.append((of_length, log_uniform_prior(0.01, 10, "coefficient log-uniform, 0.01 to 10")))
    return tuple(
        PriorChoice(
            (of_slip if of_mu is of_friction else of_mu).words,
            slipping.log_evidence(of_slip) - rigid.log_evidence(of_mu),
        )
        for of_slip, of_mu in pairs
    )


def _factors(laws: Sequence[InterfaceLaw]) -> tuple[BayesFactor, ...]:
    """Weigh the last law against each of the others."""
    *others, last = laws
    return tuple(
        BayesFactor.between(last.name, law.name, last.log_evidence - law.log_evidence)
        for law in others
    )


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
    yielding: ProfileFamily | None = None,  # normally compliant
    cache: CacheFolder = None,
    workers: int = 1,
) -> InterfaceComparison:
    """Weigh laws of the interface; families without a load within 1 % of each are calculated."""
    if not profiles:
        raise InputError(
            "Laws of the interface are compared with measured profiles, but none is given."
        )
    require_positive("macroscopic friction coefficient", macroscopic)
    if macroscopic_uncertainty is not None:
        require_positive("uncertainty of the macroscopic coefficient", macroscopic_uncertainty)
    wet = [profile for profile in profiles if profile.lubrication == "lubricated"]
    dry = [profile for profile in profiles if profile.lubrication != "lubricated"]
    calculated = LawFamilies(profiles, cache, workers)
    tangential = normal = None
    if dry:
        elastic = calculated.slipping(dry, macroscopic, macroscopic_uncertainty, slipping)
        tangential = weigh_slip_length(
            _measured(dry, apparatus, calculated.rigid(dry, amontons)),
            _measured(dry, apparatus, elastic),
            macroscopic=macroscopic,
            lubrication=dry[0].lubrication,
        )
    if wet:
        family = calculated.yielding(wet, yielding)
        normal = weigh_normal_compliance(_measured(wet, apparatus, family))
    messages = tuple(_messages(tangential, normal, macroscopic_uncertainty, dry))
    return InterfaceComparison((macroscopic, macroscopic_uncertainty), tangential, normal, messages)


def _measured(
    profiles: Sequence[MeasuredProfile], apparatus: ApparatusFunction, family: ProfileFamily
) -> Measured:
    reach = max(float(profile.r[-1]) for profile in profiles)
    points = []
    for profile, load in zip(profiles, family.loads, strict=True):
        of_load = load_points(profile)
        # Loads count from that of the calculated contact.
        points.append(replace(of_load, log_load=of_load.log_load + math.log(profile.load / load)))
    return Measured(points, sensor_of(apparatus, family, reach), family)


def _messages(
    tangential: LawComparison | None,
    normal: LawComparison | None,
    uncertainty: float | None,
    dry: Sequence[MeasuredProfile],
) -> Iterator[Message]:
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
