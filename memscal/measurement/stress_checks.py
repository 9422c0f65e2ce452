r"""The quality checks of a measured stress: force against load, and those of each profile.

The force is the transform of the restored stress at :math:`k = 0`, where :math:`\hat G = 1` and
the film's transfer function is one: a G that is too wide, or a film whose thickness is not what is
stated, leaves it as it is, but for what lies beyond the scan.  So does their combination, a sensor
calibrated under a film 5 % thicker than stated: its G comes out a tenth too wide, its A as it is.
What the force tells is A, gain and load.

All loads together tell more than each: with force over load :math:`q_j`, independent
uncertainties :math:`u_j` and common ones :math:`c_j` (A, film, stage, common load), the mean
weighted by :math:`1/u_j^2` has the variance :math:`w^T(\mathrm{diag}(u^2) + cc^T)w`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import erfc

from memscal.measurement.restoration import Restoration
from memscal.model.checks import QualityCheck, check
from memscal.model.measured_stress import MeasuredProfile

__all__ = ["check_of_all_forces", "checks_of_restoration", "pooled_force", "stress_checks"]

_FORCE_LIMIT = 3.0
#: One check of all profiles together may be stricter than one for each.
_MEAN_LIMIT = 2.0
#: What the shapes of pressure leave open of the force of one profile, however small the noise.
_NEGLIGIBLE_FORCE = 0.01
#: ... of the mean of several, whose shapes differ.
_NEGLIGIBLE_MEAN = 0.005
_FORCE = (
    "A failure means that A or the gain of the channel, the load, or the unit of one of them is "
    "wrong."
)
_BLIND = (
    " It does not depend on the shape of G nor on the film's thickness, and tells nothing of them: "
    "a film thickness that is wrong shows as another width of G in the calibration."
)
#: Of a restoration's own checks, the force's is made here.
_REPLACED = "restored_force"
#: Without a noise that is stated there is nothing to compare the scatter with.
_OF_STATED_NOISE = ("noise_as_stated", "chi_square")


def stress_checks(
    profiles: Sequence[MeasuredProfile], restored: Sequence[Sequence[QualityCheck]]
) -> tuple[QualityCheck, ...]:
    """Return the checks of each profile, numbered from one, then those of all together.

    ``restored``: what :func:`checks_of_restoration` says of each profile.
    """
    found = [
        replace(one, name=f"{one.name}_{i + 1}", meaning=f"{profile.label}: {one.meaning}")
        for i, (profile, own) in enumerate(zip(profiles, restored, strict=True))
        for one in (_force(profile), *own)
    ]
    if len(profiles) > 1:
        found.append(check_of_all_forces(profiles))
    return tuple(found)


def pooled_force(profiles: Sequence[MeasuredProfile]) -> tuple[float, float]:
    """Return the mean of force over load of all profiles, and its standard uncertainty.

    The load's common uncertainty counts; that of each load of one profile does not.
    """
    parts = [_relative(profile) for profile in profiles]
    own = np.array([part["own"] for part in parts])
    weight = own**-2 / np.sum(own**-2)
    ratio = np.array([profile.force / profile.load for profile in profiles])
    variance = float(np.sum((weight * own) ** 2))
    for source in ("apparatus", "film", "position_scale", "load"):
        variance += float(weight @ [part[source] for part in parts]) ** 2
    return float(weight @ ratio), math.sqrt(variance)


def _relative(profile: MeasuredProfile) -> dict[str, float]:
    """Standard uncertainties of force over load, by source."""
    budget = {source: u / profile.load for source, u in profile.force_budget.items()}
    own = budget.pop("scan")
    common = profile.load_uncertainty or 0.0
    return {"own": own, **budget, "load": common / profile.load}


def checks_of_restoration(restoration: Restoration, *, stated: bool) -> tuple[QualityCheck, ...]:
    """Return the checks of a restoration that hold for its profile.

    ``stated``: whether the noise is, or was estimated from the scatter.
    """
    left_out = {_REPLACED} if stated else {_REPLACED, *_OF_STATED_NOISE}
    return tuple(one for one in restoration.checks if one.name not in left_out)


def _force(profile: MeasuredProfile) -> QualityCheck:
    off = profile.force / profile.load - 1
    allowed = float(np.linalg.norm([*_relative(profile).values(), _NEGLIGIBLE_FORCE]))
    return check(
        "applied_force",
        abs(off) / allowed,
        _FORCE_LIMIT,
        f"Difference of the profile's total force, {profile.force:.4g} N, from the applied load of "
        f"{profile.load:.4g} N, over its standard uncertainty of {allowed * profile.load:.2g} N. "
        + _FORCE,
        _two_sided(off / allowed),
    )


def check_of_all_forces(profiles: Sequence[MeasuredProfile]) -> QualityCheck:
    """Return the check of the force of all profiles together."""
    mean, spread = pooled_force(profiles)
    allowed = math.hypot(spread, _NEGLIGIBLE_MEAN)
    return check(
        "applied_force_all",
        abs(mean - 1) / allowed,
        _MEAN_LIMIT,
        f"Total force over applied load, the weighted mean of {len(profiles)} profiles: "
        f"{mean:.4f}, with a standard uncertainty of {allowed:.2g}, in units of which its "
        "difference from one is counted. " + _FORCE + _BLIND,
        _two_sided((mean - 1) / allowed),
    )


def _two_sided(z: float) -> float:
    return float(erfc(abs(z) / math.sqrt(2)))
