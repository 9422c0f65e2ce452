"""Rods of the table beside the same rods solved directly, off the table's nodes."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import paper

from memscal import Rod
from memscal.extensions.finite_strain.solve import Request
from memscal.mechanics.solver.step import Depth
from memscal.mechanics.tabulated_rod import tabulated_rod

H = 2e-3


def compare_with_the_table(nu: float, radius: float, depths: list[float], sticking: bool):
    """Assert that spectra, stress and depth agree; radius and depths in thicknesses."""
    film = replace(paper.film(nu), law="neo-hookean")
    rod = Rod(radius=radius * H)
    k = np.linspace(0.0, 12.0, 61) / H
    r = np.linspace(0.1, 4, 40) * H
    way = np.array(depths)
    if sticking:  # what touches stays: short steps, and elements finer than the table's
        way = np.union1d(way, np.arange(1, 25 * depths[-1] / radius) * radius / 25)
    finer = (2.5, 2.5) if sticking else (1.0, 1.0)
    goals = [Depth(1e3 * depth * H) for depth in way.tolist()]
    states = Request(film, rod, goals, sticking, 12.5e3 * H, None, finer).reached(1.0)
    for state in (s for d, s in zip(way, states, strict=True) if d in depths):
        tabulated = tabulated_rod(film, rod, state.load, sticking=sticking)
        largest = float(state.base_stress(0.0))
        for name, at, bound in (
            ("base_spectrum", k, 1e-3 * state.load),
            ("base_shear_spectrum", k, 1e-3 * state.load),
            ("base_stress", r, 2e-3 * largest),
            ("base_shear", r, 2e-3 * largest),
        ):
            expected = getattr(state, name)(at)
            assert getattr(tabulated, name)(at) == pytest.approx(expected, abs=bound), name
        assert tabulated.depth == pytest.approx(state.depth, rel=2e-3)
