"""Quality checks of a calibrated array, each with the sensors that fail it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.special import chdtrc, chdtri, ndtr, ndtri

from memscal.calibration.prepare import Prepared
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.array_numbers import array_numbers
from memscal.extensions.arrays.joint_fit import JointFit
from memscal.extensions.arrays.presses import Sorted, fitted_layout
from memscal.model.arrays import BoolArray, IndexArray, slices
from memscal.model.checks import (
    FALSE_ALARM,
    Message,
    QualityCheck,
    added_check,
    check,
    override_messages,
    uncertainty_unstated_messages,
)
from memscal.model.scan import Scan
from memscal.summaries.table import percent

#: Crosstalk is identified where its median standard uncertainty is at most this.
IDENTIFIED = 0.005
#: Estimates by common and by own shapes agree within so many uncertainties of their difference.
_AGREEING = 2.0
#: The variance of a difference is at least this share of the larger one: shapes are averaged.
_LEAST_APART = 0.5
#: A scan reaches beyond the last sensor by so many thicknesses of the film, or a little less.
_BEYOND = 2.0
_SHORT = 0.1
#: Standard uncertainty of a layout that states none, over the least distance.
_UNSTATED = 0.03
#: A layout is turned and scaled by a factor this near to 1: by 30 degrees, or by a half.
_ALIKE = 0.5
#: A sensor so far beside a line, in widths of G, has an A that is 0.5 % too small.
_BESIDE = 0.1
#: What a scan may state of which a calibration of an array makes nothing.
_UNCOUNTED = (
    "gain_curvature_uncertainty",
    "roundness_uncertainty",
    "line_offset_uncertainty",
    "baseline_curvature_uncertainty",
    "u_zz_correlation",
    "noise_record",
)
#: Presses whose covariances are held at once.
_PRESSES = 500


Failing = tuple[QualityCheck, IndexArray]
"""A check, and the numbers of the sensors that fail it."""


def array_checks(
    fit: JointFit, compared: JointFit, array: ArrayData, found: Sorted
) -> tuple[tuple[QualityCheck, ...], dict[str, tuple[str, ...]]]:
    """Check a fit, against one with own widths or shapes, or a common one; name failing sensors."""
    names = np.array(array.sensors)
    results = [*_of_all(array, found), *_of_fit(fit, compared, array)]
    failing = {one.name: tuple(names[numbers].tolist()) for one, numbers in results}
    return tuple(one for one, _ in results), failing


def _of_all(array: ArrayData, found: Sorted) -> Iterator[Failing]:
    dead = np.flatnonzero(found.dead)
    yield (
        check(
            "dead_taxels",
            dead.size,
            0.0,
            "Number of sensors whose peak is below 8 times the noise of their outermost readings. "
            "They are left out: look at their wiring, or press on them.",
        ),
        dead,
    )
    yield (
        check(
            "saturation",
            found.at_ceiling.sum(),
            0.0,
            "Number of readings at a ceiling. They are left out, the others of their sensors "
            "count: lower gain or load.",
        ),
        np.flatnonzero(found.at_ceiling),
    )
    places = array.places[array.used]
    pressed = np.stack([array.readings.x, array.readings.y], axis=1)
    margins = np.minimum(places - pressed.min(axis=0), pressed.max(axis=0) - places)
    along = np.ptp(pressed, axis=0) > 0
    short = _BEYOND - margins[:, along].min(axis=1) / array.film.thickness
    yield (
        check(
            "ends_covered",
            short.max(),
            _SHORT,
            f"Thicknesses of the film that the scan falls short of reaching {_BEYOND:g} of them "
            "beyond the last sensor. Baselines and tails of the outer sensors are then unsure: "
            "scan farther.",
        ),
        np.flatnonzero(array.used)[short > _SHORT],
    )
    if array.layout is not None and array.used.sum() > 2:
        yield _layout(array)


def _layout(array: ArrayData) -> Failing:
    """Compare the centres with the layout, shifted, turned and scaled; of a line along it."""
    from scipy.spatial.distance import pdist

    used = np.flatnonzero(array.used)
    assert array.layout is not None
    known = np.isfinite(array.centres[used]).all(axis=0)
    centres = np.where(known, array.centres[used], 0.0)
    layout = array.layout * known
    fitted, factor = fitted_layout(layout, centres, array.used)
    left = centres - (layout if abs(factor - 1) > _ALIKE else fitted)[used]
    left -= left.mean(axis=0)
    if array.layout_uncertainty is None:
        stated = _UNSTATED * pdist(centres).min()
    else:  # in another unit it is as much too large, or too small, as the layout
        stated = abs(factor) * array.layout_uncertainty
    variance = np.nanmean(array.centre_uncertainties[used] ** 2, axis=1) + stated**2
    squares = np.sum(left**2, axis=1) / variance
    # Of a single line all sensors are taken to be on it.
    turned, _ = fitted_layout(array.layout, array.places[used], array.used)
    beside = np.sum((turned - array.places)[used] ** 2, axis=1, where=~known)
    squares += beside / (stated**2 + (_BESIDE * array.gaussian_sigmas[used]) ** 2)
    axes = known.sum()
    degrees = int(axes) * (used.size - 2)
    return (
        added_check(
            "layout",
            squares.sum(),
            degrees,
            "Chi-square of the centres against the layout, which may be shifted, turned by up to "
            "30 degrees and scaled by up to 50 %. A failure means that sensors are elsewhere, or "
            "beside a single line, which needs a raster, or that names, units or axes of the "
            "layout are wrong.",
        ),
        used[squares > chdtri(axes, FALSE_ALARM / used.size)],
    )


def _of_fit(fit: JointFit, compared: JointFit, array: ArrayData) -> Iterator[Failing]:
    several = array.used.sum() > 1
    if array.estimated.any():
        yield _identified(fit, array.estimated)
    # With shapes of their own none is assumed to be common.
    if several and not fit.model.layout.own.size:
        yield _models_agree(fit, compared)
        yield _common_kernel(compared)
    yield _chi_square(fit, array)
    if several:
        yield _press_errors(fit)
        yield _common_mode(fit)


def _identified(fit: JointFit, near: BoolArray) -> Failing:
    places = fit.model.layout.crosstalk
    places = places[places >= 0]
    value = np.median(np.linalg.norm(fit.widest.root[places], axis=1))
    return (
        check(
            "crosstalk_identified",
            value,
            IDENTIFIED,
            "Median standard uncertainty of the crosstalk by the readings alone, whatever its "
            "spread. A failure means that crosstalk and the shape of G are one thing to this scan: "
            "it is left out of the table, and A has the uncertainty that this costs. Scan a "
            "raster, take a common shape, or a thinner film.",
        ),
        np.flatnonzero(near.any(axis=1) & (value > IDENTIFIED)),
    )


def _models_agree(fit: JointFit, compared: JointFit) -> Failing:
    """Compare A and crosstalk by common and by own shapes: of nested models, as Hausman's test."""
    used = np.flatnonzero(fit.model.presses.used)
    near = fit.model.layout.crosstalk >= 0
    both = []
    # How wide the prior of the crosstalk is may differ between them.
    for each in (fit.by_widest, compared.by_widest):
        root = each.posterior.root
        numbers = array_numbers(each, root)
        roots = np.vstack([numbers.of_a[used], root[each.model.layout.crosstalk[near]]])
        found = np.append(numbers.log_a[used], each.state.crosstalk[near])
        both.append([found, np.sum(roots**2, axis=1)])
    values, variances = np.moveaxis(np.array(both), 1, 0)
    # The variance of the difference is that of the variances, at least a share of the larger one.
    apart = np.maximum(np.ptp(variances, axis=0), _LEAST_APART * variances.max(axis=0))
    z = np.ptp(values, axis=0) / np.sqrt(apart)
    m = used.size
    return (
        check(
            "crosstalk_model",
            np.sqrt(np.mean(z**2)),
            _AGREEING,
            "Difference of A and crosstalk by a common G and by own widths, or shapes of a raster, "
            "over its uncertainty, root mean square. A failure means that the sensors' shapes "
            "differ: take own ones, of a raster.",
        ),
        used[z[:m] > chdtri(1, FALSE_ALARM / m) ** 0.5],
    )


def _common_kernel(own: JointFit) -> Failing:
    """Test whether widths differ, where the common shape is free."""
    used = np.flatnonzero(own.model.presses.used)
    places = own.model.layout.own[used]
    gram = own.information
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram / np.outer(scale, scale)
    # The readings were linearised before the last step, about shapes of the sensors' own.
    before = own.state.own[used] - own.posterior.change[places]
    moved = scaled[:, 1 + places.ravel()] @ (before * scale[1 + places]).ravel()
    data = scaled[:, 0] * scale[0] + moved
    widths = 1 + places[:, 0]
    rest = np.delete(np.arange(1, len(gram)), places)
    inverse = np.linalg.pinv(scaled[np.ix_(rest, rest)], rcond=1e-10, hermitian=True)
    explained = scaled[np.ix_(widths, rest)] @ inverse
    information = scaled[np.ix_(widths, widths)] - explained @ scaled[np.ix_(rest, widths)]
    data = data[widths] - explained @ data[rest]
    # A common width is one of the common shape.
    square = data @ np.linalg.pinv(information, rcond=1e-8, hermitian=True) @ data
    z = abs(own.state.own[used, 0]) / np.linalg.norm(own.posterior.root[places[:, 0]], axis=1)
    return (
        added_check(
            "common_kernel",
            square,
            used.size - 1,
            "Fall of chi-square by widths of the sensors' own, where the common shape is free. A "
            "failure means that one G does not describe all of them.",
        ),
        used[z > -ndtri(FALSE_ALARM / z.size)],
    )


def _chi_square(fit: JointFit, array: ArrayData) -> Failing:
    """Compare the residuals of each sensor with the noise: as stated, or between neighbours."""
    presses = fit.model.presses
    used = np.flatnonzero(array.used)
    keep = presses.keep[used]
    count = keep.sum(axis=1)
    square = fit.residual[used] ** 2
    if presses.stated is not None:
        errors = fit.model.press_errors(fit.state)[:, used]
        variance = presses.stated[used] ** 2 + np.sum(errors**2, axis=0)
        ratio = np.mean(square / variance, axis=1, where=keep)
    else:
        between = np.diff(fit.residual[used], axis=1) ** 2 / 2
        neighbours = keep[:, 1:] & keep[:, :-1]
        ratio = np.mean(square, axis=1, where=keep) / np.mean(between, axis=1, where=neighbours)
    # Of the ratio of the mean square to that of steps the variance is 1/n, of chi-square 2/n.
    spread = np.sqrt((1.0 if presses.stated is None else 2.0) / count)
    beyond = (ratio - 1) / spread
    most = -ndtri(FALSE_ALARM / used.size)
    worst = int(np.argmax(beyond))
    name = array.sensors[used[worst]]
    return (
        check(
            "array_chi_square",
            ratio[worst],
            1 + most * spread[worst],
            "Mean square of the residuals over the noise, as stated or as neighbouring readings "
            f"have it, of the worst sensor, {name}. A failure means that the model misses "
            "something: reference, crosstalk of farther pairs, drift, memory of the film.",
        ),
        used[beyond > most],
    )


def _press_errors(fit: JointFit) -> Failing:
    """Test whether readings of one press share errors of place and load that are not counted."""
    errors = fit.model.press_errors(fit.state)
    patterns = np.moveaxis(fit.model.by_press(fit.state), (0, 2), (2, 0))
    residual = fit.residual.T[:, :, None]
    weighted = np.empty(patterns.shape)
    for some in slices(len(patterns), _PRESSES):
        of_press = errors[..., some]
        covariance = fit.noise.covariance + np.einsum("cit,cjt->tij", of_press, of_press)
        weighted[some] = np.linalg.solve(covariance, patterns[some])
    size = np.sum(patterns * weighted, axis=1)
    explained = np.sum(residual * weighted, axis=1) ** 2 / np.where(size > 0, size, 1.0)
    ratios = explained.mean(axis=0)
    count = len(explained)
    return (
        check(
            "press_errors",
            ratios.max(),
            float(chdtri(count, FALSE_ALARM / 2)) / count,
            "What an error of place, or of load, common to all sensors explains of the residuals "
            "of a press, over what noise has it explain. A failure means that place or load "
            "scatters by more than is stated (x_errors, --position-error; "
            "normal_load_errors, --load-scatter).",
        ),
        np.flatnonzero([]),
    )


def _common_mode(fit: JointFit) -> Failing:
    """Test whether pairs of sensors have more, or less, noise in common than a board has."""
    keep = fit.model.presses.keep.astype(float)
    count = np.maximum(keep @ keep.T, 1)
    errors = fit.model.press_errors(fit.state)
    expected = fit.noise.covariance + np.sum(errors @ errors.mT, axis=0) / count
    scale = np.sqrt(np.diag(expected))
    apart = fit.residual @ fit.residual.T / count - expected
    z = abs(apart / np.outer(scale, scale)) * np.sqrt(count)
    np.fill_diagonal(z, 0.0)
    used = fit.model.presses.used.sum()
    limit = float(-ndtri(FALSE_ALARM / (used * (used - 1))))
    return (
        check(
            "common_mode",
            z.max(),
            limit,
            "Largest difference of the noise that two sensors have in common from that of their "
            "board, in standard deviations. A failure means that some share more: state their "
            "boards (a column board of the layout table), or look for presses that are wrong for "
            "several.",
        ),
        np.flatnonzero(z.max(axis=1) > limit),
    )


def array_messages(
    scan: Scan,
    prepared: Prepared,
    found: Sorted,
    fit: JointFit,
    failing: Mapping[str, Sequence[str]],
) -> Iterator[Message]:
    """Yield what a user has to know beside the checks."""
    yield from override_messages(prepared.overridden)
    numbers = fit.model.layout.crosstalk
    places = numbers[numbers >= 0]
    if found.dead.any():
        names = ", ".join(np.array(scan.sensors)[found.dead])
        # Of a sensor at an unknown place no crosstalk is fitted.
        lost = found.dead & ~fit.model.layout.near.any(axis=0)
        unread = (
            " What others read of them is not fitted: state a layout (--layout)."
            if lost.any() and places.size
            else ""
        )
        yield Message("dead_taxels", f"Dead and left out: {names}.{unread}", "warning")
    uncounted = [name for name in _UNCOUNTED if getattr(scan, name) is not None]
    if uncounted:
        text = f"Stated, but not counted of an array: {', '.join(uncounted)}."
        yield Message("not_counted", text, "warning")
    if places.size and not failing.get("crosstalk_identified"):
        values = fit.state.crosstalk[numbers >= 0]
        mean = float(values.mean())
        # Alike for all pairs it is seen by its mean; of a single pair by the whole.
        of_mean = float(np.linalg.norm(fit.posterior.root[places].mean(axis=0)))
        covariance = fit.widest.root[places] @ fit.widest.root[places].T
        square = float(values @ np.linalg.solve(covariance, values))
        by_mean = 2 * ndtr(-abs(mean) / of_mean)
        p_value = min(2 * min(chdtrc(places.size, square), by_mean), 1.0)
        yield Message(
            "crosstalk",
            f"Crosstalk is {percent(mean)} on the mean (u {percent(of_mean)}); without "
            f"any the probability of as much is p = {p_value:.2g}.",
        )
    stated = prepared.scans[0]
    yield from uncertainty_unstated_messages(
        {
            "load": stated.load_uncertainty,
            "thickness": stated.set_up.film.thickness_uncertainty,
            "radius": stated.set_up.indenter.radius_uncertainty,
        }
    )
    if scan.synthetic is not None:
        yield Message("synthetic", "The scan is synthetic: its truth is stored in it.")
