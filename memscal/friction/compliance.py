r"""Laws of the interface against an effective friction coefficient, by evidence.

A rigid interface that slips at less shear than the one that was measured macroscopically, or one
that slips there but yields before: both make the stress under a sphere less than full stick does.
What tells them apart is how it goes with the load.  All dry loads together are explained

(a) by Amontons' law with one effective coefficient,
(b) by Amontons' law with a coefficient of each load, and
(c) by the elasto-plastic law at the macroscopic coefficient, with a slip length,

each with what A, G, film, sphere and loads leave uncertain, and weighed by evidence
(:mod:`memscal.friction.evidence`).  Lubricated loads, which bear no shear, tell likewise whether
the interface yields normally.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from memscal.apparatus import ApparatusFunction
from memscal.errors import InputError
from memscal.friction.cache import CacheFolder
from memscal.friction.compliance_results import InterfaceComparison, LawComparison
from memscal.friction.family import ProfileFamily
from memscal.friction.law_curves import Measured
from memscal.friction.law_families import LawFamilies
from memscal.friction.load_points import LoadPoints, load_points
from memscal.friction.predicted import sensor_of
from memscal.friction.weighed_laws import weigh_normal_compliance, weigh_slip_length
from memscal.model.checks import Message
from memscal.model.validation import require_positive

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile

__all__ = ["InterfaceComparison", "compare_interface"]

#: Chance of a misfit below which a law is not believed.
_MISFIT = 1e-3


def compare_interface(
    profiles: Sequence[MeasuredProfile],
    apparatus: ApparatusFunction,
    *,
    macroscopic: float,
    macroscopic_uncertainty: float | None = None,
    amontons: ProfileFamily | None = None,
    slipping: ProfileFamily | None = None,
    yielding: ProfileFamily | None = None,
    cache: CacheFolder = None,
    workers: int = 1,
) -> InterfaceComparison:
    r"""Weigh laws of the interface by all loads together.

    Parameters
    ----------
    profiles : sequence of MeasuredProfile
        Measured loads of one sphere on one film; those that do not state their lubrication count
        as dry.
    apparatus : ApparatusFunction
        The calibrated sensor.
    macroscopic : float
        Friction coefficient at which the indenter slides, measured otherwise.
    macroscopic_uncertainty : float, optional
        Its standard uncertainty.  The difference of contacts at :math:`\mu` and :math:`\mu + u`
        becomes one of the systematic changes of the fit.
    amontons, slipping, yielding : ProfileFamily, optional
        Calculated contacts, if they are known: of Amontons' law, incremental, from 0 to ``inf``;
        of the elasto-plastic law at the macroscopic coefficient, with its uncertainty among the
        changes; and without friction and normally compliant.  Each is calculated where it is not
        given, or has no load within 1 % of a measured one.
    cache, workers
        As for :func:`memscal.friction.amontons.amontons_family`.

    Returns
    -------
    InterfaceComparison

    Raises
    ------
    InputError
        If there is no profile, or the macroscopic coefficient or its uncertainty makes no sense.
    DomainError, ConvergenceError
        If a contact cannot be calculated.
    """
    if not profiles:
        raise InputError("No measured profile is there to compare laws of the interface with.")
    require_positive("macroscopic friction coefficient", macroscopic)
    if macroscopic_uncertainty is not None:
        require_positive("uncertainty of the macroscopic coefficient", macroscopic_uncertainty)
    wet = [profile for profile in profiles if profile.lubrication == "lubricated"]
    dry = [profile for profile in profiles if profile.lubrication != "lubricated"]
    calculated = LawFamilies(profiles, cache, workers)
    tangential = normal = None
    if dry:
        rigid = calculated.rigid(dry, amontons)
        elastic = calculated.slipping(dry, macroscopic, macroscopic_uncertainty, slipping)
        tangential = weigh_slip_length(
            _measured(dry, apparatus, rigid),
            _measured(dry, apparatus, elastic),
            macroscopic=macroscopic,
            lubrication=dry[0].lubrication,
        )
    if wet:
        normal = weigh_normal_compliance(
            _measured(wet, apparatus, calculated.yielding(wet, yielding))
        )
    messages = tuple(_messages(tangential, normal, macroscopic_uncertainty, dry))
    return InterfaceComparison((macroscopic, macroscopic_uncertainty), tangential, normal, messages)


def _measured(
    profiles: Sequence[MeasuredProfile], apparatus: ApparatusFunction, family: ProfileFamily
) -> Measured:
    reach = max(float(profile.r[-1]) for profile in profiles)
    points = [
        _about(load_points(profile), math.log(profile.load / load))
        for profile, load in zip(profiles, family.loads, strict=True)
    ]
    return Measured(points, sensor_of(apparatus, family, reach), family)


def _about(points: LoadPoints, shift: float) -> LoadPoints:
    """Count the loads of points from that of the calculated contact."""
    return replace(points, log_load=points.log_load + shift)


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
    for part in (tangential, normal):
        if part is None:
            continue
        best = max(part.laws, key=lambda law: law.p_value)
        if best.p_value < _MISFIT:
            yield Message(
                "misfit",
                f"No law of the {part.lubrication or 'dry'} interface explains the data: the best "
                f"one's chi-square, {best.least:.0f} of {best.degrees} degrees of freedom, has "
                f"p = {best.p_value:.1g}. Their Bayes factors compare laws that are all wrong.",
            )
