"""The main job: from a scan to an apparatus function, by the paper's method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, is_dataclass
from os import PathLike
from typing import Any, TypeAlias

from memscal.apparatus import ApparatusFunction
from memscal.calibration.assemble import assemble
from memscal.calibration.field_noise import field_noise
from memscal.calibration.inputs import InputEffect, input_effects
from memscal.calibration.messages import calibration_messages
from memscal.calibration.quality import quality_checks
from memscal.calibration.solution import Solution, solve
from memscal.calibration.sweep import Sweep, sweep_noise
from memscal.calibration.uncertainty import Results, propagate
from memscal.deconvolution.problem import Regulariser
from memscal.deconvolution.registry import create_regulariser
from memscal.errors import InputError
from memscal.estimation.reference import (
    reference_profile,
    reference_spectra,
    require_calibration_rod,
    require_one_sensor,
)
from memscal.formats.opened import Scans, opened_scans
from memscal.mechanics.contact import Contact
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.threads import single_threaded

__all__ = ["Calibration", "Reference", "calibrate", "uncertainties"]

Reference: TypeAlias = StressProfile | Contact | str | PathLike[str] | None
"""A base stress, the path of a file that holds one, or nothing: the rod is solved."""


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
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
        """Return the result in place of every step's arrays."""
        return f"<Calibration by {self.solution.regulariser.name}: {self.apparatus!r}>"

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
        """
        return sweep_noise(self.solution, amplitudes=amplitudes, draws=draws, seed=seed)


@single_threaded()
def calibrate(
    scan: Scans,
    *,
    reference: Reference | Sequence[Reference] = None,
    alternative: Reference | Sequence[Reference] = None,
    channel: str = "zz",
    method: str | Regulariser = "white-noise",
    correlations: Mapping[tuple[str, str], float] | None = None,
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
        other rods or films, along x or y, are fitted together: A and G are shared, and each has
        its own centre and baseline.
    reference : StressProfile, Contact or path, optional
        Stress at the base of the film, one for each scan.  Without it, the one that travels with
        the scan; without that, the rod is solved on the film.
    alternative : StressProfile, Contact or path, optional
        The same by another model of the film, such as finite strain.  Its difference from the
        reference is counted as an uncertainty of the model's form, ``model_form``, rectangular.
    channel : str, default "zz"
        ``"xz"`` or ``"yz"`` calibrates a tangential channel with the scan's ``u_xz`` or ``u_yz``,
        by method ``"evidence"``; see docs/tangential.md.
    method : str or Regulariser, default "white-noise"
        How the fields are divided; see :func:`memscal.deconvolution.registry.regulariser_names`.
        ``"evidence"`` divides none: it takes G from the scan's points, and is the most accurate.
    correlations : mapping of (str, str) to float, optional
        Correlation coefficients of the inputs' errors, such as
        ``{("thickness", "poisson_ratio"): 0.5}``.
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
    scans = require_one_sensor(opened_scans(scan))
    for each in scans:
        require_calibration_rod(each)
    given = _each(reference, scans)
    stresses = [reference_profile(s, r) for s, r in zip(scans, given, strict=True)]
    regulariser = chosen_method(method, seed, options)
    solution = solve(scans, stresses, regulariser, channel)
    others = None if alternative is None else _each(alternative, scans)
    effects = _effects(solution, others)
    results = uncertainties(solution, effects, correlations or {})
    checks = quality_checks(solution, results.parameters)
    messages = calibration_messages(solution, checks)
    configuration = {"method": regulariser.name, "seed": seed, **_settings(regulariser)}
    if channel != "zz":
        configuration["channel"] = channel
    if correlations:
        configuration["correlations"] = {" ".join(pair): c for pair, c in correlations.items()}
    apparatus = assemble(solution, results, checks, messages, configuration)
    return Calibration(apparatus, solution, effects, dict(correlations or {}))


def _each(
    reference: Reference | Sequence[Reference], scans: Sequence[Scan]
) -> list[StressProfile | Contact | None]:
    """Read a reference for each scan; one alone serves all."""
    if isinstance(reference, Sequence) and not isinstance(reference, str):
        if len(reference) != len(scans):
            raise InputError(
                f"{len(reference)} references were given, but there "
                f"{'is one scan' if len(scans) == 1 else f'are {len(scans)} scans'}.",
                cure="Give one for each scan, in their order, or one for all.",
            )
        return [_read(each) for each in reference]
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


def chosen_method(method: str | Regulariser, seed: int, options: Mapping[str, Any]) -> Regulariser:
    """Set up the method of division, by its name or as it was given."""
    if isinstance(method, str):
        return create_regulariser(method, seed=seed, **options)
    if isinstance(method, type) or not callable(getattr(method, "divide", None)):
        raise InputError(
            f"The method is {method!r}, which cannot divide fields.",
            cure="Give a method's name, or a regulariser that is set up: Tikhonov(), not Tikhonov.",
        )
    if options:
        raise InputError(
            f"Options {', '.join(options)} were given beside a regulariser that is set up already.",
            cure="Set them on the regulariser, or give the method by name.",
        )
    return method


def _settings(regulariser: Regulariser) -> Mapping[str, Any]:
    """Parameters of a regulariser, for the record."""
    own: Any = regulariser
    known = is_dataclass(own) and not isinstance(own, type)
    return {"options": asdict(own) if known else {}}


def _effects(
    solution: Solution, alternatives: Sequence[StressProfile | Contact | None] | None
) -> Mapping[str, InputEffect]:
    scans, estimate = solution.scans, solution.estimate
    spectra = None
    if alternatives is not None:
        known = [other for other in alternatives if other is not None]
        parts = [estimate.points.only(i) for i in range(len(scans))]
        spectra = reference_spectra(known, parts, [scan.film.thickness for scan in scans])
    return input_effects(scans, solution.stresses, estimate, spectra)


def uncertainties(
    solution: Solution,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
) -> Results:
    """Propagate noise and inputs through a calibration's steps."""
    wavenumbers = solution.fields.along_axis(solution.deconvolution.quotient.window)[0]
    return propagate(
        solution.estimate,
        solution.deconvolution,
        solution.window_at_nodes,
        wavenumbers,
        effects,
        correlations,
        field_noise(solution, wavenumbers),
    )
