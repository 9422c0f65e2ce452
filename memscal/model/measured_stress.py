r"""Measured stress: what a calibrated sensor measured at the base of a film, load by load.

.. math::

    S_{zz}(r) = \frac{U_{zz} - b - d\,\xi}{A} = (G \otimes \sigma_{zz})(r)

It is the base stress as the sensor blurs it, to be compared with calculated stress blurred by the
same G.  A profile also holds the measured points, so that a comparison needs no scan.

Files state lengths in mm and voltages in mV.  Every length and voltage here is rounded to a number
that this conversion gives back, so that what was saved and read again is equal to the last bit.
"""

from collections.abc import Mapping
from dataclasses import field, replace
from os import PathLike
from typing import Any, TypeVar

import numpy as np

from memscal.extensions import hook
from memscal.model.arrays import (
    ByContent,
    FloatArray,
    frozen_array,
    keyword_array_record,
    keyword_value_record,
)
from memscal.model.checks import NOISE_UNSTATED, Checked, Messages, QualityChecks, state_of_checks
from memscal.model.film import ElasticFilm
from memscal.model.indenter import RoundIndenter
from memscal.model.instrument import Equipment, LoadCell, StressSensor
from memscal.model.notation import Reading, format_measured
from memscal.model.provenance import Process, SourceFile
from memscal.model.result import Result
from memscal.model.scan import DIRECTIONS

#: Millimetres in a metre, millivolts in a volt.
_FILE_SCALE = 1e3

Record = TypeVar("Record", ElasticFilm, RoundIndenter)


@keyword_value_record
class MeasuredScan:
    """What is known of a scan beside its points.

    ``width``: its largest extent, in m; ``position_scale_uncertainty``, ``gain_uncertainty``:
    relative, of the stage and of the sensor's chain; ``position_errors_by_repeat``: whether the
    errors of its positions are new in each repeat; ``speed``: of the indenter, in m/s, and
    ``sliding_friction``, where a sliding scan states them;
    ``synthetic``: whether it was simulated; ``source``: the file it was read from; ``unit``: SI
    unit of its readings where they are no voltages.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> measured = memscal.measure_stress(made.dry, sensor)
    >>> known = measured.profiles[0].scan
    >>> known.lubrication, known.synthetic
    ('dry', True)
    """

    film: ElasticFilm
    indenter: RoundIndenter
    sensor: StressSensor
    width: float
    load_cell: LoadCell = field(default_factory=LoadCell)
    stage: Equipment = field(default_factory=Equipment)
    lubrication: str = ""
    motion: str = ""
    speed: float | None = None
    sliding_friction: float | None = None
    sliding_friction_uncertainty: float | None = None
    position_scale_uncertainty: float | None = None
    gain_uncertainty: float | None = None
    position_errors_by_repeat: bool = False
    synthetic: bool = False
    source: SourceFile | None = None
    unit: str = ""

    @property
    def reading(self) -> Reading:
        """The unit in which its readings are stored and shown."""
        return Reading.fitting(self.unit or "V")

    def __post_init__(self) -> None:
        object.__setattr__(self, "film", _kept_record(self.film, "thickness", "roughness_rms"))
        object.__setattr__(self, "indenter", _kept_record(self.indenter, "radius"))
        _freeze(self, "width", scale=_FILE_SCALE)


@keyword_array_record
class MeasuredPoints(ByContent):
    """The measured points of one load and channel, missing ones left out; arrays of shape (n,).

    ``x``, ``y``: positions, zero across a line, ``x_errors``: standard uncertainty along the
    scan, in m; ``u``: voltage, ``noise``: its electronic noise, stated or estimated, in V,
    ``None`` where a tangential channel states none; ``weight``: of outliers, one of ordinary
    points; ``load``, ``load_errors`` in N; ``correlation`` (n, n) of the noise, if stated;
    ``by_dynamics`` (q, n): change of ``u``, which is that of a still sensor, by one standard
    uncertainty of each number of the sensor's dynamics, in V.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> measured = memscal.measure_stress(made.dry, sensor)
    >>> points = measured.profiles[0].points["zz"]
    >>> points.u.shape == points.x.shape  # V, m
    True
    """

    x: FloatArray
    y: FloatArray
    u: FloatArray
    noise: FloatArray | None
    weight: FloatArray
    load: FloatArray
    load_errors: FloatArray
    x_errors: FloatArray
    correlation: FloatArray | None = None
    by_dynamics: FloatArray | None = None

    def __post_init__(self) -> None:
        _freeze(self, "weight", "load", "load_errors", "correlation")
        _freeze(self, "x", "y", "x_errors", "u", "noise", "by_dynamics", scale=_FILE_SCALE)

    def __repr__(self) -> str:
        """Return the number of points in place of arrays."""
        return f"<MeasuredPoints: {self.u.size}>"


@keyword_array_record
class MeasuredProfile(ByContent):
    """The measured stress of one load, from the centre outward.

    Parameters
    ----------
    scan : MeasuredScan
        What was scanned: film, indenter, sensor, lubrication, file.
    load, load_uncertainty : float
        Nominal load and its standard uncertainty, common to all loads of a scan, in N.
    x, y, r : ndarray, shape (n,)
        Positions and their distance from the centre, by which they are sorted, in m.  Repeats at
        one position are averaged by their weights.
    s_zz : ndarray, shape (n,)
        Stress there, in Pa, positive in compression.
    roots : mapping of str to ndarray, shape (n,) or (n, p)
        Square roots of its covariance by source, in Pa: (n,) standard uncertainties that are
        independent from point to point, (n, p) columns whose outer products add up to the
        covariance.  ``noise`` (electronic, of loads and of positions), ``conversion_constant``,
        ``centre``, ``baseline`` (with drift; what centre and baseline share is the centre's).
    force, force_budget : float, mapping of str to float
        Integral of the stress over the plane and its standard uncertainty by source, in N.
    maximum, maximum_budget : float, mapping of str to float
        Stress on the axis, restored and blurred by G, and its standard uncertainty by source, in
        Pa.
    centre, centre_uncertainty : ndarray, shape (2,)
        Centre (x0, y0) of the profile, in m; zero across a line.
    baseline, baseline_uncertainty : float
        Baseline in the middle of the scan, in V.
    contact_radius : float
        Of the frictionless contact at the nominal load, in m.
    direction : float
        1 where the indenter slid along the positions, -1 where against them, 0 where not stated.
    tangential_load : float, optional
        Mean of the loads along the positions, in N, where they were recorded.
    curve_r, curve_s_zz : ndarray, shape (m,)
        The restored stress blurred by G, in Pa, at radii in m: a smooth curve through the points.
    points : mapping of str to MeasuredPoints
        The measured points by channel (``"zz"``, ``"xz"``, ``"yz"``); none if it was read from a
        file of version 1.0.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> measured = memscal.measure_stress(made.dry, sensor)
    >>> [profile] = measured.profiles
    >>> abs(profile.force - profile.load) < 5 * profile.force_uncertainty  # N
    True
    """

    scan: MeasuredScan
    load: float
    load_uncertainty: float | None
    x: FloatArray
    y: FloatArray
    r: FloatArray
    s_zz: FloatArray
    roots: Mapping[str, FloatArray]
    force: float
    force_budget: Mapping[str, float]
    maximum: float
    maximum_budget: Mapping[str, float]
    centre: FloatArray
    centre_uncertainty: FloatArray
    baseline: float
    baseline_uncertainty: float
    contact_radius: float
    direction: float = 0.0
    tangential_load: float | None = None
    curve_r: FloatArray = field(default_factory=lambda: np.zeros(0))
    curve_s_zz: FloatArray = field(default_factory=lambda: np.zeros(0))
    points: Mapping[str, MeasuredPoints] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _freeze(self, "s_zz", "curve_s_zz")
        _freeze(self, "x", "y", "r", "centre", "centre_uncertainty", "curve_r", scale=_FILE_SCALE)
        _freeze(self, "baseline", "baseline_uncertainty", "contact_radius", scale=_FILE_SCALE)
        frozen = {source: frozen_array(values) for source, values in self.roots.items()}
        object.__setattr__(self, "roots", frozen)

    def __repr__(self) -> str:
        """Return load, force and maximum in place of arrays."""
        force = format_measured(self.force, self.force_uncertainty, "N")
        top = format_measured(self.maximum * 1e-3, self.maximum_uncertainty * 1e-3, "kPa")
        return f"<MeasuredProfile: {self.label}, force {force}, maximum {top}>"

    @property
    def label(self) -> str:
        """Load and state in words, as in ``"0.34 N, dry"``."""
        return ", ".join(filter(None, (f"{self.load:.4g} N", self.state)))

    @property
    def state(self) -> str:
        """Direction of sliding and lubrication in words, as in ``"forth, dry"``, where stated."""
        slid = [word for word, sign in DIRECTIONS.items() if sign == self.direction]
        return ", ".join(filter(None, (*slid, self.lubrication)))

    @property
    def lubrication(self) -> str:
        """``"dry"``, ``"lubricated"`` or empty."""
        return self.scan.lubrication

    @property
    def axis(self) -> int:
        """0 or 1: along which of x and y the scan ran; 0 of a raster."""
        return int(np.ptp(self.x) == 0)

    @property
    def covariance(self) -> FloatArray:
        """Covariance of ``s_zz``, shape (n, n), in Pa^2; of very many points use ``roots``."""
        parts = (np.diag(r**2) if r.ndim == 1 else r @ r.T for r in self.roots.values())
        return np.asarray(sum(parts))

    @property
    def s_zz_errors(self) -> FloatArray:
        """Standard uncertainty of ``s_zz``, in Pa."""
        return self.errors_by(*self.roots)

    def errors_by(self, *sources: str) -> FloatArray:
        """Standard uncertainty of ``s_zz`` by some of the sources, shape (n,), in Pa."""
        roots = [self.roots[source].reshape(self.r.size, -1) for source in sources]
        none = np.zeros((self.r.size, 0))
        return np.asarray(np.linalg.norm(np.hstack([none, *roots]), axis=1))

    @property
    def force_uncertainty(self) -> float:
        """Standard uncertainty of ``force``, in N."""
        return float(np.linalg.norm(list(self.force_budget.values())))

    @property
    def maximum_uncertainty(self) -> float:
        """Standard uncertainty of ``maximum``, in Pa."""
        return float(np.linalg.norm(list(self.maximum_budget.values())))


@keyword_array_record
class MeasuredStress(Result, Checked, ByContent):
    """The measured stress of all loads of one or several scans, live or read from its file.

    Made by :func:`memscal.measure_stress` or :func:`memscal.read_stress`; the two are equal if one
    was saved and the other read from that file.

    Parameters
    ----------
    profiles : tuple of MeasuredProfile
        In the order of the scans, each from its smallest load up.
    scans : tuple of MeasuredScan
        What was scanned.
    conversion_constant, conversion_constant_uncertainty : float
        A, by which the voltages were divided, and its standard uncertainty, in V/Pa.
    checks : tuple of QualityCheck
        Those of each profile, numbered from one, then those of all together.
    overridden : tuple of str
        Mismatches of artifact and scan that were accepted.
    process : Process
        Options, versions, input files and messages.
    artifact, artifact_digest : SourceFile, str, optional
        File of the apparatus function, where it was read from one, and its content digest, empty
        in files of version 1.0.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> measured = memscal.measure_stress(made.dry, sensor)
    >>> [profile.load for profile in measured.profiles]  # N; print(measured) shows the tables
    [0.69]
    """

    profiles: tuple[MeasuredProfile, ...]
    scans: tuple[MeasuredScan, ...]
    conversion_constant: float
    conversion_constant_uncertainty: float
    checks: QualityChecks
    overridden: tuple[str, ...]
    process: Process
    artifact: SourceFile | None = None
    artifact_digest: str = ""

    def __post_init__(self) -> None:
        names = ("conversion_constant", "conversion_constant_uncertainty")
        _freeze(self, *names, scale=_FILE_SCALE)

    def __repr__(self) -> str:
        """Return the loads and the state of the checks."""
        loads = "; ".join(profile.label for profile in self.profiles)
        return f"<MeasuredStress: {loads}; {state_of_checks(self.checks)}>"

    @property
    def loads(self) -> FloatArray:
        """Nominal load of each profile, in N."""
        return np.array([profile.load for profile in self.profiles])

    @property
    def messages(self) -> Messages:
        """Notes and warnings of the measurement, the most serious first."""
        return self.process.messages

    @property
    def noise_stated(self) -> bool:
        """Whether every scan states its noise, so that a misfit shows in a chi-square."""
        return all(message.kind != NOISE_UNSTATED for message in self.messages)

    def save(self, path: str | PathLike[str], *, overwrite: bool = False) -> None:
        """Write the measured stress to a file (memscal-stress).

        The same files and options give the same bytes while ``SOURCE_DATE_EPOCH`` is set.
        """
        hook("write_stress")(self, path, overwrite=overwrite)


def _kept_record(record: Record, *lengths: str) -> Record:
    """Round lengths of a film or an indenter to numbers that a file's unit gives back."""
    names = [name + end for name in lengths for end in ("", "_uncertainty")]
    stated = {name: getattr(record, name) for name in names}
    kept: Any = {
        name: float(value) * _FILE_SCALE / _FILE_SCALE
        for name, value in stated.items()
        if value is not None
    }
    return replace(record, **kept)


def _freeze(owner: object, *names: str, scale: float = 1.0) -> None:
    """Replace arrays by read-only copies; round them, and numbers, of lengths and voltages."""
    for name in names:
        values = getattr(owner, name)
        if values is not None:
            kept = frozen_array(frozen_array(values) * scale / scale)
            object.__setattr__(owner, name, kept if kept.ndim else float(kept))
