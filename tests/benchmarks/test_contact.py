"""Speed of the contact mechanics, each beside the plain way to the same numbers."""

import numpy as np
import pytest
from helpers.machine import show, turns
from helpers.paper import FILM, LOADS, SPHERE
from scipy.optimize import nnls

from memscal import Interface
from memscal.mechanics.film_response import HankelFilm
from memscal.mechanics.solver.path import follow
from memscal.mechanics.solver.step import ContactProblem, Depth, Load


def contact_of_200_rings(friction):
    """The paper's sphere: 200 rings up to the contact radius at 2.75 N, and a few beyond."""
    rings = np.linspace(0.0, 3.6e-3, 210)
    compliance = HankelFilm(FILM, rings).compliance
    return ContactProblem(FILM, compliance, SPHERE.height(rings), friction, Interface())


@pytest.fixture(scope="module")
def smooth():
    return contact_of_200_rings(0.0)


def contact(problem):
    """The contact at 2.75 N."""
    return follow(problem, [Load(2.75)], "incremental", 1)[0].state


def normal_compliance(problem):
    n = problem.heights.size
    return problem.compliance.whole[:n, :n]


def plain_contact(problem, depth):
    """The same contact at a given depth as non-negative least squares, a library's way."""
    pressing = problem.heights < depth
    matrix = normal_compliance(problem)[np.ix_(pressing, pressing)]
    scale = matrix[0, 0]
    pressure, _ = nnls(matrix / scale, (depth - problem.heights[pressing]) / scale)
    whole = np.zeros(problem.heights.size)
    whole[pressing] = pressure
    return whole


def test_a_contact_costs_a_few_dense_solutions_and_less_than_least_squares(smooth):
    right = np.ones(smooth.heights.size)
    depth = contact(smooth).depth
    assert depth == pytest.approx(43.766e-6, rel=1e-4)
    # Where the surfaces only just meet, least squares and Signorini differ by a ring.
    assert smooth.compliance.areas @ plain_contact(smooth, depth) == pytest.approx(2.75, rel=5e-3)
    at_depth = follow(smooth, [Depth(depth)], "incremental", 1)[0].state
    assert at_depth.load == pytest.approx(2.75, rel=1e-9)

    def dense():
        return np.linalg.solve(normal_compliance(smooth), right)

    ratio = turns(lambda: contact(smooth), dense, 15)
    show("frictionless contact, over a dense solution", ratio, 40)
    ratio = turns(lambda: contact(smooth), lambda: plain_contact(smooth, depth), 3)
    show("frictionless contact, over non-negative least squares", ratio, 1)


def test_friction_along_a_path_costs_a_few_solutions_per_ring():
    problem = contact_of_200_rings(0.3)
    right = np.ones(2 * problem.heights.size)
    whole = problem.compliance.whole.copy()
    whole[problem.heights.size, :] = np.eye(2 * problem.heights.size)[
        problem.heights.size
    ]  # no shear on the axis

    def path():
        return follow(problem, [Load(load) for load in LOADS], "incremental", 1)

    # 200 steps, most of them on a part of the rings.
    ratio = turns(path, lambda: np.linalg.solve(whole, right), rounds=3)
    show("friction along a path, over a dense solution", ratio, 400)
