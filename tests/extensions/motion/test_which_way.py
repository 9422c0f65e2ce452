"""Which way a sliding indenter's stress passes the sensor: what is ahead of it comes first."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.outside import FILM, SIGMA
from helpers.outside_sphere import SPHERE
from helpers.scans import CONVERSION, SENSOR, known_apparatus
from scipy.ndimage import gaussian_filter

import memscal

pytest.importorskip("memscal.extensions.motion.compare_sliding")

FRICTION = 0.3
LOAD = 1.37
STEP = 0.05e-3
X = STEP * np.arange(-200, 201)


def readings():
    """What a sensor at x = 0 reads of the indenter at X, forth and back, in V.

    A place that is ahead of the indenter by xi lies at X + d xi: the sensor, at zero, at xi = -d X.
    """
    contact = memscal.slide(FILM, SPHERE, load=LOAD, friction=FRICTION)
    across = STEP * np.arange(-60, 61)
    ahead = -X
    stress = contact.base_stress(ahead[:, None], across)
    forth = gaussian_filter(CONVERSION * stress, SIGMA / STEP)[:, 60]
    assert X[forth.argmax()] == pytest.approx(-0.45e-3, abs=0.1e-3)
    return np.stack([forth, forth[::-1]])


@pytest.mark.parametrize("backlash", [5e-6, None])
def test_friction_is_found_where_the_sensor_meets_the_front_of_the_contact_first(backlash):
    u = readings()
    noise = 0.002 * u.max()
    scan = memscal.Scan(
        x=X,
        u_zz=u + noise * np.random.default_rng(1).standard_normal(u.shape),
        u_zz_errors=np.full(u.shape, noise),
        sliding_direction=np.array([1, -1]),
        motion="sliding",
        load=LOAD,
        film=replace(FILM, law="linear"),
        indenter=SPHERE,
        sensor=SENSOR,
    )
    found = memscal.compare(
        scan, known_apparatus(conversion_uncertainty=0.01), sliding=True, backlash=backlash
    )
    (state,) = found.joint
    assert found.joint[state]["sliding"].value == pytest.approx(FRICTION, abs=0.02)
