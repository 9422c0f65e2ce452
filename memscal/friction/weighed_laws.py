"""Laws of the interface weighed by the loads that were measured: how it yields, and how far."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from memscal.friction.compliance_results import (
    BayesFactor,
    InterfaceLaw,
    LawComparison,
    PriorChoice,
)
from memscal.friction.implied import implied_friction
from memscal.friction.interface_length import interface_length
from memscal.friction.law_curves import (
    LawCurve,
    Measured,
    curve,
    of_one_value,
    one_of_all,
    one_of_each,
)
from memscal.friction.priors import Prior, bounded_prior, log_uniform_prior, uniform_prior

__all__ = ["weigh_normal_compliance", "weigh_slip_length"]

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
    """Weigh a slip length against effective coefficients of a rigid interface.

    Parameters
    ----------
    rigid, slipping : Measured
        The same points and sensor, with contacts of Amontons' law along its coefficient and with
        those of the elasto-plastic law along the slip length.
    macroscopic : float
        The latter's friction coefficient.
    lubrication : str
        Of the points, to be recorded.

    Returns
    -------
    LawComparison
        The laws: one coefficient, one for each load (where there are several), a slip length.
    """
    of_friction = bounded_prior(rigid.family.scale, f"uniform in mu/(mu + {rigid.family.scale:g})")
    of_length = _log_prior("slip length", *_SLIP_LENGTHS)
    one = curve(rigid)
    along = curve(slipping, also=np.geomspace(*_WIDEST, _DECADES))
    degrees = rigid.degrees
    laws = [one_of_all("effective Amontons, one coefficient", one, of_friction, degrees)]
    if len(rigid.points) > 1:
        each = [curve(rigid, load=j) for j in range(len(rigid.points))]
        laws.append(
            one_of_each("effective Amontons, one for each load", each, of_friction, degrees)
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
        priors=_other_priors(one, along, of_friction, of_length, slipping.family.scale),
        implied=implied_friction(rigid, slipping, length, macroscopic),
    )


def weigh_normal_compliance(
    measured: Measured, *, lubrication: str = "lubricated"
) -> LawComparison:
    """Weigh a normal compliance against a rigid interface, both without friction.

    Parameters
    ----------
    measured : Measured
        Points, sensor, and contacts along the length of a normal law, from 0.
    lubrication : str
        Of the points, to be recorded.
    """
    largest = float(measured.family.values[-1])
    low, high = (share * largest for share in _NORMAL_SHARES)
    prior = _log_prior("length", low, high)
    others = (
        _log_prior("length", low / 10, high),
        uniform_prior(high, f"length uniform up to {high / _UM:.3g} um"),
    )
    found = curve(measured, also=np.geomspace(low / 10, high, _DECADES))
    rigid = of_one_value("rigid, frictionless", found, 0, measured.degrees)
    yielding = one_of_all("normal compliance, length", found, prior, measured.degrees)
    return LawComparison(
        lubrication=lubrication,
        loads=measured.family.loads,
        laws=(rigid, yielding),
        factors=_factors([rigid, yielding]),
        length=interface_length(found, measured.family, "length of the normal law"),
        priors=tuple(
            PriorChoice(p.words, found.log_evidence(p) - rigid.log_evidence)
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
            (of_one if of_mu is of_friction else of_mu).words,
            slipping.log_evidence(of_one) - rigid.log_evidence(of_mu),
        )
        for of_one, of_mu in pairs
    )


def _factors(laws: Sequence[InterfaceLaw]) -> tuple[BayesFactor, ...]:
    """Weigh the last law against each of the others."""
    *others, last = laws
    return tuple(
        BayesFactor(last.name, law.name, last.log_evidence - law.log_evidence)
        if last.log_evidence >= law.log_evidence
        else BayesFactor(law.name, last.name, law.log_evidence - last.log_evidence)
        for law in others
    )
