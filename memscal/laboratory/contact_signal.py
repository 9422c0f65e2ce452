r"""Blurred base stress of contacts near a few nominal loads, without solving each of them.

A contact's own load :math:`P_i` differs a little from the nominal one.  Contacts are solved at
each nominal load P and on both sides of it, on one growing path of loads, and between the three
the profile is a parabola in :math:`\ln P`:

.. math::

    S(R; P_i) = S + S'\,t + \tfrac12 S''\,t^2, \qquad t = \ln(P_i / P),

with finite differences for :math:`S' = dS/d\ln P` and :math:`S''`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.laboratory.response import blurred_stress
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.validation import FloatArray

__all__ = ["LoadPath", "pressed_path"]

# Distance in ln P of the outer states from the middle one, in standard deviations of the load,
# and its smallest value: closer ones would show the solver's own error.
_SPREAD = 2.0
_LEAST_SPREAD = 0.02


@dataclass(frozen=True, eq=False)
class LoadPath:
    """Contacts at several nominal loads, with neighbours where their loads scatter.

    Parameters
    ----------
    states : sequence of sequences of Contact
        At each nominal load one contact, or three, ``spread`` apart in ln P.
    spread : float
        Their distance.
    """

    states: Sequence[Sequence[Contact]]
    spread: float

    def at_nominal(self, kernel: RadialKernel, radius: FloatArray) -> FloatArray:
        """Return the blurred stress at every nominal load, shape (loads, *radius.shape), in Pa."""
        return blurred_stress([state[len(state) // 2] for state in self.states], kernel, radius)

    def near(
        self,
        index: int,
        kernel: RadialKernel,
        radius: FloatArray,
        ratio: FloatArray,
        *,
        order: int = 0,
    ) -> FloatArray:
        """Return the blurred stress at radii (m), each at its own load, in Pa.

        Parameters
        ----------
        index : int
            Number of the nominal load.
        kernel : RadialKernel
            The apparatus function.
        radius, ratio : ndarray, shape (n,)
            Distance from the axis in m, and load relative to the nominal one, of each contact.
        order : int
            Zero for the normal stress, one for the shear's radial component.
        """
        values = blurred_stress(self.states[index], kernel, radius, order=order)
        if len(values) == 1:
            return np.asarray(values[0])
        below, middle, above = values
        t = np.log(ratio)
        slope = (above - below) / (2 * self.spread)
        bend = (above - 2 * middle + below) / self.spread**2
        return np.asarray(middle + slope * t + 0.5 * bend * t**2)


def pressed_path(
    film: ElasticFilm,
    sphere: Sphere,
    loads: FloatArray,
    *,
    friction: float,
    loading: str,
    interface: Interface,
    scatter: float,
) -> LoadPath:
    """Solve the contacts at the loads (N) that scatter by a relative standard deviation."""
    spread = max(_SPREAD * scatter, _LEAST_SPREAD) if scatter > 0 else 0.0
    around = np.exp(spread * np.arange(-1, 2)) if scatter > 0 else np.ones(1)
    path, place = np.unique(np.multiply.outer(loads, around), return_inverse=True)
    solved = indent(
        film, sphere, load=path, friction=friction, loading=loading, interface=interface
    )
    rows = np.reshape(place, (loads.size, around.size))
    return LoadPath([[solved[i] for i in row] for row in rows], spread)
