r"""What one unit of each thing that a scan takes for granted does to its voltages.

A sensor of axis ratio :math:`1 + \epsilon` along the line has the response of an elliptic
Gaussian, to first order in :math:`\epsilon`; a line at a distance :math:`y_0` from the centre reads
:math:`U(\sqrt{x^2 + y_0^2})`, of which the change begins with :math:`y_0^2`; a film that slides on
its base carries :math:`T = 2(\sinh x + x\cosh x)/(\sinh 2x + 2x)`, x = kh, of a pressure (Sneddon,
Fourier Transforms, 1951), in place of what a bonded one does.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from memscal.axisymmetry.hankel import ACROSS, RadialSpectrum
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.points import ScanPoints
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference_spectra import difference, spectrum_difference
from memscal.mechanics.film_response import base_response
from memscal.mechanics.press_rod import is_tabulated, press_rod, stick_and_slide
from memscal.model.arrays import ArrayPair, FloatArray, array_record
from memscal.model.film import LINEAR, NEO_HOOKEAN
from memscal.model.indenter import Rod
from memscal.model.scan import Scan

#: Distance of a line from the centre, over the width of the Gaussian, at which its change is taken.
_OFF = 0.2
#: Steps of the thickness, relative, and of Poisson's ratio.
_STEP = 0.05
_STEP_OF_RATIO = 0.015
#: Under this share of the load a film of any law is a linear one.
_LIGHT = 1e-4
#: Wavenumbers times thickness beyond which nothing reaches the base.
_LARGEST_KH = 38.0


@array_record
class Influence:
    """What a size of one thing does to the voltages, (n,), in V: by one unit, and by its square."""

    voltage: FloatArray
    squared: FloatArray | float = 0.0
    scaling: float = 0.0  # relative change of A beside that


def influences(scans: Sequence[Scan], estimate: ProfileEstimate) -> dict[str, Influence]:
    """Return the influence of everything that is taken for granted, by name."""
    signal = estimate.signal
    largest = estimate.largest_signal
    model = estimate.model
    slope = model.radial_derivative(estimate.gaussian.geometry, estimate.kernel)
    found = {
        "stage_scale": Influence(slope * estimate.distance),
        "baseline_curvature": Influence(largest * model.parabola),
        "gain_curvature": Influence(-signal * abs(signal) / largest),
        "load_scale": Influence(np.zeros_like(signal), scaling=1.0),
    }
    if estimate.points.order:
        return found
    if model.reference.order != ACROSS:
        found |= _of_lines(estimate)
    return found | _of_film(scans, estimate)


def measured_by(points: ScanPoints) -> tuple[str, ...]:
    """Return what points show by themselves: planes and crossed lines an ellipse and its centre."""
    return ("roundness", "line_offset") if points.ellipse else ()


def _of_lines(estimate: ProfileEstimate) -> dict[str, Influence]:
    """Influences of a sensor that is not round, and of a line that passes beside it."""
    model = estimate.model
    fit = estimate.gaussian
    second = ((fit.sigma * model.k) ** 2 / 2 * gaussian_transfer(model.k, fit.sigma))[:, None]
    oval = model.around(2, second, second[:, :0], fit.centre)[:, 0]
    away = _OFF * fit.sigma
    passing = model.geometry(estimate.centres)
    beside = replace(passing, radius=np.hypot(passing.radius, away))
    change = model.signal(beside, estimate.kernel) - model.signal(passing, estimate.kernel)
    return {
        "roundness": Influence(fit.conversion_constant * oval),
        "line_offset": Influence(np.zeros_like(change), change / away**2),
    }


def _of_film(scans: Sequence[Scan], estimate: ProfileEstimate) -> dict[str, Influence]:
    """Influences of base, shear, law, Poisson's ratio and thickness of the films."""
    both = zip(scans, estimate.model.references, strict=True)
    by_scan = [assumed_of_film(scan, reference) for scan, reference in both]
    found = {}
    for name in set.intersection(*map(set, by_scan)):
        first, second = zip(*(each[name] for each in by_scan), strict=True)
        found[name] = Influence(signal_by(estimate, first), signal_by(estimate, second))
    return found


def signal_by(estimate: ProfileEstimate, changes: Sequence[FloatArray]) -> FloatArray:
    """Voltages by changes of the references' transforms."""
    model = estimate.model
    changed = zip(model.references, changes, strict=True)
    references = tuple(replace(reference, values=values) for reference, values in changed)
    model = replace(model, references=references)
    return model.signal(estimate.gaussian.geometry, estimate.kernel)


def assumed_of_film(scan: Scan, reference: RadialSpectrum) -> dict[str, ArrayPair]:
    """Changes of a scan's reference by one unit of each property of its film, and its square."""
    if scan.film is None or scan.indenter is None or reference.source:
        return {}
    set_up = scan.set_up.expected
    film = set_up.film
    k = reference.wavenumbers.k
    nothing = np.zeros_like(k)
    x = np.minimum(k * film.thickness, _LARGEST_KH)
    bonded, _ = base_response(x, film.poisson_ratio)
    sliding = 2 * (np.sinh(x) + x * np.cosh(x)) / (np.sinh(2 * x) + 2 * x)
    shear, _ = base_response(x, film.poisson_ratio, 1)
    changes = {
        "base_slip": (reference.values * (sliding / bonded - 1), nothing),
        "shear_sensitivity": (-reference.values * k * shear / bonded, nothing),
    }
    step = _STEP * film.thickness
    # Beyond 1/2 there is no Poisson's ratio.
    tried = {"poisson_ratio": (-2 * _STEP_OF_RATIO, -_STEP_OF_RATIO), "thickness": (-step, step)}
    for name, steps in tried.items():
        if getattr(scan.film, f"{name}_uncertainty") is None:
            by_step = []
            for d in steps:
                varied = set_up._replace(film=replace(film, **{name: getattr(film, name) + d}))
                by_step.append(difference(set_up, reference, varied, set_up) / d)
            square = (by_step[1] - by_step[0]) / (steps[1] - steps[0])
            changes[name] = (by_step[0] - square * steps[0], square)
    linear = film.law == LINEAR
    rubber = replace(film, law=NEO_HOOKEAN, mooney_rivlin_ratio=None)
    rod = set_up.indenter
    if isinstance(rod, Rod) and is_tabulated(rubber, rod, set_up.load):
        own = press_rod(rubber, rod, set_up.load, math.inf if linear else set_up.rod_friction)
        light = press_rod(rubber, rod, _LIGHT * set_up.load, math.inf)
        changes["film_law"] = (spectrum_difference(reference, own, light), nothing)
        if not linear:
            sticks, slides = stick_and_slide(rubber, rod, set_up.load)
            # Per newton the difference of rods that are solved at less load grows with the load.
            grown = set_up.load / sticks.load
            change = grown * spectrum_difference(reference, slides, sticks)
            changes["rod_friction"] = (change, nothing)
    return changes
