"""Measured stress is the pressed contact's, blurred, as far as its uncertainty says."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import scans as made
from helpers.bounds import FULL, root_mean_square_range
from scipy.linalg import toeplitz

import memscal
from memscal import SourceFile, StressSensor
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import DomainError, FitError, InputError
from memscal.measurement.measure_stress import joined_stress
from memscal.measurement.measured_profile import contact_signals, prepared_scan
from memscal.measurement.restore import restore_known, single_loads

QUIET = {"noise": 0.0, "load_scatter": 0.0, "position_error": 0.0}
SEEDS = 5 if FULL else 2
SENSOR = made.known_apparatus()
ENDS = made.LOADS[::3]


def blurred(load, r, friction=0.0):
    """The contact's base stress convolved with the Gaussian by its transform, in closed form."""
    nodes = Wavenumbers.covering(40 / made.EXACT_FILM.thickness, 30e-3)
    stress = made.pressed(load, friction).base_spectrum(nodes.k)
    return np.asarray(nodes.synthesise(stress * made.GAUSSIAN.transform(nodes.k), r))


def reduced(profile):
    """Chi-square of a profile against the truth by its full covariance, over its points."""
    off = profile.s_zz - blurred(profile.load, profile.r)
    return float(off @ np.linalg.solve(profile.covariance, off)) / off.size


def test_without_noise_the_profiles_are_the_calculated_ones():
    found = made.measured(**QUIET, state_noise=False)
    assert found.passed, found.messages
    assert [profile.load for profile in found.profiles] == list(made.LOADS)
    for profile in found.profiles:
        truth = blurred(profile.load, profile.r)
        np.testing.assert_allclose(profile.s_zz, truth, atol=4e-3 * truth.max())
        assert profile.maximum == pytest.approx(blurred(profile.load, np.zeros(1))[0], rel=4e-3)
        assert profile.centre[0] == pytest.approx(made.CENTRE, abs=2e-6)
        assert np.all(np.diff(profile.r) >= 0)


def test_the_stated_covariance_is_that_of_the_errors():
    values = [reduced(profile) for seed in range(SEEDS) for profile in made.measured(seed).profiles]
    # 33 points each; the scan's own baseline and centre take a few of them.
    assert np.mean(values) == pytest.approx(1.0, abs=4 * np.sqrt(2 / (33 * len(values))) + 0.12)


def test_the_maximum_and_the_force_have_the_errors_that_they_state():
    z = []
    for seed in range(SEEDS):
        for profile in made.measured(seed).profiles:
            truth = float(blurred(profile.load, np.zeros(1))[0])
            z.append((profile.maximum - truth) / profile.maximum_uncertainty)
            z.append((profile.force - profile.load) / profile.force_uncertainty)
    # The force's uncertainty allows for shapes that a sphere does not have.
    assert 0.3 < np.mean(np.square(z)) < 1 + 4 * np.sqrt(2 / len(z))


def test_an_uncertain_conversion_constant_is_common_to_all_points_and_to_the_maximum():
    exact = made.measured(3, load=ENDS)
    found = made.measured(3, conversion_uncertainty=0.02, load=ENDS)
    for before, after in zip(exact.profiles, found.profiles, strict=True):
        part = after.roots["conversion_constant"] @ after.roots["conversion_constant"].T
        np.testing.assert_allclose(part, 4e-4 * np.outer(after.s_zz, after.s_zz), rtol=1e-9)
        np.testing.assert_allclose(
            after.covariance - part, before.covariance, rtol=0.05, atol=1e-4 * part.max()
        )
        assert after.maximum_budget["apparatus"] == pytest.approx(0.02 * after.maximum, rel=0.02)


def test_a_width_of_g_that_is_wrong_by_what_is_stated_hardly_moves_the_maximum():
    scan = made.contact_scan(1, load=ENDS)
    right = memscal.measure_stress(scan, made.known_apparatus(width_uncertainty=0.05))
    kernel = memscal.GaussianMixture((1.0,), (1.05 * made.SIGMA,))
    wrong = memscal.measure_stress(scan, made.known_apparatus(kernel))
    for a, b in zip(right.profiles, wrong.profiles, strict=True):
        assert abs(a.maximum - b.maximum) < 0.005 * a.maximum
        assert a.maximum_budget["apparatus"] < 0.005 * a.maximum


def test_the_sources_of_the_place_share_their_joint_covariance_without_a_rest():
    parts = single_loads(made.contact_scan(2, load=ENDS))
    for profile, part in zip(made.measured(2, load=ENDS).profiles, parts, strict=True):
        [signal] = contact_signals([part], SENSOR)
        prepared = prepared_scan(part, SENSOR, signal)
        found = restore_known(prepared.scan, SENSOR)
        a = made.CONVERSION
        nodes = found.posterior.nodes
        sigma = found.posterior.covariance[nodes:, nodes:]
        # Columns by differences: a shifted centre moves every point on the blurred profile.
        step = 1e-6
        towards = np.sign(profile.x - profile.centre[0])
        above, below = (found.blurred_stress(profile.r + s) for s in (step, -step))
        slope = (above - below) / (2 * step) * towards
        xi = 2 * (profile.x - profile.x.min()) / np.ptp(profile.x) - 1
        columns = np.column_stack([slope, -np.ones_like(xi) / a, -xi / a])
        joint = columns @ sigma @ columns.T
        roots = np.hstack([profile.roots["centre"], profile.roots["baseline"]])
        np.testing.assert_allclose(roots @ roots.T, joint, atol=0.02 * np.abs(joint).max())


@pytest.mark.parametrize("friction", [0.0, 0.15, np.inf])
def test_recorded_loads_off_the_nominal_one_are_corrected(friction):
    """A contact that sticks follows its load by up to 40 % more than one that slides."""
    options = {**QUIET, "load_scatter": 0.03, "record_loads": True, "load_reading": 0.0}
    options["load"] = ENDS
    for profile in made.measured(4, **options, state_noise=False, friction=friction).profiles:
        truth = blurred(profile.load, profile.r, friction)
        np.testing.assert_allclose(profile.s_zz, truth, atol=2e-3 * truth.max())


def test_an_unstated_noise_is_told_from_the_scatter_of_the_loads():
    ratios = []
    for seed in range(SEEDS):
        scan = made.contact_scan(seed)
        found = memscal.measure_stress(replace(scan, u_zz_errors=None), SENSOR)
        truth = float(scan.u_zz_errors[0, 0])
        ratios += [float(p.points["zz"].noise.min()) / truth for p in found.profiles]
        names = {check.name.rpartition("_")[0] for check in found.checks}
        assert not names & {"chi_square", "noise_as_stated"}
    assert np.median(ratios) == pytest.approx(1.0, abs=0.15)
    assert 0.5 < min(ratios) <= max(ratios) < 1.7


def test_contacts_at_single_points_give_what_rows_give():
    scan = made.contact_scan(repeats=2, record_loads=True, load=ENDS)
    rows, points = (
        memscal.measure_stress(s, SENSOR).profiles for s in (scan, made.as_points(scan))
    )
    assert len(points) == len(rows) == len(ENDS)
    for one, other in zip(points, rows, strict=True):
        assert one.load == pytest.approx(other.load, rel=1e-12)
        assert one.force == pytest.approx(other.force, rel=1e-9)
        np.testing.assert_allclose(one.s_zz, other.s_zz, atol=1e-9 * other.maximum)


def test_correlated_noise_is_averaged_with_its_correlation():
    exact = {"load_scatter": 0.0, "load_reading": 0.0, "record_loads": False}
    scan = made.contact_scan(6, repeats=2, load=ENDS, **exact)
    near = toeplitz(0.4 ** np.arange(scan.x.size))
    scan = replace(scan, x_errors=None, u_zz_correlation=near)
    for profile in memscal.measure_stress(scan, SENSOR).profiles:
        points = profile.points["zz"]
        assert points.correlation is not None
        covariance = np.outer(points.weight, points.weight) ** -0.5 * points.correlation
        mean = (profile.x[:, None] == points.x) * points.weight
        mean /= mean.sum(axis=1, keepdims=True)
        expected = mean @ covariance @ mean.T
        found = profile.roots["noise"]
        found = found @ found.T
        np.testing.assert_allclose(found / found[0, 0], expected / expected[0, 0], atol=1e-9)


def test_files_of_many_points_grow_with_their_number(tmp_path):
    found = memscal.measure_stress(memscal.simulate(film=SENSOR.film, points=2000), SENSOR)
    found.save(tmp_path / "many.h5")
    found.plot().savefig(tmp_path / "many.svg")
    assert memscal.read_stress(tmp_path / "many.h5") == found
    # A matrix over the points would have 32 MB.
    assert (tmp_path / "many.h5").stat().st_size < 2_000_000
    assert (tmp_path / "many.svg").stat().st_size < 500_000


def test_a_rod_is_measured_like_a_sphere():
    z = []
    for seed in range(SEEDS):
        scan = memscal.simulate(film=SENSOR.film, seed=seed, points=33)
        [p] = memscal.measure_stress(scan, SENSOR).profiles
        z.append((p.force - 1.0) / p.force_uncertainty)
    low, high = root_mean_square_range(SEEDS, 1e-4) ** 2
    assert 0.4 * low < np.mean(np.square(z)) < high


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sensor": StressSensor(name="another", channel="zz")}, 'sensor +"another" +"a simulated'),
        (
            {"sensor": StressSensor(name="a simulated sensor", channel="xz")},
            'channel .* +"xz" +"zz"',
        ),
        ({"film": replace(made.EXACT_FILM, thickness=2.2e-3)}, r"thickness +2\.2 mm.* 2 mm"),
        ({"film": replace(made.EXACT_FILM, young_modulus=3e6)}, "Young's modulus +3 MPa.*2.2 MPa"),
        ({"film": replace(made.EXACT_FILM, poisson_ratio=0.45)}, "Poisson's ratio +0.45.*0.5"),
        ({"film": replace(made.EXACT_FILM, law="neo-hookean")}, 'law +"neo-hookean" +"linear"'),
    ],
)
def test_what_does_not_belong_together_is_refused_by_both_names(changes, words):
    scan = replace(made.contact_scan(load=(1.37,)), source=SourceFile("s.h5", ""), **changes)
    with pytest.raises(
        InputError,
        match=rf"not belong together:\n +quantity +the scan s.h5 +the artifact\n.*{words}",
    ):
        memscal.measure_stress(scan, replace(SENSOR, film=replace(made.EXACT_FILM, law="linear")))


def test_a_film_of_another_name_is_refused_unless_it_is_overridden():
    named = replace(SENSOR, film=replace(made.EXACT_FILM, name="film 1"))
    scan = replace(made.contact_scan(load=(1.37,)), film=replace(made.EXACT_FILM, name="film 2"))
    with pytest.raises(InputError, match=r'film +"film 2" +"film 1"'):
        memscal.measure_stress(scan, named)
    found = memscal.measure_stress(scan, named, override=True)
    assert len(found.overridden) == 1
    assert "film 2" in found.overridden[0]
    assert [m.severity for m in found.messages if m.kind == "override"] == ["warning"]
    assert found.process.configuration["override"] == list(found.overridden)


def spoilt(row, columns):
    scan = made.contact_scan()
    u = scan.u_zz.copy()
    u[row, columns] = np.nan
    return replace(scan, u_zz=u, source=SourceFile("gaps.h5", ""))


@pytest.mark.parametrize(
    ("row", "columns", "words"),
    [
        (1, slice(None), r"gaps\.h5, 0\.69 N, dry: all 33 points are missing"),
        (2, slice(12, 21), r"1\.37 N, dry: 9 neighbouring points .* -2 to 2 mm"),
    ],
)
def test_a_gap_of_a_contact_s_radius_is_refused_with_its_place(row, columns, words):
    with pytest.raises(InputError, match=words):
        memscal.measure_stress(spoilt(row, columns), SENSOR)


def test_a_few_missing_points_are_no_gap():
    found = memscal.measure_stress(spoilt(3, slice(14, 16)), SENSOR)
    assert found.profiles[3].r.size == 31
    assert any("2 points of the scan are missing" in message.text for message in found.messages)


def test_what_only_a_calibration_counts_is_named():
    scan = replace(made.contact_scan(load=(1.37,)), roundness_uncertainty=0.1, gain_uncertainty=0.1)
    found = memscal.measure_stress(scan, SENSOR)
    assert any(m.text.endswith("in a calibration only: roundness.") for m in found.messages)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_scan_that_never_comes_down_to_its_baseline_is_refused(friction):
    short = made.contact_scan(spacing=0.22e-3, friction=friction, load=(0.69, 2.75))
    with pytest.raises(FitError, match=r"0\.69 N, dry: the scan ends .* still has \d+% of its max"):
        memscal.measure_stress(short, SENSOR)


def test_a_scan_that_ends_on_one_side_of_the_contact_is_refused():
    with pytest.raises(FitError, match="the scan ends"):
        memscal.measure_stress(made.contact_scan(load=(2.75,), centre=(6e-3, 0.0)), SENSOR)


def test_a_load_beyond_the_model_is_refused_with_file_and_load():
    # Of several, the one that cannot be.
    scan = made.contact_scan(load=(0.34, 0.69))
    loads = np.where(np.arange(2)[:, None] == 1, 1e6, 1.0) * scan.normal_load
    heavy = replace(scan, normal_load=loads, source=SourceFile("heavy.h5", ""))
    with pytest.raises(DomainError, match=r"heavy\.h5, 6\.9e\+05 N, dry"):
        memscal.measure_stress(heavy, SENSOR)


@pytest.mark.parametrize("loads", [(1.37,), tuple(np.geomspace(0.05, 3.0, 8))])
def test_contacts_near_the_nominal_loads_are_those_of_converged_ones(loads):
    scan = made.contact_scan(load=loads)
    nodes = Wavenumbers.covering(20 / made.EXACT_FILM.thickness, 48e-3)
    transfer = made.CONVERSION * made.GAUSSIAN.transform(nodes.k)
    signals = contact_signals(single_loads(scan), SENSOR)
    assert len(signals) == len(loads)
    for load, signal in ((loads[0], signals[0]), (loads[-1], signals[-1])):
        for i, friction in enumerate((0.0, np.inf)):
            near = load * np.array([0.99, 1.0, 1.01])
            contacts = memscal.indent(made.EXACT_FILM, made.SPHERE, load=near, friction=friction)
            below, at, above = (
                nodes.synthesise(transfer * contact.base_spectrum(nodes.k), signal.r)
                for contact in contacts
            )
            np.testing.assert_allclose(signal.voltage[i], at, atol=2e-4 * at.max())
            by_load = (above - below) / 0.02
            np.testing.assert_allclose(signal.by_load[i], by_load, atol=1e-3 * by_load.max())


def test_stresses_measured_one_by_one_are_those_measured_together():
    dry = made.contact_scan(1, load=made.LOADS[:2])
    wet = made.contact_scan(2, load=made.LOADS[:1], lubrication="lubricated")
    together = memscal.measure_stress([dry, wet], SENSOR)
    joined = joined_stress([memscal.measure_stress(scan, SENSOR) for scan in (dry, wet)])
    assert joined.profiles == together.profiles
    assert joined.scans == together.scans
    assert joined.checks == together.checks
    other = memscal.measure_stress(wet, made.known_apparatus(conversion_uncertainty=0.01))
    with pytest.raises(InputError, match="digests differ"):
        joined_stress([joined, other])
    with pytest.raises(InputError, match="is given twice"):
        joined_stress([together, memscal.measure_stress(wet, SENSOR)])


def test_what_is_no_scan_is_refused():
    with pytest.raises(InputError, match="float is given where a Scan is needed"):
        memscal.measure_stress([1.0], SENSOR)
    with pytest.raises(InputError, match="no scan"):
        memscal.measure_stress([], SENSOR)
