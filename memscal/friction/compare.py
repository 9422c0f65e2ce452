"""From contact scans and a calibrated sensor to the friction that explains what it measured."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import InputError, MemscalError
from memscal.estimation.points import measured_mask
from memscal.estimation.set_up import accepted_differences
from memscal.extensions import hook
from memscal.formats.cache import CacheFolder
from memscal.formats.files import FilePath
from memscal.formats.opened import Contacts, opened_contacts
from memscal.friction.calculated import FRICTIONS, amontons_family, external_family
from memscal.friction.checks import comparison_checks, comparison_messages, synthetic_messages
from memscal.friction.dry_against_lubricated import dry_against_lubricated, lubricated_pairs
from memscal.friction.effective import (
    FrictionFit,
    fit_friction,
    fit_together,
    load_comparison,
    with_loading,
)
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import (
    BETWEEN_SCAN_GAIN,
    Channel,
    load_points,
    points_of,
    require_line,
    sensor_of,
)
from memscal.friction.results import FrictionComparison, LoadComparison
from memscal.friction.wrong_inputs import wrong_inputs
from memscal.measurement.measure_stress import joined_stress, measure_stress
from memscal.measurement.posterior import common_inputs
from memscal.measurement.restore import accept_other_sensor, load_of, place_of, single_loads
from memscal.mechanics.indent import Loading
from memscal.model.arrays import Values, require_non_negative
from memscal.model.checks import Message, override_messages
from memscal.model.indenter import Sphere
from memscal.model.measured_stress import MeasuredScan, MeasuredStress
from memscal.model.provenance import accepted_alterations
from memscal.model.scan import Scan, require_pressed, require_sliding
from memscal.model.sizes import MOST_COMPARED, MOST_COMPARED_TOGETHER, too_large
from memscal.model.stress import StressProfile
from memscal.parallel import single_threaded
from memscal.progress import Listener, reported


def scans_of(contacts: Sequence[Scan | MeasuredStress]) -> list[Scan | MeasuredScan]:
    """Return the scans, and those of which a stress was measured."""
    scans: list[Scan | MeasuredScan] = []
    for item in contacts:
        scans += [item] if isinstance(item, Scan) else item.scans
    return scans


def require_contacts(scans: Sequence[Scan | MeasuredScan], *, sliding: bool) -> None:
    """Refuse what is no scan of a sphere's contacts, or not all on one film with one sphere."""
    for scan in scans:
        place = place_of(scan)
        if not isinstance(scan.indenter, Sphere):
            problem = f"{place} states no sphere (/entry/indenter)."
            if scan.indenter:
                problem = f"{place} was made with a rod, not with a sphere."
            raise InputError(
                problem,
                why="The stress under a rod barely depends on friction, and its contact does not "
                "grow: a rod scan calibrates a sensor.",
                cure="Give the scans of a sphere's contacts; calibrate with the rod scan.",
            )
        require_motion = require_sliding if sliding else require_pressed
        require_motion(scan.motion, scan.source)
        if isinstance(scan, Scan) and scan.y is not None:
            require_line(place, scan.x, scan.y)
        if (scan.film, scan.indenter) != (scans[0].film, scans[0].indenter):
            raise InputError(
                f"{place} states another film or sphere than the first scan.",
                why="Scans that are compared together share the calculated contacts.",
                cure="Compare them one by one, or correct /entry/sample/film and /entry/indenter.",
            )


def same_apparatus(
    measured: MeasuredStress, apparatus: ApparatusFunction, *, override: bool
) -> MeasuredStress:
    """Refuse another apparatus function than that of a measured stress; or record it."""
    differences = accepted_alterations(apparatus.source)
    if measured.artifact_digest != apparatus.content_digest:
        name = measured.artifact.file_name if measured.artifact else ""
        given = apparatus.source.file_name if apparatus.source else ""
        # A file can have been written again under its name.
        this = f"{name} (digest {measured.artifact_digest[:8]})"
        that = f"{given} (digest {apparatus.content_digest[:8]})"
        differences += accepted_differences(
            [("the measured stress", "the command", "apparatus function", this, that)],
            override=override,
            problem="Measured stress and artifact do not belong together",
            why="The stress on the axis, centres and noise are those of the calibration by which "
            "they were measured.",
            cure="Give its artifact, or measure again with memscal apply.",
        )
    if not differences:
        return measured
    messages = (*measured.messages, *override_messages(differences))
    return replace(
        measured,
        overridden=(*measured.overridden, *differences),
        process=replace(measured.process, messages=messages),
    )


FRICTIONLESS = "frictionless"
APART = "apart"
"""How lubricated loads are fitted: with no friction together with the dry ones, or alone."""
LUBRICATED_FRICTION = 0.015
"""Width of the half-normal distribution of a lubricated friction coefficient."""

#: Calculated stresses reach this multiple of a scan's width.
_REACH = 1.5
_MM = 1e-3


@reported
@single_threaded()
def compare(
    contacts: Contacts,
    apparatus: ApparatusFunction | FilePath,
    *,
    friction: Sequence[float] | None = None,
    loading: Loading | Sequence[Loading] = ("incremental", "total"),
    references: Sequence[StressProfile] | None = None,
    lubricated: str | None = None,
    lubricated_friction: float = LUBRICATED_FRICTION,
    between_scan_gain: float = BETWEEN_SCAN_GAIN,
    shear: ApparatusFunction | FilePath | None = None,
    macroscopic: float | None = None,
    macroscopic_uncertainty: float | None = None,
    interface: bool = False,
    sliding: bool = False,
    backlash: float | None = None,
    noise_record: Scan | FilePath | None = None,
    override: bool = False,
    accept_altered: bool = False,
    cache: CacheFolder = None,
    workers: int = 1,
    progress: Listener = None,  # noqa: ARG001 - @reported
) -> FrictionComparison:
    r"""Hold measured stress against calculated contacts, and find the friction that explains it.

    The calculated base stress of a sphere on the film is convolved with the sensor's G, and the
    voltages are compared with it: :math:`U = A\,(G \otimes \sigma_\mu)` with centre, baseline and
    drift of each load free, and with the uncertainties of A G, film, sphere, loads and positions
    in the likelihood.  The effective friction coefficient is the most likely one; its
    interval is what the profile likelihood does not exclude, and has no upper end where the
    stress tells no large coefficient from another.

    Parameters
    ----------
    contacts : Scan, MeasuredStress or path, or a sequence of them
        Contact scans of a sphere at one load or several, dry or lubricated, on one film with one
        sphere; or the stress that was measured of them, which holds their points.
    apparatus : ApparatusFunction or path
        The calibrated sensor; of a measured stress the one by which it was measured.  One of a
        tangential channel, from ``memscal.calibrate(..., channel="xz")``, compares measured stress
        by the shear alone (experimental: tested on synthetic scans only), whose scans hold
        ``u_xz`` and ``u_xz_errors`` beside ``u_zz`` (``u_yz`` of a line along y):
        :math:`U_{xz} = A_{xz}\,(G_{xz} \otimes \tau_\mu)(R)\cos\theta`.
    friction : sequence of float, optional
        Friction coefficients of the calculated profiles, increasing; the last may be ``inf``.
    loading : str or sequence of str
        ``"incremental"``, ``"total"``, or both: see :func:`memscal.indent`.
    references : sequence of StressProfile, optional
        Profiles that were calculated elsewhere, in place of memscal's: each with its load and
        friction coefficient, which take the place of ``friction`` and ``loading``.
    lubricated : str, optional
        ``"frictionless"``: ``lubricated_friction`` is 0; ``"apart"``: each kind by itself.  By
        default the dry loads are fitted together with the lubricated ones, which cancels most of
        what A, G and film leave uncertain.
    lubricated_friction : float
        Width of the half-normal distribution of the lubricated loads' friction coefficient; 0
        holds it at none.
    between_scan_gain : float
        Relative standard uncertainty of the gain of each scan that the others do not share.
    shear : ApparatusFunction or path, optional
        The tangential channel of the same sensor (experimental): the coefficients of all loads
        together are then those of both channels together, which share the errors of film, contacts
        and calibration.  All scans hold its voltage.
    macroscopic, macroscopic_uncertainty : float, optional
        A friction coefficient that was measured otherwise, and its standard uncertainty.
    interface : bool
        Whether to weigh laws of the interface against effective friction, at the macroscopic
        coefficient.
    sliding : bool
        Compare the scans of an indenter that slid with a contact that slides, with a shear of the
        coefficient times the pressure everywhere: :func:`memscal.slide`.  ``friction`` to
        ``interface`` but ``between_scan_gain`` are of no use then.
    backlash : float, optional
        Standard uncertainty of the difference of positions between sliding forth and back, in m:
        both have one centre then.  By default each direction has a centre of its own.
    noise_record : Scan or path, optional
        Readings of the sensor at rest (``memscal import --noise-record``), whose noise, in size and
        correlation, the scans' readings have at their times, in place of a stated one.
    override : bool
        Whether to accept an artifact of another sensor or film; that is recorded.
    accept_altered : bool
        Accept files whose content does not fit their digest; recorded like what is overridden.
    cache : path, optional
        A folder in which calculated contacts are kept; without it nothing is written.
    workers : int
        Processes that calculate contacts.
    progress : callable or True, optional
        Told how many loads are measured and contacts calculated: :class:`memscal.Progress`.

    Returns
    -------
    FrictionComparison
        Its checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If a scan is not a sphere's or is over a plane, scans differ in film or sphere, artifact and
        scan do not belong together, or there are too many readings (25,000; 500 of one load that
        share noise, by a correlation or with the shear).
    FitError
        If a load determines no stress.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(
    ...     friction=0.1, loads=[0.69], lubricated_loads=[0.69], seed=1
    ... )
    >>> apparatus = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> comparison = compare(made.dry, apparatus, friction=(0, 0.1, 0.3, math.inf), loading="total")
    >>> comparison.joint["dry"]["total"].interval.low < 0.1
    True
    """
    # Prepare: open what is compared, and refuse what does not belong together.
    opened = opened_contacts(contacts, accept_altered=accept_altered, noise_record=noise_record)
    sensor = opened_apparatus(apparatus, accept_altered=accept_altered)
    tangential = None if shear is None else opened_apparatus(shear, accept_altered=accept_altered)
    _require_macroscopic(macroscopic, macroscopic_uncertainty, interface=interface)
    if lubricated not in (None, FRICTIONLESS, APART):
        raise InputError(
            f"Lubricated loads cannot be fitted {lubricated!r}.",
            cure=f"Give {FRICTIONLESS!r} or {APART!r}, or leave it out.",
        )
    if lubricated and lubricated_friction not in (0.0, LUBRICATED_FRICTION):
        raise InputError(
            f"Lubricated loads are to be fitted {lubricated!r}, and with a friction of their own.",
            cure="Leave out lubricated (--lubricated), or lubricated_friction.",
        )
    require_non_negative("friction of lubricated loads", lubricated_friction)
    require_non_negative("gain between scans", between_scan_gain)
    beside = {None: lubricated_friction, FRICTIONLESS: 0.0, APART: None}[lubricated]
    require_contacts(scans_of(opened), sliding=sliding)
    require_non_negative("backlash", backlash)
    if backlash is not None and not sliding:
        raise InputError(
            "A backlash is given, but no sliding scan is to be compared.",
            cure="Leave it out, or give sliding (--sliding).",
        )
    _require_few(opened, [one.sensor.channel for one in (sensor, tangential) if one])
    measured = _measured(opened, sensor, override)
    setting = _setting(measured, cache, workers)
    if sensor.order or sliding:
        slides = friction if sliding else None
        others = (references, lubricated, shear, macroscopic, interface or None, slides)
        if any(option is not None for option in others):
            raise InputError(
                "A tangential channel, or sliding, is compared with options of the normal one.",
                cure="Leave out references, lubricated, shear, macroscopic, interface and, for "
                "sliding, friction; or give the artifact of zz and scans of contacts at rest.",
            )
    if sliding:
        slid: FrictionComparison = hook("compare_sliding")(
            measured, sensor, setting, between_scan_gain, backlash
        )
        return slid
    if sensor.order:
        return _compared_by_shear(measured, sensor, setting, friction, loading, override)
    if tangential and references is not None:
        raise InputError(
            "Profiles of another program and the shear are asked for.",
            cure="Leave one of them out: those profiles have no shear.",
        )
    notes = _accept_tangential(measured, tangential, override) if tangential else []

    # Calculate the contacts, by the definition of their loading.
    families = _families(setting, friction, loading, references)
    shear_families = None
    if tangential:
        shear_families = _families(setting, friction, loading, order=1)

    # Fit and check.
    known = None if macroscopic is None else (macroscopic, macroscopic_uncertainty)
    comparison = compare_measured(
        measured,
        sensor,
        families,
        lubricated_friction=beside,
        between_scan_gain=between_scan_gain,
        shear=tangential,
        shear_families=shear_families,
        macroscopic=known,
    )
    if comparison.unexplained and references is None and not tangential:
        first, *_ = channels_of(measured, sensor, families, (), between_scan_gain).values()
        # At three times the loads a contact may have no solution.
        with suppress(MemscalError):
            factors = wrong_inputs(comparison, first, setting, beside)
            comparison = replace(comparison, wrong_inputs=factors)
    laws = None
    if interface:
        laws = hook("compare_interface")(
            measured.profiles,
            sensor,
            macroscopic=macroscopic,
            macroscopic_uncertainty=macroscopic_uncertainty,
            amontons=families.get("incremental") if references is None else None,
            cache=cache,
            workers=workers,
        )

    # Record.
    altered = accepted_alterations(*(profile.source for profile in references or ()))
    messages = [*override_messages(altered), *comparison.messages, *notes]
    if laws:
        messages += laws.messages
    return replace(comparison, interface=laws, messages=tuple(messages))


def _require_macroscopic(
    value: float | None, uncertainty: float | None, *, interface: bool
) -> None:
    """Refuse a macroscopic coefficient that is none, or is asked for and not given."""
    require_non_negative("macroscopic friction coefficient", value)
    require_non_negative("uncertainty of the macroscopic coefficient", uncertainty)
    if value is None and (interface or uncertainty is not None):
        raise InputError(
            "The macroscopic friction coefficient is not given.",
            why="Its uncertainty is of no use alone, and laws of the interface are weighed at it.",
            cure="Give macroscopic, such as from a measurement of sliding.",
        )


def _require_few(contacts: Sequence[Scan | MeasuredStress], channels: Sequence[str]) -> None:
    """Refuse more readings of the channels than are compared."""
    total = 0
    for item in contacts:
        for name, size, shared in _readings(item, channels):
            total += size
            if shared and size > MOST_COMPARED_TOGETHER:
                raise too_large(
                    name,
                    size,
                    MOST_COMPARED_TOGETHER,
                    "readings that share noise (a correlation, or two channels)",
                    why="A matrix over them is held in memory for each friction coefficient.",
                    cure="Average neighbouring readings, or compare without correlation and shear.",
                )
    if total > MOST_COMPARED:
        raise too_large(
            "What is compared",
            total,
            MOST_COMPARED,
            "readings",
            why="Columns over them are held for each friction coefficient.",
            cure="Average neighbouring readings, or leave out repeats.",
        )


def _readings(
    item: Scan | MeasuredStress, channels: Sequence[str]
) -> Iterator[tuple[str, int, bool]]:
    """Yield the name of each load, its readings of channels, and whether these share noise."""
    if isinstance(item, Scan):
        for single in single_loads(item):
            count = len(channels) * measured_mask(single).sum()
            shared = len(channels) > 1 or single.u_zz_correlation is not None
            yield load_of(single), count, shared
        return
    for profile in item.profiles:
        points = [profile.points[channel] for channel in channels if channel in profile.points]
        count = sum(readings.u.size for readings in points)
        correlated = any(readings.correlation is not None for readings in points)
        yield profile.label, count, len(points) > 1 or correlated


def _measured(
    contacts: Sequence[Scan | MeasuredStress], apparatus: ApparatusFunction, override: bool
) -> MeasuredStress:
    """Return the stress that was measured, of scans with the apparatus function."""
    scans = [item for item in contacts if isinstance(item, Scan)]
    if len(scans) == len(contacts):
        return measure_stress(scans, apparatus, override=override)
    stresses = []
    for item in contacts:
        if isinstance(item, Scan):
            stresses.append(measure_stress(item, apparatus, override=override))
        elif apparatus.order:
            stresses.append(item)
        else:
            for profile in item.profiles:
                load_points(profile)  # refuses a file without points before anything is calculated
            stresses.append(same_apparatus(item, apparatus, override=override))
    return joined_stress(stresses)


def _setting(measured: MeasuredStress, cache: CacheFolder, workers: int) -> Values:
    """Return film, sphere, loads and reach (whole millimetres) of the contacts to calculate."""
    scan = measured.scans[0]
    widest = max(scan.width for scan in measured.scans)
    return {
        "film": scan.film,
        "indenter": scan.indenter,
        "loads": np.unique(measured.loads),
        "reach": math.ceil(_REACH * widest / _MM) * _MM,
        "cache": cache,
        "workers": workers,
    }


def _families(
    setting: Values,
    friction: Sequence[float] | None,
    loading: str | Sequence[str],
    references: Sequence[StressProfile] | None = None,
    order: int = 0,
) -> dict[str, ProfileFamily]:
    """Return calculated contacts by loading, or those of another program."""
    if references is not None:
        family = external_family(references, **setting)
        return {family.loading: family}
    values = FRICTIONS if friction is None else tuple(float(mu) for mu in friction)
    if len(values) < 2:
        raise InputError(
            "One friction coefficient is nothing to choose from.",
            cure="Give several, such as 0, 0.1, 0.3 and infinity.",
        )
    loadings = (loading,) if isinstance(loading, str) else loading
    if not loadings:
        raise InputError('No loading was given: "incremental", "total", or both.')
    return {
        name: amontons_family(friction=values, loading=name, order=order, **setting)
        for name in loadings
    }


def compare_measured(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    families: Mapping[str, ProfileFamily],
    *,
    lubricated_friction: float | None = LUBRICATED_FRICTION,
    between_scan_gain: float = BETWEEN_SCAN_GAIN,
    shear: ApparatusFunction | None = None,
    shear_families: Mapping[str, ProfileFamily] | None = None,
    macroscopic: tuple[float, float | None] | None = None,
) -> FrictionComparison:
    """Compare measured stress with families by loading, which hold every measured load."""
    channels = channels_of(measured, apparatus, families, (), between_scan_gain)
    fits = {loading: fit_friction(channel) for loading, channel in channels.items()}
    joint_fits = fits
    if shear and shear_families:
        common = common_inputs(apparatus, shear)
        normal = channels_of(measured, apparatus, families, common, between_scan_gain)
        sheared = channels_of(measured, shear, shear_families, common, between_scan_gain)
        joint_fits = {loading: fit_friction(normal[loading], sheared[loading]) for loading in fits}
    loads = _loads(measured, fits)
    joint = fit_together(measured, joint_fits, lubricated_friction)

    first = next(iter(channels.values()))
    frictionless = first.at(first.family.values[0])
    pairs = lubricated_pairs(measured.profiles)
    differences = (dry_against_lubricated(measured, frictionless, pair) for pair in pairs)

    own = comparison_checks(loads, joint, noise_stated=measured.noise_stated)
    checks = (*measured.checks, *own)
    return FrictionComparison(
        measured=measured,
        friction=first.family.values,
        loads=loads,
        joint=joint,
        dry_against_lubricated=tuple(filter(None, differences)),
        macroscopic=macroscopic,
        checks=checks,
        messages=comparison_messages(measured, families, joint, checks),
        shear=shear,
    )


def channels_of(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    families: Mapping[str, ProfileFamily],
    common: Sequence[str] = (),
    between_scan_gain: float = BETWEEN_SCAN_GAIN,
) -> dict[str, Channel]:
    """Return what one channel measured with the contacts of each family, by its loading."""
    points = points_of(measured.profiles, apparatus.sensor.channel, between_scan_gain)
    reach = max(readings.radius.max() for readings in points)
    channels = {}
    for loading, family in families.items():
        sensor = sensor_of(apparatus, family, reach, measured.scans, common)
        nearest = [abs(family.loads - load).argmin() for load in measured.loads]
        channels[loading] = Channel(points, sensor, family.only(nearest))
    return channels


def _loads(
    measured: MeasuredStress, fits: Mapping[str, FrictionFit]
) -> dict[str, tuple[LoadComparison, ...]]:
    """Compare each load by each loading; its coefficients are the middle of both."""
    loads = []
    for i, profile in enumerate(measured.profiles):
        by_loading = {loading: load_comparison(profile, fit, i) for loading, fit in fits.items()}
        for name in ("by_maximum", "by_profile"):
            read = {loading: getattr(load, name) for loading, load in by_loading.items()}
            for loading, counted in with_loading(read, tested=measured.noise_stated).items():
                change: Values = {name: counted}
                by_loading[loading] = replace(by_loading[loading], **change)
        loads.append(by_loading)
    return {loading: tuple(load[loading] for load in loads) for loading in fits}


def _compared_by_shear(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    setting: Values,
    friction: Sequence[float] | None,
    loading: str | Sequence[str],
    override: bool,
) -> FrictionComparison:
    """Compare what a tangential channel alone measured with the calculated shear."""
    notes = _accept_tangential(measured, apparatus, override)
    families = _families(setting, friction, loading, order=1)
    channels = channels_of(measured, apparatus, families)
    fits = {loading: fit_friction(channel) for loading, channel in channels.items()}
    overridden = override_messages(measured.overridden)
    loads = []
    for i in range(len(measured.profiles)):
        by_loading = {loading: fit.coefficient([i]) for loading, fit in fits.items()}
        loads.append(with_loading(by_loading, tested=measured.noise_stated))
    return FrictionComparison(
        measured=measured,
        friction=next(iter(families.values())).values,
        loads={},
        by_shear={loading: tuple(load[loading] for load in loads) for loading in fits},
        joint=fit_together(measured, fits),
        messages=(*overridden, *notes, *synthetic_messages(measured)),
        shear=apparatus,
    )


def _accept_tangential(
    measured: MeasuredStress, sensor: ApparatusFunction, override: bool
) -> list[Message]:
    """Refuse what is no tangential channel of the sensor of a measured stress; say what it is."""
    channel = sensor.sensor.channel
    if not sensor.order:
        raise InputError(
            f"The artifact is of channel {channel}, not of a tangential one.",
            cure='Give the artifact of memscal.calibrate(scan, channel="xz", method="bayesian"); '
            "compare the normal channel with memscal.compare().",
        )
    for profile in measured.profiles:
        load_points(profile, channel)  # refuses a scan without it before anything is calculated
    overridden = [
        *accepted_alterations(sensor.source),
        *accept_other_sensor(measured.scans[0], sensor, ("name",), override=override),
    ]
    return [
        *override_messages(overridden),
        Message(
            "experimental",
            f"Channel {channel} is experimental: comparisons were tested on synthetic scans only.",
        ),
    ]
