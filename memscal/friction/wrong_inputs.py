"""Which single wrong input would explain profiles that no friction coefficient explains.

A contact of a paraboloid with a linear film is that of another load on another scale
(docs/contact_families.md), so that one family over many loads holds all contacts with one input
that is not as stated.
"""

import math
from dataclasses import replace

import numpy as np

from memscal.friction.calculated import amontons_family
from memscal.friction.effective import fit_friction, fit_together
from memscal.friction.likelihood import Channel
from memscal.friction.results import FrictionComparison
from memscal.model.arrays import Values
from memscal.model.checks import chi_square_limit

#: By input: powers of a factor on it by which load, stress and wavenumber of a contact change.
_POWERS = {
    "radius": (1, -1, 0),
    "young_modulus": (-1, 1, 0),
    "thickness": (-3, 3, 1),
    "load": (1, 0, 0),
    "gain": (0, 1, 0),
}
#: Load and stress are changed up to this factor; contacts are interpolated between so many loads.
_FARTHEST = 3.0
_LOADS = 14
#: Step of the logarithm of a factor in which the best is found.
_SETTLED = 0.01


def wrong_inputs(
    comparison: FrictionComparison,
    channel: Channel,
    setting: Values,  # of the family
    lubricated_friction: float | None,
) -> dict[str, float]:
    """Return inputs of which a factor explains all loads, friction free, each with the best one."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    family = channel.family
    loading = family.loading
    loads = np.geomspace(family.loads.min() / _FARTHEST, family.loads.max() * _FARTHEST, _LOADS)
    film = replace(setting["film"].expected, poisson_ratio_uncertainty=None)
    changed = {**setting, "film": film, "loads": loads, "derivatives": False}
    solved = amontons_family(friction=family.values.tolist(), loading=loading, **changed)
    along = CubicSpline(np.log(loads), solved.spectra, axis=1)
    k = family.wavenumbers.k

    def misfit(log_factor: float, *powers: int) -> float:
        """Chi-square over its limit."""
        pressed, size, stretch = np.exp(np.multiply(powers, log_factor))
        place = np.log(pressed * family.loads)
        both = CubicSpline(k, [along(place), along(place, 1)], axis=-1)
        spectra, by_load = size * both(np.minimum(stretch * k, k[-1]))
        contacts = replace(family, spectra=spectra, by_load=by_load)
        fits = {loading: fit_friction(replace(channel, family=contacts))}
        joint = fit_together(comparison.measured, fits, lubricated_friction)
        found = [joint[lubrication][loading] for lubrication in comparison.unexplained]
        return max(each.least / chi_square_limit(each.degrees) for each in found)

    factors = {}
    for source, powers in _POWERS.items():
        reach = math.log(_FARTHEST) / max(map(abs, powers))
        best = minimize_scalar(
            misfit, args=powers, bounds=(-reach, reach), options={"xatol": _SETTLED}
        )
        if best.fun <= 1:
            factors[source] = math.exp(best.x)
    return factors
