"""Points: what is left out is counted, and what cannot be calibrated is refused plainly."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import simulated, with_outlier
from scipy.linalg import toeplitz

from memscal.errors import InputError
from memscal.estimation.points import measured_points, scans_by_load


def test_missing_voltages_and_loads_are_left_out_and_counted():
    scan = simulated(load=[0.5, 1.0], points=21)
    u = scan.u_zz.copy()
    load = np.array(scan.normal_load)
    u[0, 3] = np.nan
    load[1, 7] = np.nan
    points = measured_points(replace(scan, u_zz=u, normal_load=load))
    assert points.missing == 2
    assert points.u.size == 2 * 21 - 2
    assert np.isfinite(points.u).all()
    assert np.isfinite(points.load).all()


def test_repeats_at_loads_of_their_own_become_scans_and_keep_their_readings():
    one = simulated(load=1.0, repeats=2, points=11)
    several = replace(simulated(load=[1.0, 0.3, 1.01], points=11), load_uncertainty=0.01)
    split, owners = scans_by_load([one, several])
    assert owners == (0, 1, 1)
    assert split[0] is one
    assert [scan.load for scan in split[1:]] == pytest.approx([0.3, 1.005])
    assert np.array_equal(split[2].u_zz, several.u_zz[[0, 2]])
    assert np.array_equal(split[1].u_zz, several.u_zz[1:2])
    assert split[1].load_uncertainty == pytest.approx(0.01 * 0.3 / several.load)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: {"u_zz": np.full_like(s.u_zz, np.nan)}, "missing"),
        (lambda s: {"u_zz": -s.u_zz}, "positive in compression"),
        (lambda s: {"u_zz": np.full_like(s.u_zz, 2.0)}, "Every voltage"),
        (lambda s: {"u_zz_errors": np.zeros_like(s.u_zz)}, "zero"),
        (lambda s: {"normal_load": np.zeros_like(s.u_zz)}, "above zero"),
    ],
)
def test_a_scan_that_cannot_be_calibrated_is_refused_with_its_reason(change, words):
    scan = simulated()
    with pytest.raises(InputError, match=words):
        measured_points(replace(scan, **change(scan)))


def test_a_negative_outlier_is_no_wrong_sign():
    assert measured_points(with_outlier(simulated(), 5, -10.0)).u.size == 65


@pytest.mark.parametrize("correlation", [0.0, 0.4])
@pytest.mark.parametrize("anew", [False, True])
def test_repeats_share_the_error_of_their_position(anew, correlation):
    scan = simulated(repeats=3, points=9)
    near = toeplitz(correlation ** np.arange(9))
    scan = replace(
        scan,
        x_errors=np.full(9, 10e-6),
        position_errors_by_repeat=anew,
        u_zz_correlation=near if correlation else None,
    )
    points = measured_points(scan)
    moved = np.tile(np.linspace(-2.0, 2.0, 9), 3) * points.u_errors
    stated = 1 / (points.u_errors**2 + moved**2)
    shared = points.sharing_positions(moved, stated)
    of_repeat = np.kron(np.eye(3), near)
    together = np.eye(27) if anew else np.tile(np.eye(9), (3, 3))
    covariance = np.outer(points.u_errors, points.u_errors) * of_repeat
    if not (anew and correlation):
        covariance = covariance + np.outer(moved, moved) * together
        root = np.linalg.cholesky(covariance)
        white = shared.standardised(root, stated)
        np.testing.assert_allclose(white @ white.T, np.eye(27), atol=1e-9)
    if not anew:
        assert shared.decorrelation is not None
        again = shared.decorrelation.correlate(shared.decorrelation.apply(root))
        np.testing.assert_allclose(again, root, atol=1e-12)
