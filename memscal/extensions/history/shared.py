r"""What calibrations of a sensor have in common: the covariance of their values.

.. math::

    C_{ij} = \sum_s c_{si}\,c_{sj}\,[i\ \text{and}\ j\ \text{used the same thing for}\ s]
    + \delta_{ij}\,u_i^2,

with the signed effects c of each source by one standard uncertainty, as the artifacts state them.
What is not named counts as another thing at each date.
"""

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import hankel_transform
from memscal.model.apparatus import ApparatusData, round_wavenumbers
from memscal.model.arrays import FloatArray, floats
from memscal.model.instrument import Equipment

LEVELS = ("conversion_constant", "gaussian_sigma")
"""Names of A and sigma in artifacts."""
THINGS = {
    "film": "memscal import --film-name",
    "indenter": "memscal import --indenter-name",
    "load_cell": "serial and certificate in lab.toml",
    "stage": "serial and certificate in lab.toml",
}
"""Things that calibrations may share, by their attributes in artifacts, and what names them."""

#: Sources of uncertainty that belong to a thing.  The sensor is the same at all dates.
_SOURCES = {
    "film": "thickness poisson_ratio young_modulus mooney_rivlin_ratio roughness base_slip "
    "regularisation window misfit model_form reference_force reference_convergence "
    "reference_stress",
    "indenter": "rod_radius rod_friction",
    "load_cell": "load",
    "stage": "position_scale",
    "sensor": "roundness shear_sensitivity gain_curvature baseline_curvature",
}

#: Sources whose size each scan finds anew, and mostly without a sign.
_HIDDEN = ("regularisation", "window", "misfit", "baseline_curvature")


def thing_of(source: str) -> str:
    """Return the thing that an uncertainty belongs to, or nothing: each date has its own."""
    return next((thing for thing, sources in _SOURCES.items() if source in sources.split()), "")


def identity(apparatus: ApparatusData, thing: str) -> Any:
    """Return what tells a thing from another one, ``None`` where that is not stated."""
    used = getattr(apparatus, thing, None)
    if isinstance(used, Equipment):
        which = used.serial_number or used.name
        # A new certificate is another error.
        return (which, used.certificate) if which and used.certificate else None
    if thing == "film":
        # What regularisation hides of G depends on the method, too.
        method = apparatus.process.configuration.get("method", "")
        return (used.name, method) if used and used.name else None
    if thing == "sensor":
        return thing
    return getattr(used, "name", "") or None


def sources_of(apparatuses: Sequence[ApparatusData]) -> list[str]:
    """Return the sources whose effects some artifact states."""
    return sorted(set().union(*(apparatus.shared_effects for apparatus in apparatuses)))


def common_wavenumbers(apparatuses: Sequence[ApparatusData]) -> FloatArray:
    """Return the wavenumbers, in rad/m, at which all artifacts state effects on A G."""
    common = reduce(
        np.intersect1d,
        [round_wavenumbers(apparatus.resolved_wavenumber) for apparatus in apparatuses],
    )
    return common if all(apparatus.shared_effects for apparatus in apparatuses) else common[:0]


def logarithms(apparatus: ApparatusData, k: FloatArray) -> FloatArray:
    """Return ln A, ln sigma and ln A G(k) of an artifact (2 + m,)."""
    profile = apparatus.radial_profile
    a = apparatus.conversion_constant
    transfer = hankel_transform(profile.r, profile.g, k) if k.size else k
    return np.log([a, apparatus.gaussian_sigma, *(a * transfer)])


def _effects(apparatus: ApparatusData, source: str, k: FloatArray) -> FloatArray:
    """Return the changes (2 + m,) of the logarithms by a source."""
    stated = apparatus.shared_effects.get(source)
    if stated is None:
        return np.zeros(2 + k.size)
    kept = np.isin(round_wavenumbers(apparatus.resolved_wavenumber), k)
    return floats(stated[np.append([True, True], kept)])


def covariances(apparatuses: Sequence[ApparatusData], k: FloatArray) -> FloatArray:
    """Return the covariance between dates of each pair of logarithms, (2 + m, 2 + m, n, n).

    Of noise and what else each date has of its own only A and sigma are known together.
    """
    size = 2 + k.size
    count = len(apparatuses)
    total = np.zeros((size, size, count, count))
    for source in sources_of(apparatuses):
        effects = np.array([_effects(one, source, k) for one in apparatuses])
        # What is not named is another thing each time.
        used = [identity(one, thing_of(source)) or object() for one in apparatuses]
        first = [used.index(thing) for thing in used]
        same = np.equal.outer(first, first)
        if source in _HIDDEN:
            # The error behind it is one.
            effects = same @ effects / np.sum(same, axis=1)[:, None]
        products = np.einsum("iq,jp->qpij", effects, effects)
        if source == "noise":
            products *= np.eye(size)[:, :, None, None]
        total += products * same
    for i, apparatus in enumerate(apparatuses):
        # What an artifact states of A and sigma together beyond the sources; of an old one, all.
        stated = apparatus.parameters.only(LEVELS)
        relative = stated.covariance / np.outer(stated.values, stated.values)
        own = total[:2, :2, i, i]
        own += np.where(np.eye(2) * bool(apparatus.shared_effects), 0.0, relative - own)
    return total
