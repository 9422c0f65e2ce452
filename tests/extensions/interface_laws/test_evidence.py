"""Evidence against closed forms: Gaussians are integrated exactly, whatever is free in them."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from memscal import BayesFactor
from memscal.extensions.interface_laws.model_comparison import LawCurve, one_of_all
from memscal.friction.family import bounded
from memscal.friction.marginal_likelihood import (
    Statistics,
    evidence_of_each,
    log_likelihood,
    log_uniform_prior,
)

LOG_2PI = float(np.log(2 * np.pi))


def statistics(residual, systematic, noise):
    """Return what one group tells at one value: residual (n,), columns (n, q), noise (n,)."""
    r = residual / noise
    d = systematic / noise[:, None]
    return Statistics(
        np.array([r @ r]), (d.T @ r)[None], (d.T @ d)[None], np.array([2 * np.log(noise).sum()])
    )


@pytest.mark.parametrize("seed", range(4))
def test_the_likelihood_is_that_of_a_normal_distribution_with_all_that_is_uncertain(seed):
    rng = np.random.default_rng(seed)
    residual = rng.normal(size=12)
    systematic = rng.normal(size=(12, 3))
    noise = rng.uniform(0.3, 2.0, 12)
    found, chi_square = log_likelihood(statistics(residual, systematic, noise))
    covariance = np.diag(noise**2) + systematic @ systematic.T
    expected = multivariate_normal(cov=covariance).logpdf(residual)
    assert found.item() - 6 * LOG_2PI == pytest.approx(expected, rel=1e-10)
    assert chi_square.item() == pytest.approx(residual @ np.linalg.solve(covariance, residual))


def test_data_without_any_misfit_have_no_chi_square():
    _, chi_square = log_likelihood(statistics(np.zeros(4), np.ones((4, 1)), np.ones(4)))
    assert chi_square.item() == pytest.approx(0.0, abs=1e-12)


class Linear:
    """Loads whose stress is in proportion to a parameter of each, with systematic changes."""

    def __init__(self, seed, loads):
        rng = np.random.default_rng(seed)
        x = np.linspace(0, 1, 25)
        self.noise = 0.01
        self.shapes = [np.exp(-(x**2) * (1 + 0.2 * j)) for j in range(loads)]
        waves = np.stack([np.cos(k * x) / (1 + k) for k in range(6)], axis=1)
        scale = np.array([0.03, 0.01, 0, 0, 0, 0])
        self.columns = [np.outer(s, scale) + 0.005 * waves for s in self.shapes]
        change = rng.normal(size=6)
        self.data = [
            (0.3 + 0.05 * j) * s + d @ change + rng.normal(0, self.noise, x.size)
            for j, (s, d) in enumerate(zip(self.shapes, self.columns, strict=True))
        ]

    def exact(self):
        """Return the evidence under flat priors of density one, the best values, their errors."""
        n = self.shapes[0].size
        design = np.zeros((n * len(self.shapes), len(self.shapes)))
        for j, shape in enumerate(self.shapes):
            design[j * n : (j + 1) * n, j] = shape
        columns = np.vstack(self.columns)
        data = np.concatenate(self.data)
        covariance = self.noise**2 * np.eye(data.size) + columns @ columns.T
        information = design.T @ np.linalg.solve(covariance, design)
        best = np.linalg.solve(information, design.T @ np.linalg.solve(covariance, data))
        left = data - design @ best
        log = -(left @ np.linalg.solve(covariance, left) + np.linalg.slogdet(covariance)[1]) / 2
        log += (len(self.shapes) * LOG_2PI - np.linalg.slogdet(information)[1]) / 2
        return log, best, np.sqrt(np.diag(np.linalg.inv(information)))

    def along(self, load, nodes):
        """Return what a load tells at values of its parameter."""
        residuals = self.data[load] - np.outer(nodes, self.shapes[load])
        each = [statistics(r, self.columns[load], np.full(r.size, self.noise)) for r in residuals]
        return Statistics(*map(np.concatenate, zip(*each, strict=True)))


@pytest.mark.parametrize("loads", [1, 2, 4])
@pytest.mark.parametrize("seed", range(3))
def test_a_parameter_of_each_load_is_integrated_as_the_closed_form_does(seed, loads):
    # The systematic changes correlate the parameters: alone each is known ten times worse.
    model = Linear(seed, loads)
    exact, best, errors = model.exact()
    along = []
    weights = []
    for load in range(loads):
        nodes = np.linspace(best[load] - 6 * errors[load], best[load] + 6 * errors[load], 241)
        along.append(model.along(load, nodes))
        weights.append(np.gradient(nodes))
    log, error = evidence_of_each(along, weights)
    assert log == pytest.approx(exact, abs=0.02)
    assert error < 0.2
    assert evidence_of_each(along, weights) == (log, error)


def evidence(values, edges, log, prior):
    """Return the logarithm of the evidence of a law with one parameter."""
    nothing = np.zeros_like(values)
    none = Statistics(nothing, nothing, nothing, nothing)
    law = one_of_all("law", LawCurve(values, values, edges, none, log, nothing), prior, 1)
    return law.log_evidence


def test_one_parameter_is_integrated_over_its_prior():
    values = np.linspace(-8, 8, 161)
    edges = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])
    found = evidence(values, edges, -(values**2) / 2, lambda below: (below + 8) / 16)
    assert found == pytest.approx(LOG_2PI / 2 - np.log(16))


def test_a_decade_more_that_the_data_exclude_costs_its_share_of_the_evidence():
    # A likelihood that is narrow about 1: its evidence goes with the prior's density there.
    values = np.geomspace(1e-3, 1e3, 4001)
    edges = np.concatenate([values[:1], np.sqrt(values[1:] * values[:-1]), values[-1:]])
    log = -((np.log(values) / 0.05) ** 2) / 2
    two, three = (
        evidence(values, edges, log, log_uniform_prior(0.1, high)) for high in (10.0, 100.0)
    )
    assert two - three == pytest.approx(np.log(3 / 2), abs=1e-6)


@pytest.mark.parametrize(
    "prior",
    [partial(bounded, scale=0.3), log_uniform_prior(0.01, 10)],
    ids=["bounded", "log-uniform"],
)
def test_a_prior_is_shared_out_among_cells_and_adds_up_to_one(prior):
    weights = np.diff(prior(np.concatenate([[0.0], np.geomspace(1e-3, 50, 40), [np.inf]])))
    assert np.all(weights >= 0)
    assert weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (2.5, "not worth more than a bare mention"),
        (3.0, "positive"),
        (19.0, "positive"),
        (21.0, "strong"),
        (140.0, "strong"),
        (151.0, "very strong"),
    ],
)
def test_words_for_a_bayes_factor_are_those_of_kass_and_raftery(factor, words):
    # Their table: 1 to 3, 3 to 20, 20 to 150, above 150.
    assert BayesFactor("one", "other", float(np.log(factor))).words == words


def test_a_bayes_factor_beyond_all_numbers_is_infinite():
    assert BayesFactor("one", "other", 5000.0).value == np.inf
