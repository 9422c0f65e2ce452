"""G over the plane from rasters of a sensor that is not round: error, uncertainty, prediction.

The sensor is an ellipse with a tail to one side, at 0.5 % noise that is not stated; its scans are
direct convolutions (helpers.rasters).  Set MEMSCAL_FULL_STUDY for 20 rasters in place of 2.  With
--log-cli-level=INFO the study tells the figures of docs/accuracy.md.
"""

import logging
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square
from helpers.rasters import CENTRE, WIDTH, TailedEllipse, tailed_raster
from helpers.scans import CONVERSION
from scipy.interpolate import CloughTocher2DInterpolator, NearestNDInterpolator, RectBivariateSpline
from scipy.signal import fftconvolve
from skimage.restoration import wiener

import memscal

LOG = logging.getLogger(__name__)

SEEDS, SIZE = (20, {}) if FULL else (2, {"side": 41, "half": 5e-3})
AXIS = np.arange(-2 * WIDTH, 2 * WIDTH, 0.05e-3)
INSIDE = np.hypot.outer(AXIS, AXIS) < 2 * WIDTH
METHODS = ("white-noise", "bayesian")


@lru_cache
def halves(seed, method):
    """Calibrate with the black fields of a checkerboard, and with the white ones."""
    scan = tailed_raster(seed=seed, **SIZE)
    black = np.indices(scan.u_zz.shape).sum(axis=0) % 2 == 0
    parts = (replace(scan, u_zz=np.where(kept, scan.u_zz, np.nan)) for kept in (black, ~black))
    return tuple(memscal.calibrate(part, method=method).apparatus for part in parts)


def on_plane(apparatus, name):
    """A field of an apparatus function out to two widths from its centre, (p,)."""
    field = apparatus.field
    spline = RectBivariateSpline(field.y, field.x, getattr(field, name))
    return np.asarray(spline(AXIS, AXIS)[INSIDE])


def true_g(apparatus):
    """G at the same places."""
    p = apparatus.parameters
    x = AXIS + p["centre"] - CENTRE[0]
    y = AXIS + p["centre_y"] - CENTRE[1]
    return np.asarray(TailedEllipse().at(x[None, :], y[:, None])[INSIDE])


@pytest.mark.parametrize("method", METHODS)
def test_halves_of_a_raster_differ_as_their_uncertainty_says(method):
    of_noise = []
    of_all = []
    of_truth = []
    relative = []
    deviates = []
    outliers = []
    for seed in range(SEEDS):
        first, second = halves(seed, method)
        difference = on_plane(first, "g") - on_plane(second, "g")
        for name, ratios in (("g_scatter", of_noise), ("g_errors", of_all)):
            both = np.hypot(on_plane(first, name), on_plane(second, name))
            ratios.append(root_mean_square(difference / both))
        for half in (first, second):
            error = on_plane(half, "g") - true_g(half)
            truth = true_g(half)
            of_truth.append(root_mean_square(error / on_plane(half, "g_errors")))
            relative.append(root_mean_square(error) / root_mean_square(truth))
            a = half.conversion_constant
            u = half.parameters.uncertainty("conversion_constant")
            deviates.append((a - CONVERSION) / u)
            outliers.append(sum(m.kind == "outlier" for m in half.process.messages))
    names = "noise", "all", "truth", "relative error", "deviates of A"
    figures = [np.mean(v) for v in (of_noise, of_all, of_truth, relative)] + [
        root_mean_square(deviates)
    ]
    LOG.info("%s: %s", method, {n: f"{v:.3f}" for n, v in zip(names, figures, strict=True)})
    assert 0.7 < np.mean(of_noise) < 1.3
    # A weight is halved beyond 4.2 standard deviations: in one half in 14.
    assert np.mean(outliers) < 0.5
    # What the film hides is the same of both halves, and larger by method bayesian's prior.
    assert (0.6 if method == "white-noise" else 0.3) < np.mean(of_all) < 1.3
    assert 0.4 < np.mean(of_truth) < 1.3
    assert np.mean(relative) < (0.11 if method == "white-noise" else 0.05)
    # Deviates of unit variance exceed this in fewer than one study in a thousand.
    assert abs(np.mean(deviates)) < 3.3 / np.sqrt(len(deviates))


def test_held_out_points_are_predicted_as_well_as_by_a_tuned_wiener_filter():
    ratios = {method: [] for method in METHODS}
    for seed in range(SEEDS):
        scan = tailed_raster(seed=seed, **SIZE)
        held = np.random.default_rng(1000 + seed).random(scan.u_zz.shape) < 0.2
        train = replace(scan, u_zz=np.where(held, np.nan, scan.u_zz))
        peer = best_wiener(scan, held)
        for method in METHODS:
            ratios[method].append(residual(scan, held, predicted(train, method)) / peer)
    LOG.info("over scikit-image's Wiener filter: %s", ratios)
    assert max(float(np.mean(ratio)) for ratio in ratios.values()) < 1.1


def predicted(train, method):
    """Voltages at all nodes by the field of G, without baseline."""
    calibration = memscal.calibrate(train, method=method)
    p = calibration.apparatus.parameters
    step = train.x[1] - train.x[0]
    beyond = 40
    far = step * np.arange(1, beyond + 1)
    axis = np.concatenate([train.x[0] - far[::-1], train.x, train.x[-1] + far])
    stress = stress_about(train, axis - p["centre"], axis - p["centre_y"])
    volts = calibration.apparatus.predict(axis, stress, y=axis)
    return np.asarray(volts[beyond:-beyond, beyond:-beyond])


def stress_about(scan, x, y):
    contact = memscal.indent(scan.film, scan.indenter, load=scan.load)
    r = np.hypot.outer(y, x)
    return contact.base_stress(r.ravel()).reshape(r.shape)


def best_wiener(scan, held):
    """Least error at the points held out, the balance chosen for that."""
    x, y = scan.positions
    places = np.stack([x[~held], y[~held]], axis=1)
    image = scan.u_zz.copy()
    inner, edge = (
        interpolator(places, scan.u_zz[~held])(x[held], y[held])
        for interpolator in (CloughTocher2DInterpolator, NearestNDInterpolator)
    )
    image[held] = np.where(np.isnan(inner), edge, inner)
    image -= np.median(np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]]))
    axis = scan.x - scan.x[scan.x.size // 2]
    top = image.max()
    psf = stress_about(scan, axis, axis)
    psf /= psf.sum()
    restored = (wiener(image / top, psf, b, clip=False) for b in np.geomspace(1e-8, 1, 60))
    volts = (top * fftconvolve(kernel, psf, mode="same") for kernel in restored)
    return min(residual(scan, held, v) for v in volts)


def residual(scan, held, volts):
    """RMS error at the points held out; baseline and drift are fitted to the others."""
    x, y = scan.positions
    plane = np.stack([np.ones_like(x), x, y], axis=-1)
    left = scan.u_zz - volts
    drift = np.linalg.lstsq(plane[~held], left[~held], rcond=None)[0]
    return root_mean_square((left - plane @ drift)[held])
