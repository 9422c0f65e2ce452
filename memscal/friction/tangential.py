r"""Friction by the shear at the base: a sphere's :math:`U_{xz}` against calculated contacts.

Experimental.  The likelihood is that of the normal channel (:mod:`memscal.friction.likelihood`),
with the shear's transforms of order one in place of the normal stress's, and with G and A of the
tangential channel.  Loads and centres come from the normal channel of the same scan.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import InputError
from memscal.estimation.channels import TANGENTIAL
from memscal.formats.opened import opened_stress
from memscal.friction.amontons import FRICTIONS, amontons_family
from memscal.friction.assembly import require_sphere
from memscal.friction.cache import CacheFolder
from memscal.friction.effective import confront
from memscal.friction.load_points import load_points
from memscal.friction.messages import SYNTHETIC_SCANS
from memscal.friction.predicted import sensor_of
from memscal.friction.requirements import require_contacts
from memscal.friction.results import EffectiveFriction
from memscal.model.checks import Message
from memscal.model.measured_stress import MeasuredScan, MeasuredStress
from memscal.model.validation import FloatArray
from memscal.threads import single_threaded

__all__ = ["ShearComparison", "compare_shear"]

#: Calculated shear reaches this multiple of a scan's width.
_REACH = 1.5


@dataclass(frozen=True, eq=False)
class ShearComparison:
    """The friction that explains the shear at the base of a film.

    Parameters
    ----------
    measured : MeasuredStress
        The normal channel of the same scans: loads and centres.
    apparatus : ApparatusFunction
        The tangential channel.
    friction : ndarray, shape (m,)
        Friction coefficients of the calculated contacts.
    loads : mapping of str to tuple of EffectiveFriction
        One for each measured profile, in their order, by definition of the loading.
    joint : mapping of str to mapping of str to EffectiveFriction
        One for all loads together, by lubrication and definition of the loading.
    messages : tuple of Message
        What a user should know.
    """

    measured: MeasuredStress
    apparatus: ApparatusFunction
    friction: FloatArray
    loads: Mapping[str, tuple[EffectiveFriction, ...]]
    joint: Mapping[str, Mapping[str, EffectiveFriction]]
    messages: tuple[Message, ...]


@single_threaded()
def compare_shear(
    measured: MeasuredStress | str | PathLike[str],
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str | Sequence[str] = ("incremental", "total"),
    cache: CacheFolder = None,
    workers: int = 1,
) -> ShearComparison:
    r"""Find the friction that explains a tangential channel's voltage under a sphere.

    Experimental: tested on synthetic scans only.  For each load,
    :math:`U_{xz} = A_{xz}\,(G_{xz} \otimes \tau_\mu)(R)\cos\theta` with baseline, drift and centre
    free, and with the uncertainties of A G, film, sphere, loads and positions.

    Parameters
    ----------
    measured : MeasuredStress or path
        From :func:`memscal.measure_stress`, of scans that hold ``u_xz`` and ``u_xz_errors`` beside
        ``u_zz`` (``u_yz`` of a line along y).
    apparatus : ApparatusFunction or path
        The tangential channel of the same sensor, from ``memscal.calibrate(..., channel="xz")``.
    friction : sequence of float
        Friction coefficients between which to interpolate; the last may be ``inf``.
    loading : str or sequence of str
        ``"incremental"``, ``"total"``, or both.
    cache : path, optional
        A folder in which calculated contacts are kept; without it nothing is written.
    workers : int
        Processes that calculate contacts.

    Returns
    -------
    ShearComparison

    Raises
    ------
    InputError
        If the artifact is of no tangential channel, or of another sensor, if a scan is not a
        sphere's, or if it holds no voltage of the channel with its noise.

    Examples
    --------
    >>> import math, memscal
    >>> made = memscal.simulate_experiment(
    ...     friction=0.1, loads=[1.37], lubricated_loads=[1.37], channels=("zz", "xz"), seed=1
    ... )
    >>> normal, shear = (
    ...     memscal.calibrate(made.rod, channel=channel, method="evidence").apparatus
    ...     for channel in ("zz", "xz")
    ... )
    >>> measured = memscal.measure_stress(made.dry, normal)
    >>> found = compare_shear(measured, shear, friction=(0, 0.1, 0.3, math.inf), loading="total")
    >>> found.joint["dry"]["total"].interval.low < 0.15
    True
    """
    known, measured = opened_apparatus(apparatus), opened_stress(measured)
    require_contacts(measured.scans)
    scan = measured.scans[0]
    _require_tangential(known, scan)
    points = [load_points(profile, known.sensor.channel) for profile in measured.profiles]
    loads = np.unique(measured.loads)
    reach = _REACH * max(one.width for one in measured.scans)
    names = (loading,) if isinstance(loading, str) else tuple(dict.fromkeys(loading))
    if not names:
        raise InputError('No loading was given: "incremental", "total", or both.')
    confronted = {}
    for name in names:
        family = amontons_family(
            scan.film,
            require_sphere(scan.indenter),
            loads,
            friction=friction,
            loading=name,
            reach=reach,
            cache=cache,
            workers=workers,
            order=1,
        )
        sensor = sensor_of(known, family, max(float(each.radius.max()) for each in points))
        index = [int(np.abs(loads - profile.load).argmin()) for profile in measured.profiles]
        confronted[name] = confront(family, sensor, points, index)
    kinds = [profile.lubrication for profile in measured.profiles]
    chosen = {kind: [i for i, own in enumerate(kinds) if own == kind] for kind in kinds}
    return ShearComparison(
        measured=measured,
        apparatus=known,
        friction=np.asarray(friction, dtype=np.float64),
        loads={
            name: tuple(one.effective([i]) for i in range(len(points)))
            for name, one in confronted.items()
        },
        joint={
            kind: {name: one.effective(indices) for name, one in confronted.items()}
            for kind, indices in chosen.items()
        },
        messages=tuple(_messages(scan, known)),
    )


def _require_tangential(apparatus: ApparatusFunction, scan: MeasuredScan) -> None:
    channel = apparatus.sensor.channel
    if channel not in TANGENTIAL:
        raise InputError(
            f"The artifact is of channel {channel}, not of a tangential one.",
            cure='Give the artifact of memscal.calibrate(scan, channel="xz", method="evidence"); '
            "compare the normal channel with memscal.compare().",
        )
    ours, theirs = scan.sensor.name, apparatus.sensor.name
    if ours and theirs and ours != theirs:
        raise InputError(
            f'The scan is of sensor "{ours}", the artifact of "{theirs}".',
            why="An apparatus function belongs to one sensor.",
            cure="Give the artifact of the scan's sensor.",
        )


def _messages(scan: MeasuredScan, apparatus: ApparatusFunction) -> Iterator[Message]:
    channel = apparatus.sensor.channel
    yield Message(
        "experimental",
        f"Channel {channel} is experimental: comparisons were tested on synthetic scans only.",
    )
    if scan.synthetic:
        yield SYNTHETIC_SCANS
