"""Laws of the interface weighed by what was calculated: each is found where it is the truth."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.interface_points import (
    LOADS,
    MACROSCOPIC,
    PAPER,
    PRECISE,
    amontons,
    measured,
    read_without_error,
    sensor,
    slipping,
    yielding,
)

from memscal.errors import InputError
from memscal.extensions.interface_laws.model_comparison import (
    WIDENED,
    compare_interface,
    weigh_normal_compliance,
    weigh_slip_length,
)
from memscal.friction.family import bounded
from memscal.friction.likelihood import likelihood


@lru_cache
def weighed(truth, value, precision=PRECISE):
    family = {"rigid": amontons, "slipping": slipping}[truth]()
    points = read_without_error(family, value, precision)
    return weigh_slip_length(
        measured(points, amontons()), measured(points, slipping()), macroscopic=MACROSCOPIC
    )


def relative_uncertainty(length, precision):
    """Return what the likelihood's slope tells about a slip length, everything else free."""
    family = slipping()
    points = read_without_error(family, length, precision)
    curve = likelihood(measured(points, family).at(length))
    t = bounded(length, family.scale)
    return float(1 / np.sqrt(curve.slope_fit()[0][0])) / (t * (1 - t))


@pytest.mark.parametrize("length", [7e-6, 50e-6])
def test_a_slip_length_is_found_where_it_is_the_truth(length):
    found = weighed("slipping", length)
    assert found.yielding_preferred
    assert all(factor.favoured == found.laws[-1].name for factor in found.factors)
    assert found.length.value == pytest.approx(length, rel=0.05)
    assert found.length.interval.holds(length)
    assert found.laws[-1].least == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("friction", [0.1, 0.2])
def test_an_effective_coefficient_is_found_where_it_is_the_truth(friction):
    found = weighed("rigid", friction)
    assert not found.yielding_preferred
    one, each, slip = found.laws
    assert one.log_evidence > each.log_evidence > slip.log_evidence
    assert one.best[0] == pytest.approx(friction, abs=0.01)
    assert each.best == pytest.approx([friction] * len(LOADS), abs=0.02)


@pytest.mark.parametrize(
    ("compared", "bound"),
    [
        (lambda: weighed("rigid", math.inf), 5e-6),
        (lambda: normal(yielding(), 0.0), math.inf),
    ],
)
def test_a_rigid_interface_gives_an_upper_bound_of_the_length(compared, bound):
    found = compared()
    assert not found.yielding_preferred
    assert found.length.value is None
    assert found.length.interval.low == 0
    assert 0 < found.length.interval.high < bound
    assert "upper bound" in found.length.reason


def test_without_friction_a_slip_length_has_no_upper_bound():
    found = weighed("rigid", 0.0)
    assert found.length.value is None
    assert found.length.interval.high is None
    assert "lower bound" in found.length.reason


def test_the_effective_coefficient_that_a_slip_length_means_grows_with_the_load():
    implied = weighed("slipping", 16e-6).implied
    assert np.all(np.diff(implied.friction, axis=0) > 0)
    # A longer slip length means less friction.
    assert np.all(np.diff(implied.friction, axis=1) < 0)
    # A rigid interface of that friction gives the same stress on the axis.
    gauge = sensor(amontons())
    for load, friction in enumerate(implied.friction[:, 1]):
        rigid = amontons().at(friction).spectra[0, load]
        yields = slipping().at(weighed("slipping", 16e-6).length.best).spectra[0, load]
        on_axis = [
            float(amontons().wavenumbers.synthesise(gauge.transfer * own, np.array(0.0)))
            for own in (rigid, yields)
        ]
        assert on_axis[0] == pytest.approx(on_axis[1], rel=1e-4)


def test_the_stiffness_is_friction_times_mean_pressure_over_the_slip_length():
    found = weighed("slipping", 16e-6)
    implied = found.implied
    length = found.length.value
    radii = [
        float(np.interp(bounded(length, slipping().scale), slipping().coordinates, r))
        for r in slipping().contact_radii.T
    ]
    pressure = np.array(LOADS) / (np.pi * np.array(radii) ** 2)
    assert implied.pressures == pytest.approx(pressure)
    assert implied.stiffnesses[:, 1] == pytest.approx(MACROSCOPIC * pressure / length)


@pytest.mark.parametrize(
    ("length", "precision", "expected"),
    [
        (4e-6, PAPER, 0.63),
        (16e-6, PAPER, 0.47),
        (4e-6, PRECISE, 0.20),
        (16e-6, PRECISE, 0.095),
        (40e-6, PRECISE, 0.083),
    ],
)
def test_how_well_a_slip_length_can_be_known_is_what_the_documentation_says(
    length, precision, expected
):
    assert relative_uncertainty(length, precision) == pytest.approx(expected, rel=0.15)


def test_the_papers_slip_length_cannot_be_known_to_a_fifth_from_data_like_the_papers():
    assert relative_uncertainty(1.82e-6, PAPER) > 0.7
    assert relative_uncertainty(1.82e-6, PRECISE) > 0.2


def test_the_interval_is_as_wide_as_the_slope_of_the_likelihood_says():
    found = weighed("slipping", 16e-6).length
    assert found.standard_uncertainty is not None
    # The interval is widened, for contacts that are linearised about the stated film.
    expected = WIDENED * relative_uncertainty(16e-6, PRECISE) * 16e-6
    assert found.standard_uncertainty == pytest.approx(expected, rel=0.15)


def test_an_uncertain_macroscopic_coefficient_makes_the_slip_length_as_uncertain():
    # Where nothing slips the law knows friction over slip length only: a change of one by a
    # tenth is undone by a change of the other.
    exact = slipping()
    t = exact.coordinates[:, None, None]
    change = -0.1 * t * (1 - t) * exact.by_coordinate
    doubtful = replace(exact, changes={**exact.changes, "macroscopic_friction": change})
    points = read_without_error(exact, 16e-6, PRECISE)
    found = weigh_slip_length(
        measured(points, amontons()), measured(points, doubtful), macroscopic=MACROSCOPIC
    ).length
    assert found.standard_uncertainty is not None
    alone = weighed("slipping", 16e-6).length.standard_uncertainty
    assert found.standard_uncertainty == pytest.approx(math.hypot(alone, WIDENED * 1.6e-6), rel=0.1)


def normal(truth, value):
    return weigh_normal_compliance(measured(read_without_error(truth, value, PRECISE), yielding()))


def test_a_normal_compliance_is_found_where_it_is_the_truth():
    found = normal(yielding(), 2e-6)
    assert found.yielding_preferred
    assert found.length.value == pytest.approx(2e-6, rel=0.05)


def test_nothing_measured_is_refused():
    with pytest.raises(InputError, match="measured profiles, but none"):
        compare_interface([], None, macroscopic=1.6)


def test_a_law_is_preferred_only_if_its_likelihood_speaks_for_it_too():
    found = weighed("slipping", 16e-6)
    one = found.factors[0]
    ratio = found.laws[-1].log_likelihood - found.laws[0].log_likelihood
    assert one.log_likelihood_ratio == pytest.approx(ratio)
    less = replace(found.laws[-1], log_likelihood=found.laws[0].log_likelihood - 1)
    assert not replace(found, laws=(*found.laws[:-1], less)).yielding_preferred
