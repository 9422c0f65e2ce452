"""Calibration: from rod scans to an apparatus function with its covariance and checks."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.calibration.checks import quality_checks
from memscal.calibration.drawn_scatter import drawn_scatter
from memscal.calibration.field_uncertainty import field_errors
from memscal.calibration.fields import RasterFields
from memscal.calibration.messages import calibration_messages
from memscal.calibration.stages import COMMON, PER_REPEAT, Deconvolution, Solution, solve
from memscal.calibration.uncertainty import InputEffect, Results, input_effects, propagate
from memscal.deconvolution.division import Method, chosen_method
from memscal.errors import InputError, MemscalError
from memscal.estimation.bayesian import Bayesian
from memscal.estimation.points import loads_differ, require_size, scans_by_load
from memscal.estimation.reference import (
    at_load_of,
    expected_spectra,
    film_of,
    is_source,
    press_neo_hookean,
    reference_profile,
    reference_spectra,
    require_calibration_rod,
    require_one_kind,
    require_one_sensor,
    require_same_set_up,
    with_film_of,
)
from memscal.extensions import hook
from memscal.formats.opened import Scans, opened_scans
from memscal.mechanics.contact import BaseStress, Contact
from memscal.model.apparatus import (
    ApparatusField,
    ApparatusRadial,
    OtherEstimate,
    Reconvolution,
    TransferFunction,
)
from memscal.model.checks import Message, QualityCheck, override_messages
from memscal.model.film import LINEAR
from memscal.model.notation import VOLTS, Reading
from memscal.model.provenance import Process, accepted_alterations
from memscal.model.result import Result
from memscal.model.scan import Scan, common_circumstances
from memscal.model.sizes import MOST_OF_LINES
from memscal.model.stress import IdealReference, StressField, StressProfile
from memscal.parallel import single_threaded
from memscal.progress import Listener, done_with, in_steps, reported

if TYPE_CHECKING:
    from memscal import Sweep

#: Parameters that differ between a division and the Bayesian estimate.
_OF_A_ROUTE = ("conversion_constant", "gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area")


def assemble(
    solution: Solution,
    stated: Scan,
    results: Results,
    other: Results | None,
    checks: tuple[QualityCheck, ...],
    messages: tuple[Message, ...],
    configuration: Mapping[str, Any],
) -> ApparatusFunction:
    """Return the apparatus function with everything that its artifact stores."""
    # Film and indenter are as ``stated`` by the scan where nothing was calculated with them.
    scan = solution.scan
    reference = _table(solution.stress)
    channel = solution.estimate.points.channel
    record: dict[str, Any] = {
        **configuration,
        "grid": dict(solution.choice.reasons),
        "relevant_wavenumber_rad_per_mm": solution.band.relevant * 1e-3,
    }
    if scan.direction == "y":
        record["direction"] = "y"
    if max(solution.owners) > 0:
        # Repeats that are fitted as scans have the source of the scan that they belong to.
        of_scans = dict(zip(solution.owners, solution.scans, strict=True))
        sources = [of_scans[i].source for i in range(1, len(of_scans))]
        record["further_scans"] = [
            s and {"file_name": s.file_name, "sha256": s.sha256} for s in sources
        ]
    g = solution.deconvolution.g
    plane = results.field_errors
    if plane is None:
        errors = np.sqrt(np.diag(results.radial_covariance))
        plane = g.grid.to_image(np.interp(g.grid.radius, g.r, errors))
        scatter = None
    else:
        scatter, plane = plane
    return ApparatusFunction(
        plane=ApparatusField(g.x, g.y, g.image, plane, scatter),
        radial_profile=_radial(solution, solution.deconvolution, results),
        transfer=_transfer(solution, results),
        reconvolution=_reconvolution(solution),
        parameters=results.parameters,
        checks=checks,
        film=scan.film or stated.film,
        indenter=scan.indenter or stated.indenter,
        sensor=scan.sensor if channel == "zz" else replace(scan.sensor, channel=channel),
        load=None if results.parameters.reading.per != "Pa" else scan.load,
        reference=reference,
        process=Process.of_now(
            configuration=record,
            messages=messages,
            input_scan=scan.source,
            input_reference=reference.source,
        ),
        budget=results.budget,
        kernel_changes=results.kernel_changes,
        **common_circumstances(solution.scans),
        other=_other(solution, other),
    )


def _other(solution: Solution, results: Results | None) -> OtherEstimate | None:
    if results is None or solution.other is None:
        return None
    parameters = results.parameters.only(_OF_A_ROUTE)
    method = "white-noise" if isinstance(solution.method, Bayesian) else "bayesian"
    return OtherEstimate(method, parameters, _radial(solution, solution.other, results))


def _radial(solution: Solution, deconvolution: Deconvolution, results: Results) -> ApparatusRadial:
    g = deconvolution.g
    covariance = results.radial_covariance
    gaussian = unit_gaussian(g.r, solution.estimate.gaussian.sigma)
    errors = np.sqrt(np.diag(covariance))
    with_a = results.cross_covariance[:, results.parameters.names.index("conversion_constant")]
    scale = errors * results.parameters.uncertainty("conversion_constant")
    correlation = np.divide(with_a, scale, out=np.zeros_like(with_a), where=scale > 0)
    return ApparatusRadial(g.r, g.radial, errors, gaussian, covariance, correlation)


def _transfer(solution: Solution, results: Results) -> TransferFunction:
    fields = solution.fields
    deconvolution = solution.deconvolution
    a = deconvolution.conversion_constant
    quotient = deconvolution.quotient
    k, transfer = fields.grid.axis_transfer(quotient.values)
    window = fields.along_axis(quotient.window)[1]
    return TransferFunction(
        k, np.abs(transfer) / a, results.transfer_errors, window, solution.band.resolved
    )


def _reconvolution(solution: Solution) -> Reconvolution:
    points = solution.estimate.points
    estimate = solution.estimate
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
    columns = {
        "x": place,
        "u_zz": points.u,
        "u_zz_errors": estimate.noise,
        "u_zz_predicted": predicted,
        "u_zz_gaussian": estimate.gaussian.predicted,
        "residual": points.u - predicted,
    }
    if points.planar:
        columns |= dict(zip(("offset_x", "offset_y"), estimate.offset, strict=True))
    if points.planar or points.scans > 1 or loads_differ(list(points.load)):
        columns |= {"load": points.load, "background": estimate.background}
    return Reconvolution(**{name: values[order] for name, values in columns.items()})


_OF_POINTS = ("normal_load", "normal_load_errors")
#: Methods whose derivatives are complete.
_LINEAR = ("white-noise", "tikhonov", "bayesian", "wiener")

Reference: TypeAlias = (
    StressProfile | StressField | IdealReference | Contact | str | PathLike[str] | None
)
"""A base stress, an ideal reference, the path or name of one, or nothing: the rod is solved."""


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
    reference: Reference | Sequence[Reference] = None,
    alternative: Reference | Sequence[Reference] = None,
    film_law: str | None = None,
    mooney_rivlin_ratio: float | None = None,
    rod_friction: float | None = None,
    channel: str = "zz",
    method: str | Method = "white-noise",
    centre: str | None = None,
    correlations: Mapping[tuple[str, str], float] | None = None,
    pixel_size: float | None = None,
    free: str | Sequence[str] = (),
    seed: int = 0,
    override: bool = False,
    accept_altered: bool = False,
    relative: bool = False,
    other: bool = True,
    progress: Listener = None,  # noqa: ARG001 - @reported
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
    reference : StressProfile, Contact, IdealReference, path or str, optional
        Stress at the base of the film, one for each scan.  By default the one that travels with
        the scan; without that, the rod is solved on the film.  ``"disc:0.5mm"``, ``"slit:200um"``,
        ``"gaussian:0.3mm"`` and ``"point"`` are sources in place of a stress, of which A is the
        reading per unit (:class:`memscal.IdealReference`), as is a :class:`memscal.StressField` or
        the file of one: film and rod are not used, and loads are strengths relative to the load of
        the first scan.
    alternative : StressProfile, Contact or path, optional
        The same by another model of the film.  Its difference is counted as a rectangular
        uncertainty of the model's form, ``model_form``, in place of the neo-Hookean film's.
    film_law : str, optional
        Law by which the rod is solved: ``"linear"``, ``"neo-hookean"`` or ``"mooney-rivlin"`` (with
        ``mooney_rivlin_ratio``, :math:`C_2/C_1`).  By default the law that scan or reference
        state; it counts as known.  Where none is stated the reference is that of a linear film,
        and its difference from a neo-Hookean one is counted as ``model_form``.
    rod_friction : float, optional
        0 or ``inf``: whether the film slides freely under the rod or sticks, which matters at
        finite strain.  By default as the scan states it; else the difference is counted.
    channel : str, default "zz"
        ``"xz"`` or ``"yz"`` calibrates a tangential channel with the scan's ``u_xz`` or ``u_yz``,
        by method ``"bayesian"``; see docs/tangential.md.
    method : str or Regulariser, default "white-noise"
        Whose A and G the result has.  ``"white-noise"``, the paper's, divides the field of the
        smoothed voltages; ``tikhonov``, ``wiener`` and more are other
        divisions.  ``"bayesian"`` takes A and G from the scan's points: the smaller error, for
        friction.  ``.apparatus.other`` is the estimate by the other route.
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
    **options
        Parameters of the method, such as ``amplitude``.

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
    >>> calibration = memscal.calibrate(memscal.simulate(noise=0.005, seed=1))
    >>> 0.54e-3 < calibration.apparatus.gaussian_sigma < 0.58e-3
    True
    """
    pairs = correlations or {}
    prepared = prepare(
        opened_scans(scan, MOST_OF_LINES, accept_altered=accept_altered),
        reference,
        alternative,
        (film_law, mooney_rivlin_ratio, rod_friction),
        pixel_size=pixel_size,
        override=override,
        accept_altered=accept_altered,
        relative=relative,
    )
    scans = prepared.scans
    stresses = list(prepared.stresses)
    owners = prepared.owners
    reading = prepared.reading
    as_stated = prepared.as_stated
    chosen = chosen_method(method, options, seed=seed)
    if centre not in (None, COMMON, PER_REPEAT):
        problem = f"There is no choice of centre {centre!r}."
        raise InputError(problem, cure=f"Give {COMMON!r} or {PER_REPEAT!r}, or leave it out.")
    freed = None
    if free:
        from memscal.calibration.film_inference import free_thickness, require_free

        require_free(free, scans, prepared.references)
        start = solve(scans, stresses, chosen, channel, centre=centre, owners=owners)
        freed = free_thickness(start)
        scans = tuple(freed.of(scans))
        stresses = [reference_profile(s, None) for s in scans]
    solution = solve(scans, stresses, chosen, channel, centre=centre, owners=owners)
    effects = _effects(solution, prepared.alternatives)
    results = uncertainties(solution, solution.deconvolution, effects, pairs, reading)
    if isinstance(solution.fields, RasterFields):
        plane = field_errors(solution, solution.deconvolution, effects, pairs)
        results = replace(results, field_errors=plane)
    beside: Results | None = None
    # Some checks are of the division, whichever the method.
    if (other or results.division is None) and solution.other is not None:
        beside = uncertainties(solution, solution.other, effects, pairs, reading)
    division = results.division or (beside.division if beside else None)
    done_with("uncertainties")
    checks = quality_checks(solution, results, division)
    done_with("checks")
    messages = calibration_messages(solution, results, checks)
    settings = asdict(chosen) if is_dataclass(chosen) and not isinstance(chosen, type) else {}
    configuration: dict[str, Any] = {"method": chosen.name, "seed": seed, "options": settings}
    configuration |= {"reference_unit": reading.per} if reading.per != "Pa" else {}
    if reading.per == "Pa" and any(s.load is None and s.normal_load is None for s in as_stated):
        load = f"{solution.scan.stated_load:.4g} N (--relative takes none)"
        text = f"No load is stated: it is taken to be that of the reference, {load}."
        messages = (Message("load_of_reference", text), *messages)
    if freed is not None:
        messages = (*freed.messages, *messages)
        configuration["free"] = freed.record
    loads_of_film = not (relative or is_source(solution.stress))
    if loads_of_film and loads_differ([s.stated_load for s in solution.scans]):
        from memscal.calibration.film_inference import weigh_laws

        if (compared := weigh_laws(solution)) is not None:
            messages = (compared.message, *messages)
            configuration["film_laws"] = compared.record
    of_channel = None if channel == "zz" else channel
    asked = {"channel": of_channel, "film_law": film_law, "rod_friction": rod_friction}
    configuration |= {name: value for name, value in asked.items() if value is not None}
    if centre is not None or solution.apart is not None:
        choice = PER_REPEAT if solution.per_repeat else COMMON
        configuration["centre"] = {"choice": choice, "chosen_by": "option" if centre else "test"}
        if solution.apart is not None:
            configuration["centre"]["p_value"] = solution.apart.p_value
    if prepared.overridden:
        configuration["override"] = prepared.overridden
    if pairs:
        configuration["correlations"] = {" ".join(pair): c for pair, c in pairs.items()}
    messages = (*override_messages(prepared.overridden), *messages)
    beside = beside if other else None
    apparatus = assemble(solution, as_stated[0], results, beside, checks, messages, configuration)
    return Calibration(apparatus, solution, effects, dict(pairs))


@dataclass(frozen=True, eq=False)
class Prepared:
    """What a calibration starts from: scans with the film and loads that count, and references."""

    as_stated: tuple[Scan, ...]
    scans: tuple[Scan, ...]
    references: Sequence[BaseStress | None]  # as given
    stresses: tuple[BaseStress, ...]  # as taken, one of each scan
    alternatives: Sequence[BaseStress | None] | None
    owners: Sequence[int] | None  # of scans that were split by their loads
    reading: Reading
    overridden: list[str]


def prepare(
    as_stated: Sequence[Scan],
    reference: Reference | Sequence[Reference],
    alternative: Reference | Sequence[Reference],
    law: tuple[str | None, float | None, float | None],
    *,
    pixel_size: float | None,
    override: bool,
    relative: bool,
    accept_altered: bool = False,
) -> Prepared:
    """Read and solve the references, and hold them against the scans; see :func:`calibrate`."""
    # ``law``: the film's, its ratio, and the friction of the rod, where they are asked for.
    require_size(as_stated)
    as_stated = require_one_sensor(as_stated)
    references = _references(reference, as_stated, pixel_size, accept_altered=accept_altered)
    for scan, given in zip(as_stated, references, strict=True):
        require_calibration_rod(scan, given)
    scans = tuple(_of_law(s, r, law) for s, r in zip(as_stated, references, strict=True))
    stated = [r or s.reference for s, r in zip(scans, references, strict=True)]
    if relative:
        # A rod that has to be solved keeps its nominal load.
        loads: dict[str, Any] = dict.fromkeys(("load_uncertainty", *_OF_POINTS))
        kept = [None if r else s.load for s, r in zip(scans, stated, strict=True)]
        scans = tuple(replace(s, load=p, **loads) for s, p in zip(scans, kept, strict=True))
    alternatives = None
    if alternative is not None:
        alternatives = _references(alternative, scans, accept_altered=accept_altered)
    overridden = require_same_set_up(scans, references, alternatives or (), override=override)
    files = (*as_stated, *references, *(alternatives or ()))
    overridden[:0] = accepted_alterations(*(getattr(file, "source", None) for file in files))
    scans = tuple(with_film_of(r, s) for s, r in zip(scans, references, strict=True))
    require_one_kind(stated, alternatives or ())
    owners: Sequence[int] | None = None
    if not any(stated) and any(s.set_up.film.law != LINEAR for s in scans):
        # Under another law than the linear one each load has a stress of its own shape.
        of_loads, owners = scans_by_load(scans)
        scans = tuple(of_loads)
        references = [None] * len(of_loads)
    stresses = tuple(reference_profile(s, r) for s, r in zip(scans, references, strict=True))
    peak = float(np.abs(_table(stresses[0]).sigma_zz).max()) if relative else None
    scans = tuple(at_load_of(stress, s, peak) for s, stress in zip(scans, stresses, strict=True))
    reading = replace(scans[0].reading, per="relative" if relative else stresses[0].unit)
    return Prepared(
        as_stated, scans, references, stresses, alternatives, owners, reading, overridden
    )


def _of_law(
    scan: Scan, reference: BaseStress | None, known: tuple[str | None, float | None, float | None]
) -> Scan:
    """Return the scan with the law and the rod's friction that are known: asked for, or stated."""
    law, ratio, friction = known
    if law is not None:
        if reference is not None:
            why = "A reference has been calculated by a law already."
            cure = "Give one of them (film_law, --film-law; reference, --reference)."
            raise InputError(f"A film law ({law}) and a reference are given.", why=why, cure=cure)
        film = replace(scan.set_up.film, law=law, mooney_rivlin_ratio=ratio)
        scan = replace(scan, film=film, reference=None)
    stress = scan.reference if reference is None else reference
    theirs = stress and film_of(stress)
    if stress is not None and theirs and theirs.law and scan.film and not scan.film.law:
        stated = {name: getattr(theirs, name) for name in ("law", "mooney_rivlin_ratio")}
        scan = replace(scan, film=replace(scan.film, **stated))
        used = stress.friction if isinstance(stress, Contact) else stress.friction_coefficient
        if theirs.law != LINEAR and scan.rod_friction is None and used in (0.0, np.inf):
            scan = replace(scan, rod_friction=used)
    return scan if friction is None else replace(scan, rod_friction=friction)


def _table(stress: BaseStress) -> StressProfile:
    return stress.profile() if isinstance(stress, Contact) else stress


def _references(
    reference: Reference | Sequence[Reference],
    scans: Sequence[Scan],
    pixel_size: float | None = None,
    *,
    accept_altered: bool = False,
) -> list[BaseStress | None]:
    """Read a reference for each scan; a single one is that of all scans."""
    loads = scans[0].normal_load
    strength = scans[0].load or (1.0 if loads is None else float(np.nanmedian(loads)))
    if isinstance(reference, Sequence) and not isinstance(reference, str):
        if len(reference) != len(scans):
            count = "is one scan" if len(scans) == 1 else f"are {len(scans)} scans"
            problem = f"{len(reference)} references were given, but there {count}."
            cure = "Give one for each scan, in their order, or one for all."
            raise InputError(problem, cure=cure)
        return [_read(item, strength, pixel_size, accept_altered) for item in reference]
    return [_read(reference, strength, pixel_size, accept_altered)] * len(scans)


def _read(
    reference: Reference, load: float, pixel_size: float | None, accept_altered: bool
) -> BaseStress | None:
    """Read a reference; a source has its own strength at the nominal load of the first scan."""
    if isinstance(reference, str | PathLike):
        from memscal.formats.reference import read_reference

        reference = read_reference(reference, pixel_size=pixel_size, accept_altered=accept_altered)
    elif isinstance(reference, IdealReference | StressField):
        reference = reference.profile()
    if isinstance(reference, StressProfile) and (form := reference.form) is not None:
        stated = form.load if isinstance(form, StressField) else None
        return replace(reference, load=stated or load)
    if reference is None or isinstance(reference, StressProfile | Contact):
        return reference
    raise InputError(
        f"The reference is a {type(reference).__name__}.",
        cure="Give a contact from memscal.indent(), a StressProfile, a StressField, an ideal one "
        "such as disc:0.5mm, or the path of a file.",
    )


def _effects(
    solution: Solution, alternatives: Sequence[BaseStress | None] | None
) -> Mapping[str, InputEffect]:
    scans = solution.scans
    estimate = solution.estimate
    spectra = None
    others = None
    if alternatives is not None:
        pairs = zip(solution.owners, solution.stresses, strict=True)
        others = [alternatives[i] or stress for i, stress in pairs]
        points = [estimate.points.only(i) for i in range(len(scans))]
        spectra = reference_spectra(others, points, estimate.model.reference.wavenumbers)
        spectra = expected_spectra(scans, others, spectra)
    effects = dict(input_effects(scans, solution.stresses, estimate, spectra))
    contacts = all(isinstance(stress, Contact) for stress in solution.stresses)
    if "model_form" in effects and (others or contacts):
        # Two laws differ by too much for the first order: calibrated by the other one, too.
        with suppress(MemscalError):
            others = others or [press_neo_hookean(scan.set_up) for scan in scans]
            exact = solve(scans, others, solution.method, estimate.points.channel)
            effects["model_form"] = replace(effects["model_form"], exact=exact)
    return effects


def uncertainties(
    solution: Solution,
    deconvolution: Deconvolution,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
    reading: Reading = VOLTS,
) -> Results:
    """Propagate noise and inputs through the steps of one route."""
    wavenumbers = solution.fields.along_axis(deconvolution.quotient.window)[0]
    # A linear method's derivatives are complete; of another, the scatter of draws is taken.
    linear = deconvolution is not solution.deconvolution or solution.method.name in _LINEAR
    drawn = None if linear else drawn_scatter(solution)
    results = propagate(solution, deconvolution, wavenumbers, effects, correlations, drawn)
    return replace(results, parameters=replace(results.parameters, reading=reading))
