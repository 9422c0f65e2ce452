r"""Film's law and thickness, from scans at several loads or with several rods.

The voltages of all scans, with one A and G, have a marginal likelihood :math:`p(u)` by the rods'
base stress on films of each law (:func:`~memscal.estimation.profile.log_marginal_likelihood`).
Weights and noise are common to all laws: a point is an outlier where it is one by every law, and
the noise is that of the law that leaves least.  Stated uncertainties of film, rod, positions and,
scan by scan, load are Gaussian nuisance parameters, integrated to first order; what is common to
all loads is part of A.  A thickness has the posterior mean by the same likelihood and a Gaussian
prior, and the expected squared error of it by the priors of G's uncertainty.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from memscal.calibration.stages import Solution, solve
from memscal.calibration.uncertainty import input_effects
from memscal.errors import InputError, MemscalError
from memscal.estimation.forward import forward_model
from memscal.estimation.points import loads_differ
from memscal.estimation.profile import log_marginal_likelihood
from memscal.estimation.reference_spectra import reference_spectra
from memscal.estimation.set_up import film_of
from memscal.mechanics.press_rod import is_tabulated, press_rod
from memscal.model.arrays import FloatArray, Values, value_record
from memscal.model.bayes_factor import POSITIVE, STRONG, BayesFactor
from memscal.model.checks import Message
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm, law_in_words
from memscal.model.notation import Reading, format_measured
from memscal.model.quantities import MM
from memscal.model.scan import Scan

#: Name of an input that scans may be asked to determine.
THICKNESS = "thickness"


@value_record
class WeighedLaw:
    """A law of the film: ln of its evidence up to a constant of the scans, and the result by it."""

    law: str
    log_evidence: float
    conversion_constant: float  # by the method of the calibration, in V/Pa
    gaussian_sigma: float  # in m


@value_record
class FilmLawComparison:
    """Laws of the film, by falling evidence, and that of the reference (empty: not stated)."""

    laws: Sequence[WeighedLaw]
    reference: str
    loads: Sequence[float]  # in N
    reading: Reading

    def factor(self, law: WeighedLaw) -> BayesFactor:
        """Return the Bayes factor of the best law against one."""
        best = self.laws[0]
        return BayesFactor(best.law, law.law, best.log_evidence - law.log_evidence)

    @property
    def record(self) -> list[Values]:
        """What files and JSON hold: of each law its evidence below the best's, A and sigma."""
        unit = self.reading.over(self.reading.unit)
        rows: list[Values] = []
        for law in self.laws:
            factor = self.factor(law)
            a = law.conversion_constant / self.reading.scale
            row = {
                "law": law.law,
                "is_reference": law.law == self.reference,
                "log_evidence_below_best": factor.log_factor,
                "best_against_it": factor.words if rows else None,
                "conversion_constant": {"value": a, "unit": unit},
                "gaussian_sigma": {"value": law.gaussian_sigma / MM, "unit": "mm"},
            }
            rows.append(row)
        return rows

    @property
    def message(self) -> Message:
        """The Bayes factor, and what to do where it favours another law than the reference's."""
        best = self.laws[0]
        factor = self.factor(self.laws[1])
        value = f"{factor.value:.3g}" if factor.value < 1e6 else f"{factor.value:.1e}"
        names = [law_in_words(law.law) for law in self.laws]
        text = (
            f"Loads of {min(self.loads):.3g} to {max(self.loads):.3g} N favour a {names[0]} "
            f"film over a {names[1]} one by a Bayes factor of {value} ({factor.words}). "
            f"Weighed: {', '.join(names)}."
        )
        against = best.law != self.reference
        if against and 2 * factor.log_factor >= POSITIVE:
            text += (
                f" By the {names[0]} film A = {self.reading.constant(best.conversion_constant)} and"
                f" σ = {best.gaussian_sigma / MM:.4g} mm; --film-law {best.law} makes it the "
                "reference."
            )
        strong = against and 2 * factor.log_factor >= STRONG
        return Message("film_laws", text, "warning" if strong else "note")


def weigh_laws(solution: Solution) -> FilmLawComparison | None:
    """Weigh the film's laws by scans at several loads; ``None`` where one load or law is left."""
    loads = [scan.stated_load for scan in solution.scans]
    if not (loads_differ(loads) and solution.on_films):
        return None
    films = [film_of(stress) for stress in solution.stresses]
    stated = {(film.law, film.mooney_rivlin_ratio) if film else ("", None) for film in films}
    reference, ratio = stated.pop() if len(stated) == 1 else ("", None)
    solutions = {}
    for law in dict.fromkeys((reference or LINEAR, LINEAR, NEO_HOOKEAN)):
        known = ratio if law == reference else None
        scans = []
        for scan in solution.scans:
            film = replace(scan.set_up.film, law=law, mooney_rivlin_ratio=known)
            scans.append(replace(scan, film=film))
        if law == reference:
            solutions[law] = replace(solution, scans=scans)
        # Finite elements take long: other laws are weighed where closed form or table has them.
        elif law == LINEAR or all(is_tabulated(*scan.set_up) for scan in scans):
            stresses = [press_rod(*scan.set_up) for scan in scans]
            with suppress(MemscalError):  # no apparatus function may explain the scans by it
                solutions[law] = solve(
                    scans, stresses, solution.method, solution.estimate.points.channel
                )
    if len(solutions) < 2:
        return None
    estimates = [by_law.estimate for by_law in solutions.values()]
    outlier = np.max([estimate.outlier_weight for estimate in estimates], axis=0)
    weights = solution.estimate.weights / solution.estimate.outlier_weight * outlier
    noise = min(estimate.noise_scale for estimate in estimates)
    laws = []
    for law, by_law in solutions.items():
        estimate = replace(by_law.estimate, weights=weights, outlier_weight=outlier)
        evidence = log_marginal_likelihood(estimate, _input_columns(by_law), noise)[0]
        a = by_law.deconvolution.conversion_constant
        laws.append(WeighedLaw(law, evidence, a, estimate.gaussian.sigma))
    laws.sort(key=lambda law: -law.log_evidence)
    return FilmLawComparison(laws, reference, loads, solution.scan.reading)


def _input_columns(solution: Solution, without: str = "") -> FloatArray:
    """Voltages by one standard uncertainty of each stated input, (n, q), in V."""
    estimate = solution.estimate
    effects = input_effects(solution.scans, solution.stresses, estimate)
    columns = [
        effect.voltage
        for name, effect in effects.items()
        if name != "load" and name.rstrip("0123456789") != without
    ]
    # A balance's error may differ from load to load; repeats at one load share it.
    pairs = zip(solution.owners, solution.scans, strict=True)
    balances = [(owner, scan.stated_load, scan.load_uncertainty) for owner, scan in pairs]
    for balance in dict.fromkeys(balances):
        _, load, u = balance
        weighed = np.array([other == balance for other in balances])[estimate.points.scan]
        columns.append(np.where(weighed, estimate.signal * (u or 0.0) / load, 0.0))
    return np.column_stack(columns)


@value_record
class FreeThickness:
    """Posterior of the thickness of films by scans: each film as stated, and as estimated."""

    films: Mapping[ElasticFilm, ElasticFilm]

    @property
    def record(self) -> Values:
        """What files and JSON hold: prior and posterior of each film's thickness."""
        rows = [
            {"film": prior.name, "prior": _thickness(prior), "posterior": _thickness(posterior)}
            for prior, posterior in self.films.items()
        ]
        return {THICKNESS: rows}

    @property
    def messages(self) -> list[Message]:
        """Prior and posterior in words, and how much the data moved the one to the other."""
        messages = []
        for prior, posterior in self.films.items():
            u = prior.thickness_uncertainty or 1.0
            left = posterior.thickness_uncertainty or 0.0
            moved = (posterior.thickness - prior.thickness) / u
            text = (
                f"The thickness of the film {prior.name}".rstrip() + f" is {_written(posterior)} "
                f"by the scans, from {_written(prior)} as stated: moved by {moved:+.2g} of the "
                f"stated standard uncertainty, of which {left / u:.0%} is left."
            )
            if left > _HARDLY * u:
                text += " The scans hardly determine it: it is what was stated."
            messages.append(Message("free", text, "warning" if abs(moved) > _FAR_OFF else "note"))
        return messages


def _thickness(film: ElasticFilm) -> Values:
    u = (film.thickness_uncertainty or 0.0) / MM
    return {"value": film.thickness / MM, "standard_uncertainty": u, "unit": "mm"}


def _written(film: ElasticFilm) -> str:
    return format_measured(film.thickness / MM, (film.thickness_uncertainty or 0.0) / MM, "mm")


#: A posterior this many standard uncertainties of its prior away contradicts it, and one that is
#: as wide as this share of the prior is hardly of the scans.
_FAR_OFF = 2.0
_HARDLY = 0.9
#: Nodes along each thickness, of one film or two, and how far from the prior's middle they reach,
#: in its standard uncertainties; when they are set finer, in the posterior's.
_NODES = (9, 7)
_REACH = 3.0
_WIDTHS = 4.0
_ROUNDS = 3


def require_free(
    free: str | Sequence[str], scans: Sequence[Scan], stated: Sequence[object]
) -> None:
    """Refuse to free what scans do not determine; ``stated``: references that were given."""
    for name in [free] if isinstance(free, str) else free:
        if name != THICKNESS:
            raise InputError(f"There is no free input {name!r}.", cure=f"Give {THICKNESS!r}.")
    rods = {scan.set_up.indenter for scan in scans}
    laws = {scan.set_up.film.law for scan in scans}
    at_loads = loads_differ([s.stated_load for s in scans]) and laws.isdisjoint(("", LINEAR))
    if len(rods) < 2 and not at_loads:
        raise InputError(
            "The scans do not determine the film's thickness.",
            why="With one rod, at one load or on a linear film, whose voltage is in proportion to "
            "the load, a thicker film looks like a wider apparatus function.",
            cure="Give scans with rods of several radii, or at several loads on a film of another "
            "stated law.",
        )
    films = {scan.film for scan in scans}
    if len(films) > len(_NODES):
        raise InputError(
            f"The scans have {len(films)} films of unknown thickness.",
            cure=f"Give scans on at most {len(_NODES)} films.",
        )
    if not all(scan.set_up.film.thickness_uncertainty for scan in scans):
        raise InputError(
            "A film states no uncertainty of its thickness.",
            why="It is the standard deviation of the prior of a thickness that is estimated.",
            cure="State it (memscal import --thickness-uncertainty, or "
            "/entry/sample/film/thickness_uncertainty).",
        )
    if any(stated) or any(scan.reference for scan in scans):
        raise InputError(
            "A reference is given, of one thickness.",
            why="To estimate the thickness the rod is solved on films of others.",
            cure="Leave the reference out, of the scan's file as well.",
        )


def free_thickness(solution: Solution) -> FreeThickness:
    """Estimate the thickness of each film, from its stated one as a Gaussian prior."""
    scans = solution.scans
    estimate = solution.estimate
    films = list(dict.fromkeys(scan.set_up.film for scan in scans))
    stated = np.array([film.thickness for film in films])
    u = np.array([film.thickness_uncertainty or 0.0 for film in films])
    points = [estimate.points.only(i) for i in range(len(scans))]
    inputs = _input_columns(solution, THICKNESS)
    nodes = estimate.model.reference.wavenumbers

    def log_posterior(z: FloatArray) -> FloatArray:
        varied = {
            film: replace(film, thickness=float(thickness))
            for film, thickness in zip(films, stated + z * u, strict=True)
        }
        rods = [press_rod(*s.set_up._replace(film=varied[s.set_up.film])) for s in scans]
        model = forward_model(estimate.points, reference_spectra(rods, points, nodes))
        varied_estimate = replace(estimate, model=model)
        return log_marginal_likelihood(varied_estimate, inputs, estimate.noise_scale) - z @ z / 2

    # Sums over a grid, which are good to 1e-2 while its step is at most twice the width of a normal
    # density; where the posterior is narrower it is made finer.
    middle = np.zeros(u.size)
    reach = np.full(u.size, _REACH)
    for _ in range(_ROUNDS):
        lines = np.linspace(middle - reach, middle + reach, _NODES[u.size - 1], axis=1)
        grid = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, u.size)
        logs = np.array([log_posterior(z) for z in grid])
        shares, others = np.exp(logs - logs.max(axis=0)).T
        middle = shares @ grid / shares.sum()
        # As of G: the squared error is expected by priors that allow no Gaussian.
        spread = np.sqrt(others @ (grid - middle) ** 2 / others.sum())
        half_step = (lines[:, 1] - lines[:, 0]) / 2
        if (spread > half_step).all():
            break
        reach = np.minimum(reach, _WIDTHS * np.maximum(spread, half_step))
    posterior = np.column_stack([stated + middle * u, np.minimum(spread, 1.0) * u])
    estimated = {
        film: replace(film, thickness=thickness, thickness_uncertainty=left)
        for film, (thickness, left) in zip(films, posterior.tolist(), strict=True)
    }
    return FreeThickness(estimated)
