"""Calibration: from rod scans to an apparatus function with its covariance and checks."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from os import PathLike
from typing import Any, ClassVar, TypeAlias

import numpy as np
import scipy

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.calibration.checks import quality_checks
from memscal.calibration.drawn_scatter import draw_count, drawn_scatter, is_linear
from memscal.calibration.stages import COMMON, PER_REPEAT, Deconvolution, Solution, solve
from memscal.calibration.sweep import Sweep, sweep_noise
from memscal.calibration.uncertainty import InputEffect, Results, input_effects, propagate
from memscal.deconvolution.division import Method, chosen_method
from memscal.errors import InputError
from memscal.estimation.bayesian import HYPOTHESES, Bayesian
from memscal.estimation.points import loads_differ
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference import (
    reference_profile,
    reference_spectra,
    require_calibration_rod,
    require_one_sensor,
)
from memscal.formats.opened import Scans, opened_scans
from memscal.mechanics.contact import Contact
from memscal.model.apparatus import (
    ApparatusField,
    ApparatusRadial,
    OtherEstimate,
    Reconvolution,
    TransferFunction,
)
from memscal.model.checks import (
    NOISE_UNSTATED,
    OUTLIER_WEIGHT,
    REPEAT_CENTRES,
    Message,
    QualityCheck,
    failed_check_messages,
)
from memscal.model.indenter import RoundIndenter
from memscal.model.provenance import Process, timestamp
from memscal.model.result import Result
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.parallel import single_threaded
from memscal.version import __version__

#: Parameters that differ between a division and the Bayesian estimate.
_OF_A_ROUTE = ("conversion_constant", "gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area")


def assemble(
    solution: Solution,
    results: Results,
    other: Results | None,
    checks: tuple[QualityCheck, ...],
    messages: tuple[Message, ...],
    configuration: Mapping[str, Any],
) -> ApparatusFunction:
    """Return the apparatus function with everything that its artifact stores."""
    scan, stress, channel = solution.scan, solution.stress, solution.estimate.points.channel
    reference = stress.profile() if isinstance(stress, Contact) else stress
    versions = {"numpy": np.__version__, "scipy": scipy.__version__}
    record: dict[str, Any] = {
        **configuration,
        "grid": dict(solution.choice.reasons),
        "relevant_wavenumber_rad_per_mm": solution.band.relevant * 1e-3,
    }
    if max(solution.owners) > 0:
        # Repeats that are fitted as scans have the source of the scan that they belong to.
        of_scans = dict(zip(solution.owners, solution.scans, strict=True))
        sources = [of_scans[i].source for i in range(1, len(of_scans))]
        record["further_scans"] = [
            s and {"file_name": s.file_name, "sha256": s.sha256} for s in sources
        ]
    g, errors = solution.deconvolution.g, np.sqrt(np.diag(results.radial_covariance))
    return ApparatusFunction(
        field=ApparatusField(g.x, g.y, g.image, np.interp(np.hypot.outer(g.y, g.x), g.r, errors)),
        radial_profile=_radial(solution, solution.deconvolution, results),
        transfer=_transfer(solution, results),
        reconvolution=_reconvolution(solution),
        parameters=results.parameters,
        checks=checks,
        film=scan.film,
        indenter=scan.indenter,
        sensor=scan.sensor if channel == "zz" else replace(scan.sensor, channel=channel),
        load=scan.load,
        reference=reference,
        process=Process(
            program="memscal",
            version=__version__,
            date=timestamp(),
            configuration=record,
            environment={"python": platform.python_version(), **versions},
            messages=messages,
            input_scan=scan.source,
            input_reference=reference.source,
        ),
        budget=results.budget,
        other=_other(solution, other),
    )


def _other(solution: Solution, results: Results | None) -> OtherEstimate | None:
    """Return the estimate by the other route, with what is its own."""
    if solution.other is None or results is None:
        return None
    parameters = results.parameters.only(_OF_A_ROUTE)
    method = "white-noise" if isinstance(solution.method, Bayesian) else "bayesian"
    return OtherEstimate(method, parameters, _radial(solution, solution.other, results))


def _radial(solution: Solution, deconvolution: Deconvolution, results: Results) -> ApparatusRadial:
    g, covariance = deconvolution.g, results.radial_covariance
    gaussian = unit_gaussian(g.r, solution.estimate.gaussian.sigma)
    errors = np.sqrt(np.diag(covariance))
    with_a = results.cross_covariance[:, results.parameters.names.index("conversion_constant")]
    scale = errors * results.parameters.uncertainty("conversion_constant")
    correlation = np.divide(with_a, scale, out=np.zeros_like(with_a), where=scale > 0)
    return ApparatusRadial(g.r, g.radial, errors, gaussian, covariance, correlation)


def _transfer(solution: Solution, results: Results) -> TransferFunction:
    fields, deconvolution = solution.fields, solution.deconvolution
    a, quotient = deconvolution.conversion_constant, deconvolution.quotient
    k, modulus = fields.along_axis(np.abs(fields.grid.transfer(quotient.values)) / a)
    window = fields.along_axis(quotient.window)[1]
    return TransferFunction(k, modulus, results.transfer_errors, window, solution.band.resolved)


def _reconvolution(solution: Solution) -> Reconvolution:
    estimate, points = solution.estimate, solution.estimate.points
    # A raster is shown against the distance from the centre, a line against the position.
    along = points.x if points.free[0, 0] else points.y
    place = estimate.distance if points.planar or points.scans > 1 else along
    if solution.per_repeat and not points.planar and max(solution.owners) == 0:
        # Repeats of one line are shown with their centres at that of the first.
        axis = int(np.argmax(points.free[0]))
        place = estimate.offset[axis] + estimate.centre[axis]
    elif points.scans > 1 and estimate.model.order:
        # The sign of a shear depends on the side.
        place = estimate.offset[estimate.model.axis]
    order = np.argsort(place, kind="stable")

    predicted = solution.deconvolution.predicted
    return Reconvolution(
        x=place[order],
        u_zz=points.u[order],
        u_zz_errors=estimate.noise[order],
        u_zz_predicted=predicted[order],
        u_zz_gaussian=estimate.gaussian.predicted[order],
        residual=(points.u - predicted)[order],
    )


#: Methods whose window is that of the stress's transform: nothing is left to say of them.
_WINDOWS = ("white-noise", "tikhonov", "bayesian")
_LINEAR = (*_WINDOWS, "wiener")
#: Tails of less probability are not told.
_LEAST_TOLD = 0.001
#: Relative difference below which two lengths or ratios are the same.
_SAME = 1e-6


def calibration_messages(
    solution: Solution, checks: tuple[QualityCheck, ...]
) -> tuple[Message, ...]:
    """Return the messages that accompany a result, warnings first."""
    scan, channel = solution.scan, solution.estimate.points.channel
    messages = failed_check_messages(checks)
    if solution.estimate.model.order:
        text = (
            f"Channel {channel} is experimental: it was tested on synthetic data only. A and G are "
            "those of the shear at the base; the voltage is positive where the film pulls the "
            f"sensor towards larger {channel[0]}."
        )
        messages.append(Message("experimental", text))
    messages += _centres(solution) + _points(solution.estimate) + _tails(solution.estimate)
    messages += _method(solution) + _reference(solution)
    messages += _unstated(scan)
    if scan.synthetic is not None:
        messages.append(Message("synthetic", "The scan is synthetic: its truth is stored in it."))
    return tuple(messages)


def _centres(solution: Solution) -> list[Message]:
    """Return that repeats have centres of their own, and why."""
    if not solution.per_repeat:
        return []
    owners, centres = np.array(solution.owners), solution.estimate.centres
    apart = max(float(np.ptp(centres[owners == i], axis=0).max()) for i in set(owners))
    test, way = solution.apart, "as asked for (--centre per-repeat)"
    if test is not None:
        way = f"as one centre has a p-value of {test.p_value:.1g} (--centre common takes one)"
    text = (
        f"Each of the {owners.size} repeats has its own centre, baseline and drift, {way}. The "
        f"centres are up to {apart * 1e6:.3g} um apart."
    )
    return [Message(REPEAT_CENTRES, text)]


def _points(estimate: ProfileEstimate) -> list[Message]:
    points = estimate.points
    messages: list[Message] = []
    if points.missing:
        text = f"{points.missing} points of the scan are missing and were left out."
        messages.append(Message("missing_points", text))
    for i in (estimate.outlier_weight < OUTLIER_WEIGHT).nonzero()[0]:
        place = f"x = {points.x[i] * 1e3:.4g} mm"
        if points.planar:
            place += f", y = {points.y[i] * 1e3:.4g} mm"
        if points.repeat.any():
            place += f" of repeat {points.repeat[i]}"
        voltages = f"{points.u[i] * 1e3:.4g} mV instead of {estimate.predicted[i] * 1e3:.4g} mV"
        text = f"Outlier at {place}: {voltages}; its weight is {estimate.outlier_weight[i]:.2g}."
        messages.append(Message("outlier", text))
    if points.u_errors is None:
        text = (
            f"u_{points.channel}_errors is absent: a noise of {estimate.noise_scale * 1e3:.3g} mV "
            "was estimated from the scan's scatter, so that chi-square cannot tell noise from "
            "misfit of the same size, and has no p-value."
        )
        messages.append(Message(NOISE_UNSTATED, text))
    return messages


def _tails(estimate: ProfileEstimate) -> list[Message]:
    """Return what a tail that the scan hardly tells from the baseline would change in A."""
    probability, change = estimate.weighed.of_kind("wide tail")
    if probability < _LEAST_TOLD:
        return []
    prior = sum(h.estimate for h in HYPOTHESES if h.kind == "wide tail")
    a = estimate.conversion_constant
    text = (
        "Tails of G two to three times as wide as its core have a probability of "
        f"{probability:.2g} (prior {prior:.2g}). With them A by method bayesian is "
        f"{abs(change) / a:.2%} {'larger' if change > 0 else 'smaller'} than without; it is the "
        "mean of both."
    )
    return [Message("wide_tails", text)]


def _method(solution: Solution) -> list[Message]:
    """Return where the uncertainty comes from if the method is no plain window."""
    method = solution.method
    if method.name in _WINDOWS:
        return []
    way = "uncertainties are first-order through its effective window"
    if not is_linear(method):
        way = "what noise adds to the uncertainties is the scatter of "
        way += f"{draw_count(solution)} draws of the voltages"
        way += " and of its own random numbers" if hasattr(method, "seed") else ""
    return [Message("method", f"Method {method.name}: {way}. {method.fails}")]


def _reference(solution: Solution) -> list[Message]:
    stress, scan = solution.stress, solution.scan
    if isinstance(stress, Contact):
        return [Message("model_form", _model_form(stress))]
    messages = _other_set_up(scan, stress)
    if stress.convergence is None:
        text = "The reference states no convergence: its own error is not counted."
        messages.append(Message("convergence_unstated", text))
    return messages


def _model_form(contact: Contact) -> str:
    """Return what the reference assumes."""
    way = "frictionless" if contact.friction == 0 else "sticking"
    depth = f"{contact.depth / contact.film.thickness:.0%} of its thickness at {contact.load:.3g} N"
    if contact.strain == "finite":
        return (
            f"The reference is the {way} rod on a neo-Hookean film at finite strain, indented by "
            f"{depth}; it is used in proportion to the load, and how far the film's own law "
            "departs from it is not part of the uncertainties."
        )
    return (
        f"The reference is the {way} rod on the linear elastic film, indented by {depth}; the "
        "error of linear elasticity there is not part of the uncertainties. A reference at finite "
        "strain (memscal reference rod --strain finite --friction inf) shows what it changes."
    )


def _other_set_up(scan: Scan, stress: StressProfile) -> list[Message]:
    """Return where a reference was made for another film or indenter than the scan's."""
    pairs = []
    if stress.film is not None:
        for name, unit in (("thickness", 1e3), ("poisson_ratio", 1.0)):
            ours, theirs = getattr(scan.film, name), getattr(stress.film, name)
            pairs.append((f"film {name.replace('_', ' ')}", ours * unit, theirs * unit))
    if isinstance(stress.indenter, RoundIndenter):
        pairs.append(("rod radius", scan.indenter.radius * 1e3, stress.indenter.radius * 1e3))
    return [
        Message(
            "other_set_up",
            f"The reference was made for another {name} than the scan's: {theirs:.4g} instead of "
            f"{ours:.4g}{'' if 'ratio' in name else ' mm'}.",
        )
        for name, ours, theirs in pairs
        if abs(theirs - ours) > _SAME * abs(ours)
    ]


def _unstated(scan: Scan) -> list[Message]:
    film = scan.film
    missing = {
        "film thickness": film.thickness_uncertainty,
        "Poisson's ratio": film.poisson_ratio_uncertainty,
        "rod radius": scan.indenter.radius_uncertainty,
        "load": scan.load_uncertainty,
    }
    names = [name for name, value in missing.items() if value is None]
    pronoun = "them" if len(names) > 1 else "it"
    text = f"No uncertainty is stated for {', '.join(names)}: nothing is counted for {pronoun}."
    return [Message("uncertainty_unstated", text)] if names else []


Reference: TypeAlias = StressProfile | Contact | str | PathLike[str] | None
"""A base stress, the path of a file that holds one, or nothing: the rod is solved."""


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Result):
    """A finished calibration: its result, and every step that led to it.

    Parameters
    ----------
    apparatus : ApparatusFunction
        The result, ready to be saved and applied.
    solution : Solution
        The steps: estimate, band, fields, deconvolution.
    effects : mapping of str to InputEffect
        What one standard uncertainty of each stated input does.
    correlations : mapping of (str, str) to float
        Correlation coefficients of the inputs' errors.
    """

    _summary: ClassVar[str] = "calibration"
    _figure: ClassVar[str] = "calibration.calibration_figure"

    apparatus: ApparatusFunction
    solution: Solution
    effects: Mapping[str, InputEffect] = field(default_factory=dict)
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return method and result, without arrays."""
        return f"<Calibration by {self.solution.method.name}: {self.apparatus!r}>"

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return self.apparatus.passed

    @single_threaded()
    def sweep(self, *, amplitudes: int = 21, draws: int = 8, seed: int = 0) -> Sweep:
        """Vary the white noise over two decades of amplitude, and over seeds.

        Parameters
        ----------
        amplitudes : int
            How many amplitudes, from a tenth to ten times the rule's; three or more.
        draws : int
            How many seeded draws at each; one or more.
        seed : int
            The first seed.

        Returns
        -------
        Sweep
            A, both widths and the reconvolution for each.

        Raises
        ------
        InputError
            If a number is out of range, or the scan's fields cannot be divided.
        """
        return sweep_noise(self.solution, amplitudes=amplitudes, draws=draws, seed=seed)


@single_threaded()
def calibrate(
    scan: Scans,
    *,
    reference: Reference | Sequence[Reference] = None,
    alternative: Reference | Sequence[Reference] = None,
    channel: str = "zz",
    method: str | Method = "white-noise",
    centre: str | None = None,
    correlations: Mapping[tuple[str, str], float] | None = None,
    free: str | Sequence[str] = (),
    seed: int = 0,
    **options: Any,
) -> Calibration:
    r"""Find the apparatus function of a sensor from a rod scan, or from several.

    Solves :math:`U_{zz} = A\,G \otimes \sigma_{zz}` (the paper's Eq. 1) for the conversion
    constant A and the apparatus function G of unit integral.  A tangential channel, experimental,
    is solved with the shear at the base: :math:`U_{xz} = A\,G \otimes \tau\cos\theta`.

    Parameters
    ----------
    scan : Scan or path, or a sequence of them
        Voltage against the rod's position.  Several scans of one sensor, at other loads, with
        other rods or films, along x or y, are fitted together.
    reference : StressProfile, Contact or path, optional
        Stress at the base of the film, one for each scan.  By default the one that travels with
        the scan; without that, the rod is solved on the film.
    alternative : StressProfile, Contact or path, optional
        The same by another model of the film, such as finite strain.  Its difference is counted
        as a rectangular uncertainty of the model's form, ``model_form``.
    channel : str, default "zz"
        ``"xz"`` or ``"yz"`` calibrates a tangential channel with the scan's ``u_xz`` or ``u_yz``,
        by method ``"bayesian"``; see docs/tangential.md.
    method : str or Regulariser, default "white-noise"
        Whose A and G the result has.  ``"white-noise"``, the paper's, divides the field of the
        smoothed voltages; :func:`memscal.deconvolution.division.regulariser_names` lists other
        divisions.  ``"bayesian"`` takes A and G from the scan's points: the smaller error, for
        friction.  ``.apparatus.other`` is the estimate by the other route.
    centre : str, optional
        ``"common"``: one centre for all repeats of a scan; ``"per-repeat"``: a centre, baseline and
        drift for each.  By default the latter only for lines whose repeats have no common centre,
        by an F test at 1/1000 (check ``repeat_centres``); a message says so.
    correlations : mapping of (str, str) to float, optional
        Coefficients of the inputs' errors, such as ``{("thickness", "poisson_ratio"): 0.5}``.
    free : str or sequence of str
        ``"thickness"`` estimates the thickness of the film from scans with several rods, or at
        several loads on a film of a stated law that is not linear; what the film states is its
        Gaussian prior.  The film of the result has the posterior mean and standard uncertainty.
    seed : int, default 0
        Seed of methods that draw random numbers.
    **options
        Parameters of the method, such as ``amplitude``.

    Returns
    -------
    Calibration
        With ``.apparatus``; its quality checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If the scan or the reference cannot be used.
    FitError
        If the scan does not determine the parameters.

    Examples
    --------
    >>> import memscal
    >>> calibration = memscal.calibrate(memscal.simulate(noise=0.005, seed=1))
    >>> 0.54e-3 < calibration.apparatus.gaussian_sigma < 0.58e-3
    True
    """
    scans, pairs = require_one_sensor(opened_scans(scan)), correlations or {}
    for rod_scan in scans:
        require_calibration_rod(rod_scan)
    references = _references(reference, scans)
    stresses = [reference_profile(s, r) for s, r in zip(scans, references, strict=True)]
    chosen = chosen_method(method, options, seed=seed)
    if centre not in (None, COMMON, PER_REPEAT):
        problem = f"There is no choice of centre {centre!r}."
        raise InputError(problem, cure=f"Give {COMMON!r} or {PER_REPEAT!r}, or leave it out.")
    freed = None
    if free:
        from memscal.calibration.film_inference import free_thickness, require_free

        require_free(free, scans, references)
        freed = free_thickness(solve(scans, stresses, chosen, channel, both=False, centre=centre))
        scans = tuple(freed.of(scans))
        stresses = [reference_profile(s, None) for s in scans]
    solution = solve(scans, stresses, chosen, channel, centre=centre)
    effects = _effects(solution, None if alternative is None else _references(alternative, scans))
    results = uncertainties(solution, solution.deconvolution, effects, pairs)
    beside = solution.other
    other = None if beside is None else uncertainties(solution, beside, effects, pairs)
    checks = quality_checks(solution, results)
    messages = calibration_messages(solution, checks)
    of_method: Any = chosen
    settings = asdict(of_method) if is_dataclass(chosen) else {}
    configuration: dict[str, Any] = {"method": chosen.name, "seed": seed, "options": settings}
    if freed is not None:
        messages = (*freed.messages, *messages)
        configuration["free"] = freed.record
    if loads_differ([s.load for s in solution.scans]):
        from memscal.calibration.film_inference import weigh_laws

        if (compared := weigh_laws(solution)) is not None:
            messages = (compared.message, *messages)
            configuration["film_laws"] = compared.record
    if channel != "zz":
        configuration["channel"] = channel
    if centre is not None or solution.apart is not None:
        choice = PER_REPEAT if solution.per_repeat else COMMON
        configuration["centre"] = {"choice": choice, "chosen_by": "option" if centre else "test"}
        if solution.apart is not None:
            configuration["centre"]["p_value"] = solution.apart.p_value
    if pairs:
        configuration["correlations"] = {" ".join(pair): c for pair, c in pairs.items()}
    apparatus = assemble(solution, results, other, checks, messages, configuration)
    return Calibration(apparatus, solution, effects, dict(pairs))


def _references(
    reference: Reference | Sequence[Reference], scans: Sequence[Scan]
) -> list[StressProfile | Contact | None]:
    """Read a reference for each scan; a single one is that of all scans."""
    if isinstance(reference, Sequence) and not isinstance(reference, str):
        if len(reference) != len(scans):
            count = "is one scan" if len(scans) == 1 else f"are {len(scans)} scans"
            problem = f"{len(reference)} references were given, but there {count}."
            cure = "Give one for each scan, in their order, or one for all."
            raise InputError(problem, cure=cure)
        return [_read(item) for item in reference]
    return [_read(reference)] * len(scans)


def _read(reference: Reference) -> StressProfile | Contact | None:
    if isinstance(reference, str | PathLike):
        from memscal.formats.reference import read_reference

        return read_reference(reference)
    if reference is None or isinstance(reference, StressProfile | Contact):
        return reference
    raise InputError(
        f"The reference is a {type(reference).__name__}.",
        cure="Give a contact from memscal.indent(), a StressProfile, or the path of a file.",
    )


def _effects(
    solution: Solution, alternatives: Sequence[StressProfile | Contact | None] | None
) -> Mapping[str, InputEffect]:
    scans, estimate = solution.scans, solution.estimate
    spectra = None
    if alternatives is not None:
        pairs = zip(solution.owners, solution.stresses, strict=True)
        stresses = [alternatives[i] or stress for i, stress in pairs]
        points = [estimate.points.only(i) for i in range(len(scans))]
        spectra = reference_spectra(stresses, points, [scan.film.thickness for scan in scans])
    return input_effects(scans, solution.stresses, estimate, spectra)


def uncertainties(
    solution: Solution,
    deconvolution: Deconvolution,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
) -> Results:
    """Propagate noise and inputs through the steps of one route."""
    wavenumbers = solution.fields.along_axis(deconvolution.quotient.window)[0]
    # A linear method's derivatives are complete; of another, the scatter of draws is taken.
    linear = deconvolution is not solution.deconvolution or solution.method.name in _LINEAR
    drawn = None if linear else drawn_scatter(solution)
    return propagate(solution, deconvolution, wavenumbers, effects, correlations, drawn)
