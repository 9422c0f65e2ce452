r"""The noise of a sensor at rest: its spectral density, the correlation of readings, and drift.

A record U(t) is taken as white noise and exponentially correlated noise of few correlation times
:math:`\tau_i`, with the autocovariance and the one-sided spectral density

.. math::

    R(t) = w^2\,[t = 0] + \sum_i s_i^2\,e^{-|t|/\tau_i}, \qquad
    S_n(f) = 2 w^2 \Delta t + \sum_i \frac{4 s_i^2 \tau_i}{1 + (2 \pi f \tau_i)^2} .

The variances are the most likely ones by Whittle's likelihood of the tapered periodogram.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from memscal.errors import FitError, InputError, counted
from memscal.model.arrays import FloatArray, IndexArray, array_record
from memscal.model.checks import Message
from memscal.model.notation import Reading
from memscal.model.scan import Scan

_FEWEST = 64
#: A step of the times may differ from the others by this share.
_UNEVEN = 0.1
#: Correlation times in a decade, and the longest one over the record.
_PER_DECADE = 6
_LONGEST = 3.0
#: What is correlated over more than this share of the record is drift.
_DRIFTS = 0.1
#: The periodogram is averaged over so many bins of frequency, without its first lines.
_BINS = 400
_FIRST_LINE = 2
_ROUNDS = 100
#: A further correlation time raises the log-likelihood by so much, or is left out.
_CLEARLY = 4.0
#: Readings that are less correlated are taken as independent.
_INDEPENDENT = 1e-3


@array_record
class NoiseRecord:
    """The noise of a sensor, as a record at rest has it."""

    step: float  # from sample to sample, in s
    white: float  # variance of what is independent from sample to sample, in V^2
    times: FloatArray  # (m,): correlation times, in s
    variances: FloatArray  # (m,): of each of them, in V^2
    duration: float  # in s

    def spectral_density(self, frequency: FloatArray) -> FloatArray:
        """One-sided spectral density in V^2/Hz at frequencies in Hz."""
        return 2 * self.step * self.white + self._densities(frequency) @ self.variances

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency of the record in Hz: one period, and half the rate."""
        return 1 / self.duration, 0.5 / self.step

    @property
    def corner(self) -> float:
        """Highest frequency, in Hz, at which drift is more than all other noise; 0 for none."""
        frequency = np.geomspace(0.1 / self.duration, 0.5 / self.step, _BINS)
        drifting = self.times > _DRIFTS * self.duration
        drift = self._densities(frequency) @ (self.variances * drifting)
        rules = frequency[drift > 0.5 * self.spectral_density(frequency)]
        return float(rules[-1]) if rules.size else 0.0

    def covariance(self, lags: FloatArray, samples: int = 1) -> FloatArray:
        """Covariance in V^2 of readings, each the mean of some samples, at lags in s."""
        covariance = np.zeros(lags.shape)
        for shift in range(1 - samples, samples):
            lag = np.abs(lags + shift * self.step)
            single = self.white * (lag < self.step / 2)
            for time, variance in zip(self.times, self.variances, strict=True):
                single += variance * np.exp(-lag / time)
            covariance += (1 - abs(shift) / samples) / samples * single
        return covariance

    def text(self, reading: Reading) -> str:
        """Return its size, rate and drift in words."""
        size = float(self.covariance(np.zeros(1))[0]) ** 0.5
        drift = f"below {self.corner:.2g} Hz drift rules" if self.corner else "no drift is seen"
        rate = f"{1 / self.step:.4g} readings a second for {self.duration:.4g} s"
        return f"Noise at rest: {reading.text(size)} (rms) at {rate}; {drift}."

    def _densities(self, frequency: FloatArray) -> FloatArray:
        """Spectral density for each correlation time, of variance one."""
        turn = np.multiply.outer(2 * np.pi * frequency, self.times)
        return np.asarray(4 * self.times / (1 + turn**2))


def noise_of(record: Scan) -> NoiseRecord:
    """Return the noise that a record at rest shows."""
    from scipy.signal import periodogram

    name = record.source.file_name if record.source else "The noise record"
    if record.motion != "rest" or record.time is None or record.indenter:
        raise InputError(
            f"{name} is no noise record: something was pressed on the sensor.",
            cure="Give the readings of the sensor at rest (memscal import --noise-record).",
        )
    known = np.isfinite(record.time + record.u_zz)
    time = record.time[known]
    u = record.u_zz[known]
    step = float(np.median(np.diff(time))) if time.size >= _FEWEST else 0.0
    if step <= 0 or np.abs(np.diff(time) - step).max() > _UNEVEN * step:
        raise InputError(
            f"The {time.size} readings of {name} that are not missing are fewer than {_FEWEST}, or "
            "do not follow each other in even steps of time.",
            why="Their spectral density tells how the noise of readings is correlated.",
            cure=f"Give at least {_FEWEST} readings at one rate, without gaps.",
        )
    if not np.ptp(u):
        raise FitError(f"All readings of {name} are equal.", cure="Record more digits.")
    duration = time.size * step
    count = int(_PER_DECADE * np.log10(_LONGEST * duration / step)) + 1
    times = np.geomspace(step, _LONGEST * duration, count)
    frequency, power = periodogram(u, 1 / step, window="hann")
    lines = slice(_FIRST_LINE, None)
    decay = np.exp(-step / times)
    turn = np.cos(2 * np.pi * frequency[lines, None] * step)
    slow = 2 * step * (1 - decay**2) / (1 - 2 * decay * turn + decay**2)
    densities = np.column_stack([np.full(len(slow), 2 * step), slow])
    white, *variances = _most_likely(power[lines], densities)
    found = np.flatnonzero(variances)
    return NoiseRecord(step, float(white), times[found], np.array(variances)[found], duration)


def _most_likely(power: FloatArray, densities: FloatArray) -> FloatArray:
    """Return the variances, (m,), by which few of the densities (f, m) make the periodogram."""
    edges = np.unique(np.geomspace(1, power.size, _BINS).astype(int)) - 1
    counts = np.diff(edges, append=power.size)
    # Means over bins of frequency.
    found = np.add.reduceat(power, edges) / counts
    shapes = (np.add.reduceat(densities.T, edges, axis=-1) / counts).T
    # White noise, then whichever makes the record more likely, while it does so clearly: many
    # at once would follow the scatter of the few lowest lines.
    chosen = [0]
    variances, least = _fitted(found, shapes[:, chosen], counts)
    while len(chosen) < shapes.shape[1]:
        others = [i for i in range(shapes.shape[1]) if i not in chosen]
        tried = [_fitted(found, shapes[:, [*chosen, i]], counts) for i in others]
        best = int(np.argmin([loss for _, loss in tried]))
        if least - tried[best][1] < _CLEARLY:
            break
        chosen.append(others[best])
        variances, least = tried[best]
    every = np.zeros(shapes.shape[1])
    every[chosen] = variances
    return every


def _fitted(found: FloatArray, shapes: FloatArray, counts: IndexArray) -> tuple[FloatArray, float]:
    """Return the most likely variances of densities, and their loss of Whittle's likelihood."""
    # By multiplicative rounds (Fevotte and Idier, Neural Comput. 23, 2011, Eq. 4.1).
    variances = found.mean() / shapes.mean(axis=0) / shapes.shape[1]
    for _ in range(_ROUNDS):
        fitted = shapes @ variances
        rise = (counts * found / fitted**2) @ shapes
        variances = variances * rise / ((counts / fitted) @ shapes)
    fitted = shapes @ variances
    return variances, float(counts @ (found / fitted + np.log(fitted)))


def record_messages(scan: Scan) -> Iterator[Message]:
    """Say from which record the noise of a scan is, and whether its dynamics count."""
    timed = scan.time is not None and np.isfinite(scan.time).any()
    if scan.sensor.dynamics and not (timed or scan.speed or scan.dwell_time):
        yield Message(
            "dynamics_unused",
            "The sensor's dynamics do not count: neither the times of the readings nor a speed "
            "(memscal import --time, --speed) tell how fast the indenter moved.",
        )
    record = scan.noise_record
    if record is not None:
        named = "a record at rest that travels with the scan"
        if record.source:
            named = f"{record.source.file_name} (sha256 {record.source.sha256})"
        text = f"Size and correlation of the noise are those of {named}."
        yield Message("noise_record", text, "note")


def with_recorded_noise(scan: Scan) -> Scan:
    """Return a scan whose noise, in size and correlation, is that of its noise record, if any."""
    record = scan.noise_record
    if record is None:
        return scan
    name = scan.source.file_name if scan.source else "The scan"
    if scan.time is None:
        raise InputError(
            f"{name} does not state when each reading was made (/entry/data/time).",
            why="A noise record tells the correlation of readings by the time between them.",
            cure="Import it with its times (memscal import --time), or state the noise (--noise).",
        )
    untimed = np.isfinite(scan.u_zz) & ~np.isfinite(scan.time)
    passes = scan.time.reshape(-1, scan.time.size if scan.planar else scan.x.size)
    repeated = [np.unique(row[np.isfinite(row)], return_counts=True)[1] for row in passes]
    again = np.sum(np.concatenate(repeated) - 1)
    if untimed.any() or again:
        raise InputError(
            f"{name} states no time of {counted(untimed.sum(), 'readings')}, and of {again} that "
            "of another of the same pass (/entry/data/time).",
            why="A noise record tells the correlation of readings by the time between them.",
            cure="Give the time of each reading, or state the noise (--noise).",
        )
    if record.unit != scan.unit:
        raise InputError(
            f"The readings of {name} are in {scan.unit}, those of its noise record in "
            f"{record.unit}.",
            cure="Give a record of the same sensor, in the same unit.",
        )
    noise = noise_of(record)
    lags = np.mean([np.abs(np.subtract.outer(times, times)) for times in passes], axis=0)
    samples = 1
    if scan.averaging_length is not None:
        first = passes[0][: scan.x.size]
        lasts = np.nanmax(first) - np.nanmin(first)
        share = scan.averaging_length / np.abs(np.diff(scan.x)).sum()
        samples = max(round(share * lasts / noise.step), 1)
    covariance = np.nan_to_num(noise.covariance(lags, samples))
    variance = float(noise.covariance(np.zeros(1), samples)[0])
    correlation = covariance / variance
    np.fill_diagonal(correlation, 1.0)
    alike = np.abs(correlation - np.eye(len(correlation))).max() > _INDEPENDENT
    return replace(
        scan,
        u_zz_errors=np.full(scan.u_zz.shape, np.sqrt(variance)),
        u_zz_correlation=correlation if alike else np.ones((len(correlation), 1)),
    )
