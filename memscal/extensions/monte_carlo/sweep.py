"""Sweep of the white noise: how a calibration depends on its amplitude and its seed."""

from dataclasses import replace

import numpy as np

from memscal.calibration.stages import Solution, deconvolve, prepare_fields
from memscal.deconvolution.division import Regulariser, WhiteNoise, WhiteNoiseDraw, require_count
from memscal.errors import FitError
from memscal.model.arrays import FloatArray, array_record
from memscal.model.notation import VOLTS, Reading
from memscal.model.result import Gridded, Shown
from memscal.progress import Task


@array_record
class Sweep(Shown, Gridded):
    """Results against the noise amplitude.

    Parameters
    ----------
    amplitude : ndarray, shape (n,)
        Noise amplitude over the rule's choice.
    conversion_constant : ndarray, shape (n,)
        A of the expectation, in V/Pa.
    gaussian_sigma_deconvolved : ndarray, shape (n,)
        Width of the Gaussian fitted to G, in m.
    relative_rms : ndarray, shape (n,)
        Reconvolution residual over the largest signal.
    seed_conversion_constant, seed_gaussian_sigma, seed_relative_rms : ndarray, shape (n, seeds)
        The same for single draws; NaN for a draw whose quotient has no positive integral.

    Examples
    --------
    >>> import memscal
    >>> calibration = memscal.calibrate(memscal.simulate(seed=1))
    >>> sweep = calibration.sweep(amplitudes=3, draws=1)  # of the noise that is added
    >>> sweep.conversion_constant.shape == sweep.amplitude.shape
    True
    """

    amplitude: FloatArray
    conversion_constant: FloatArray
    gaussian_sigma_deconvolved: FloatArray
    relative_rms: FloatArray
    seed_conversion_constant: FloatArray
    seed_gaussian_sigma: FloatArray
    seed_relative_rms: FloatArray
    reading: Reading = VOLTS

    def __repr__(self) -> str:
        """Return the amplitudes in place of the arrays."""
        amplitudes, draws = self.seed_relative_rms.shape
        low = self.amplitude.min()
        high = self.amplitude.max()
        return f"<Sweep: {amplitudes} amplitudes from {low:g} to {high:g}, {draws} draws at each>"


def sweep_noise(solution: Solution, *, amplitudes: int, draws: int, seed: int) -> Sweep:
    """Repeat the division over two decades of noise amplitude and several seeds."""
    require_count("sweep", "amplitudes", amplitudes, 3)
    require_count("sweep", "draws", draws, 1)
    # The method's own fields may be those of points that lie on no lattice: they cannot be divided.
    fields = prepare_fields(solution.estimate, solution.smoothed, solution.choice)
    solution = replace(solution, fields=fields)
    seeds = range(seed, seed + draws)
    amplitude = np.logspace(-1, 1, amplitudes)
    methods: list[Regulariser] = [WhiteNoise(amplitude=a) for a in amplitude]
    methods += [WhiteNoiseDraw(amplitude=a, seed=s) for a in amplitude for s in seeds]
    outcomes = (_outcome(solution, method) for method in methods)
    results = np.array(list(Task("divisions", len(methods)).counted(outcomes)))
    drawn = results[amplitudes:].reshape(amplitudes, draws, 3)
    return Sweep(amplitude, *results[:amplitudes].T, *np.moveaxis(drawn, -1, 0))


def _outcome(solution: Solution, regulariser: Regulariser) -> tuple[float, float, float]:
    try:
        result = deconvolve(solution.estimate, solution.band, solution.fields, regulariser)
    except FitError:
        return np.nan, np.nan, np.nan
    return result.conversion_constant, result.gaussian_sigma, result.misfit.relative_rms
