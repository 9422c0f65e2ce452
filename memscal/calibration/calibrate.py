"""Calibration: from rod scans to an apparatus function with its covariance and checks."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, Unpack

from memscal.apparatus import ApparatusFunction
from memscal.calibration.assemble import assemble
from memscal.calibration.assumptions import (
    assumptions_of,
    at_offsets,
    less_mean_offset,
    with_slow_noise,
)
from memscal.calibration.checks import quality_checks
from memscal.calibration.diagnosis import naming_ceiling
from memscal.calibration.drawn_scatter import drawn_scatter
from memscal.calibration.explanations import explained
from memscal.calibration.fields import RasterFields
from memscal.calibration.film_inference import free_thickness, require_free, weigh_laws
from memscal.calibration.prepare import Prepared, References, Request, prepare
from memscal.calibration.stages import Deconvolution, Solution, solve
from memscal.calibration.uncertainty import Correlations, Effects, Results, input_effects, propagate
from memscal.deconvolution.division import Method, MethodName, chosen_method
from memscal.errors import FitError, MemscalError
from memscal.estimation.profile import LEAST_DISTINCT
from memscal.estimation.reference_spectra import expected_spectra, reference_spectra
from memscal.estimation.set_up import reference_profile
from memscal.extensions import hook
from memscal.formats.opened import Scans, opened_scans
from memscal.mechanics.contact import BaseStress, Contact
from memscal.mechanics.press_rod import press_rod
from memscal.model.arrays import array_record
from memscal.model.assumptions import Assumption
from memscal.model.film import LINEAR, FilmLaw
from memscal.model.notation import VOLTS, Reading
from memscal.model.result import Result
from memscal.model.scan import Scan
from memscal.model.sizes import MOST_OF_LINES
from memscal.parallel import single_threaded
from memscal.progress import Watched, done_with, in_steps, reported

if TYPE_CHECKING:
    from memscal import Sweep

#: Sources of what a scan leaves open.
_OF_THE_SCAN = ("noise", "regularisation", "window")


@array_record
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

    Examples
    --------
    >>> import memscal
    >>> calibration = memscal.calibrate(memscal.simulate(seed=1))
    >>> calibration.passed, calibration.apparatus.process.configuration["method"]
    (True, 'white-noise')
    >>> sorted(calibration.to_dict()["conversion_constant"])  # print(calibration): the tables
    ['standard_uncertainty', 'unit', 'value']
    """

    apparatus: ApparatusFunction
    solution: Solution
    effects: Effects = field(default_factory=dict)
    correlations: Correlations = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return method and result, without arrays."""
        return f"<Calibration by {self.solution.method.name}: {self.apparatus!r}>"

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return self.apparatus.passed

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """What the result takes for granted, with the sizes at which that would matter."""
        return self.apparatus.assumptions

    @single_threaded()
    def sweep(self, *, amplitudes: int = 21, draws: int = 8, seed: int = 0) -> "Sweep":
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
        swept = hook("sweep_noise")(self.solution, amplitudes=amplitudes, draws=draws, seed=seed)
        sweep: Sweep = replace(swept, reading=self.apparatus.reading)
        return sweep


@reported
@in_steps("Gaussian fit", "departures", "division", "uncertainties", "checks")
@single_threaded()
def calibrate(
    scan: Scans,
    *,
    reference: References = None,
    alternative: References = None,
    film_law: FilmLaw | None = None,
    mooney_rivlin_ratio: float | None = None,
    rod_friction: float | None = None,
    channel: Literal["zz", "xz", "yz"] = "zz",
    method: MethodName | Method = "white-noise",
    options: Mapping[str, Any] | None = None,
    centre: Literal["common", "per-repeat"] | None = None,
    correlations: Correlations | None = None,
    pixel_size: float | None = None,
    free: Literal["thickness"] | Sequence[Literal["thickness"]] = (),
    noise_record: Scan | str | PathLike[str] | None = None,
    creep: Any = None,
    seed: int = 0,
    override: bool = False,
    accept_altered: bool = False,
    relative: bool = False,
    other: bool = True,
    **progress: Unpack[Watched],  # noqa: ARG001 - @reported
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
    reference : StressProfile, Contact, IdealReference, path or str, optional
        Stress at the base of the film, one for each scan.  By default the one that travels with
        the scan; without that, the rod is solved on the film.  ``"disc:0.5mm"``, ``"slit:200um"``,
        ``"gaussian:0.3mm"`` and ``"point"`` are sources in place of a stress, of which A is the
        reading per unit (:class:`memscal.IdealReference`), as is a :class:`memscal.StressField` or
        the file of one: film and rod are not used, and loads are strengths relative to the load of
        the first scan.
    alternative : StressProfile, Contact or path, optional
        The same by another model of the film.  Its difference is counted as a rectangular
        uncertainty of the model's form, ``model_form``, in place of the linear film's.
    film_law : str, optional
        Law by which the rod is solved: ``"linear"``, ``"neo-hookean"`` or ``"mooney-rivlin"`` (with
        ``mooney_rivlin_ratio``, :math:`C_2/C_1`).  By default the law that scan or reference
        state; it counts as known.  Where none is stated the reference is that of a neo-Hookean
        film, and its difference from a linear one is counted as ``model_form``.
    rod_friction : float, optional
        0 or ``inf``: whether the film slides freely under the rod or sticks, which matters at
        finite strain.  By default as the scan states it; else the reference is midway, and half
        the difference is counted.
    channel : str, default "zz"
        ``"xz"`` or ``"yz"`` calibrates a tangential channel with the scan's ``u_xz`` or ``u_yz``,
        by method ``"bayesian"``; see docs/tangential.md.
    method : str or Method, default "white-noise"
        Whose A and G the result has.  ``"white-noise"``, the paper's, divides the field of the
        smoothed voltages; ``tikhonov``, ``wiener`` and more are other
        divisions.  ``"bayesian"`` takes A and G from the scan's points: the smaller error, for
        friction.  ``.apparatus.other`` is the estimate by the other route.
    options : mapping of str to value, optional
        Parameters of a method that is given by its name, such as ``{"amplitude": 2.0}``.
    centre : str, optional
        ``"common"``: one centre for all repeats of a scan; ``"per-repeat"``: a centre, baseline and
        drift for each.  By default the latter only for lines whose repeats have no common centre,
        by an F test at 1/1000 (check ``repeat_centres``); a message says so.
    correlations : mapping of (str, str) to float, optional
        Coefficients of the inputs' errors, such as ``{("thickness", "poisson_ratio"): 0.5}``.
    pixel_size : float, optional
        Size of the pixels of a reference that is an array or image, in m.
    free : str or sequence of str
        ``"thickness"`` estimates the thickness of the film from scans with several rods, or at
        several loads on a film of a stated law that is not linear; what the film states is its
        Gaussian prior.  The film of the result has the posterior mean and standard uncertainty.
    noise_record : Scan or path, optional
        Readings of the sensor at rest (``memscal import --noise-record``), whose noise, in size and
        correlation, the scans' readings have at their times, in place of a stated one.
    creep : path, optional
        Creep of the sensor that ``memscal creep`` has found, or its file, for scans made in motion:
        A and G are then those at the end of its dwell record.
    seed : int, default 0
        Seed of methods that draw random numbers.
    override : bool, default False
        Accept a reference or alternative of another film, rod or load than the scan's; recorded.
    accept_altered : bool, default False
        Accept files whose content does not fit their digest; recorded like what is overridden.
    relative : bool, default False
        For scans at constant depth, or of unknown load: loads count for nothing, A is the reading
        by the reference over its largest stress, and no result states pascals from it.
    other : bool, default True
        Whether ``.apparatus.other``, the estimate by the other route, is calculated, too.
    progress : callable or True, optional
        Told of the steps that are done, and of parts of long ones: :class:`memscal.Progress`.

    Returns
    -------
    Calibration
        With ``.apparatus``; its quality checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If the scan or the reference cannot be used, or not together.
    FitError
        If the scan does not determine the parameters.

    Examples
    --------
    >>> import memscal
    >>> calibration = memscal.calibrate(memscal.simulate(seed=1))
    >>> 0.54e-3 < calibration.apparatus.gaussian_sigma < 0.58e-3
    True
    """
    scans = opened_scans(
        scan, MOST_OF_LINES, accept_altered=accept_altered, noise_record=noise_record
    )
    request = Request(
        method=chosen_method(method, options, seed=seed),
        reference=reference,
        alternative=alternative,
        film_law=film_law,
        mooney_rivlin_ratio=mooney_rivlin_ratio,
        rod_friction=rod_friction,
        channel=channel,
        centre=centre,
        correlations=correlations or {},
        pixel_size=pixel_size,
        free=free,
        seed=seed,
        override=override,
        accept_altered=accept_altered,
        relative=relative,
        creep=creep,
    )
    prepared = prepare(scans, request)
    with naming_ceiling(prepared.scans, channel):
        if free:
            prepared = _with_thickness(prepared)
        solution = with_slow_noise(less_mean_offset(at_offsets(_solved(prepared))))
        effects = _effects(solution, prepared.alternatives)
        results, by_other_route = _propagated(solution, effects, prepared, other=other)
    done_with("uncertainties")
    assumptions = assumptions_of(solution, results, loads=prepared.reading.per == "Pa")
    checks = tuple(quality_checks(solution, results, by_other_route, assumptions))
    checks, explanations = explained(solution, checks)
    done_with("checks")
    laws = None if relative or solution.stress.form else weigh_laws(solution)
    told = by_other_route if other else None
    apparatus = assemble(prepared, solution, results, told, checks, laws, assumptions, explanations)
    return Calibration(apparatus, solution, effects, dict(request.correlations))


def _solved(prepared: Prepared) -> Solution:
    request = prepared.request
    return solve(
        prepared.scans,
        prepared.stresses,
        request.method,
        request.channel,
        centre=request.centre,
        owners=prepared.owners,
        per=prepared.reading.per,
    )


def _with_thickness(prepared: Prepared) -> Prepared:
    """Estimate the thickness of the films from the scans, and take it for that of the rods."""
    require_free(prepared.request.free, prepared.scans, prepared.references)
    thickness = free_thickness(_solved(prepared))
    films = thickness.films
    scans = [replace(scan, film=films[scan.set_up.film]) for scan in prepared.scans]
    stresses = [reference_profile(scan, None) for scan in scans]
    return replace(prepared, scans=scans, stresses=stresses, thickness=thickness)


def _propagated(
    solution: Solution, effects: Effects, prepared: Prepared, *, other: bool
) -> tuple[Results, Results | None]:
    """Propagate the uncertainties by the method, and by the other route where it is open."""
    inputs = (effects, prepared.request.correlations, prepared.reading)
    results = uncertainties(solution, solution.deconvolution, *inputs)
    _require_distinct(results, solution)
    if isinstance(solution.fields, RasterFields):
        from memscal.calibration.field_uncertainty import field_errors

        results = replace(results, field_errors=field_errors(solution, *inputs[:2]))
    # Some checks are of the division, whichever the method.
    if (other or not results.division) and solution.other:
        return results, uncertainties(solution, solution.other, *inputs)
    return results, None


def _require_distinct(results: Results, solution: Solution) -> None:
    """Refuse an A that what the scan leaves open, whatever the inputs, does not tell from zero."""
    a = results.parameters["conversion_constant"]
    sources = results.budget["conversion_constant"]
    uncertainty = math.hypot(*(sources[name] for name in _OF_THE_SCAN))
    if a > LEAST_DISTINCT * uncertainty:
        return
    unit = solution.estimate.points.reading
    raise FitError(
        f"The conversion constant would be ({a / unit.scale:.2g} ± "
        f"{uncertainty / unit.scale:.2g}) {unit.over(unit.unit)} by method "
        f"{solution.method.name}: it is not distinct from zero.",
        why=f"It is {a / uncertainty:.3g} standard uncertainties, those of the inputs left out; at "
        f"least {LEAST_DISTINCT:g} are needed.",
        cure='Look at the scan; scan farther, or take method="bayesian" (--method bayesian).',
    )


def _effects(solution: Solution, alternatives: Sequence[BaseStress | None]) -> Effects:
    """Return what the inputs change, to first order; two laws of the film, by calibrating twice."""
    scans = solution.scans
    estimate = solution.estimate
    stresses = []
    spectra = None
    if alternatives:
        pairs = zip(solution.owners, solution.stresses, strict=True)
        stresses = [alternatives[i] or stress for i, stress in pairs]
        points = [estimate.points.only(i) for i in range(len(scans))]
        spectra = reference_spectra(stresses, points, estimate.model.reference.wavenumbers)
        spectra = expected_spectra(scans, stresses, spectra)
    effects = input_effects(scans, solution.stresses, estimate, spectra)
    solved = all(isinstance(stress, Contact) for stress in solution.stresses)
    if "model_form" in effects and (stresses or solved):
        # Two laws differ by too much for the first order.
        with suppress(MemscalError):
            stresses = stresses or [press_rod(*s.set_up.expected.under(LINEAR)) for s in scans]
            exact = solve(scans, stresses, solution.method, estimate.points.channel)
            effects["model_form"] = replace(effects["model_form"], exact=exact)
    return effects


def uncertainties(
    solution: Solution,
    deconvolution: Deconvolution,
    effects: Effects,
    correlations: Correlations,
    reading: Reading = VOLTS,
) -> Results:
    """Propagate noise and inputs through the steps of one route."""
    # The derivatives of the other route, which is linear, are complete.
    drawn = drawn_scatter(solution) if deconvolution is solution.deconvolution else None
    results = propagate(solution, deconvolution, effects, correlations, drawn)
    return replace(results, parameters=replace(results.parameters, reading=reading))
