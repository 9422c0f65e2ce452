"""Synthetic experiments: what their files state, what was really there, and what was drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.rounding import assert_same_to_rounding
from scipy.stats import chi2

import memscal
from memscal.errors import InputError
from memscal.simulation.contact_scan import PAPER_SPHERE, simulate_contacts
from memscal.simulation.experiment import Reality, drawn
from memscal.simulation.rod_scan import PAPER_FILM, PAPER_ROD

RARE = 1e-9
"""Probability with which a correct program would fail one of the random tests here."""

FEW: dict[str, Any] = {"loads": [0.69], "lubricated_loads": [0.69], "points": 9, "spacing": 2e-3}
STILL: dict[str, Any] = {
    "noise": 0.0, "baseline": 0.0, "drift": 0.0, "load_scatter": 0.0, "position_error": 0.0,
}  # fmt: skip
NOMINAL = Reality(film=PAPER_FILM, rod=PAPER_ROD, sphere=PAPER_SPHERE)


def truth(scan: memscal.Scan) -> dict[str, Any]:
    assert scan.synthetic is not None
    return dict(scan.synthetic)


def test_an_experiment_is_a_calibration_and_contacts_dry_and_lubricated() -> None:
    found = memscal.simulate_experiment()
    assert list(found.scans) == ["rod_scan", "sphere_dry", "sphere_lubricated"]
    assert [scan.indenter.shape for scan in found.scans.values()] == ["rod", "sphere", "sphere"]
    assert [scan.lubrication for scan in found.scans.values()] == ["", "dry", "lubricated"]
    assert (found.dry.u_zz.shape, found.lubricated.u_zz.shape) == ((4, 33), (2, 33))
    assert (truth(found.dry)["friction"], truth(found.lubricated)["friction"]) == (0.2, 0.0)
    for scan in found.scans.values():
        assert scan.sensor == found.rod.sensor
        assert scan.film is PAPER_FILM
        assert "synthetic" in scan.title.lower()
        assert truth(scan)["gaussian_sigma"] == 561e-6
        assert truth(scan)["seed"] == 0


def test_another_load_of_one_scan_changes_no_number_of_another() -> None:
    less = memscal.simulate_experiment(**FEW, seed=8)
    more = memscal.simulate_experiment(**FEW | {"loads": [0.34, 0.69], "repeats": 1}, seed=8)
    assert_same_to_rounding(less.rod.u_zz, more.rod.u_zz)
    assert_same_to_rounding(less.lubricated.u_zz, more.lubricated.u_zz)
    assert less.dry.u_zz.shape != more.dry.u_zz.shape


def test_the_scans_of_one_seed_share_no_noise() -> None:
    options = {**FEW, "friction": 0.0, "load_scatter": 0.0, "position_error": 0.0}
    noisy = memscal.simulate_experiment(**options, noise=0.01)
    still = memscal.simulate_experiment(**options, noise=0.0)
    dry, lubricated = (
        getattr(noisy, name).u_zz - getattr(still, name).u_zz for name in ("dry", "lubricated")
    )
    np.testing.assert_allclose(still.dry.u_zz, still.lubricated.u_zz, rtol=1e-12)
    assert np.abs(dry - lubricated).min() > 0
    again = memscal.simulate_experiment(**options, noise=0.01, seed=1)
    assert np.abs(again.dry.u_zz - noisy.dry.u_zz).min() > 0


def test_what_is_drawn_scatters_as_it_is_stated() -> None:
    draws = [drawn(NOMINAL, 0.01, seed) for seed in range(2000)]
    film = PAPER_FILM
    sampled = {
        "modulus": [(d.film.young_modulus - 2.2e6) / film.young_modulus_uncertainty for d in draws],
        "ratio": [(d.film.poisson_ratio - 0.5) / film.poisson_ratio_uncertainty for d in draws],
        "thickness": [(d.film.thickness - 2e-3) / film.thickness_uncertainty for d in draws],
        "rod": [(d.rod.radius - 0.25e-3) / PAPER_ROD.radius_uncertainty for d in draws],
        "sphere": [(d.sphere.radius - 0.1288) / PAPER_SPHERE.radius_uncertainty for d in draws],
        "rod load": [(d.rod_load_scale - 1) / 0.01 for d in draws],
        "load": [(d.load_scale - 1) / 0.01 for d in draws],
    }
    low, high = chi2.ppf([RARE, 1 - RARE], len(draws))
    for name, values in sampled.items():
        assert low < np.sum(np.square(values)) < high, name
    assert max(sampled["ratio"]) <= 0
    own = np.array([values for name, values in sampled.items() if name != "ratio"])
    assert np.all(np.abs(own.mean(axis=1)) < 6 / np.sqrt(len(draws)))
    between = np.corrcoef(own) - np.eye(len(own))
    assert np.abs(between).max() < 6 / np.sqrt(len(draws))


def test_the_files_state_the_nominal_values_and_the_voltages_are_of_the_true_ones() -> None:
    found = memscal.simulate_experiment(**FEW, **STILL, draw_inputs=True, seed=3)
    told, rod = truth(found.dry), truth(found.rod)
    for name in ("young_modulus", "poisson_ratio", "thickness"):
        assert told[name] == rod[name] != getattr(PAPER_FILM, name)
        assert getattr(found.dry.film, name) == getattr(PAPER_FILM, name)
    assert (found.dry.indenter, found.rod.indenter) == (PAPER_SPHERE, PAPER_ROD)
    assert (found.dry.load, found.rod.load) == (0.69, 1.0)
    assert found.rod.load_uncertainty == pytest.approx(0.01)
    assert told["load_1"] == pytest.approx(0.69 * told["load_scale"])
    film = replace(
        PAPER_FILM, **{n: told[n] for n in ("young_modulus", "poisson_ratio", "thickness")}
    )
    sphere = memscal.Sphere(radius=told["indenter_radius"])
    again = simulate_contacts(
        film=film, sphere=sphere, load=[told["load_1"]], friction=0.2, points=9, spacing=2e-3,
        **STILL,
    )  # fmt: skip
    np.testing.assert_allclose(found.dry.u_zz, again.u_zz, rtol=1e-9)
    pressed = memscal.simulate(
        film=film, rod=memscal.Rod(radius=rod["indenter_radius"]), load=rod["load_1"],
        noise=0.0, baseline=0.0, drift=0.0,
    )  # fmt: skip
    np.testing.assert_allclose(found.rod.u_zz, pressed.u_zz, rtol=1e-12)


def test_a_gain_is_on_the_contacts_only() -> None:
    right, wrong = (memscal.simulate_experiment(**FEW, **STILL, gain=g) for g in (1.0, 1.05))
    assert_same_to_rounding(right.rod.u_zz, wrong.rod.u_zz)
    np.testing.assert_allclose(wrong.dry.u_zz, 1.05 * right.dry.u_zz, rtol=1e-12)
    np.testing.assert_allclose(wrong.lubricated.u_zz, 1.05 * right.lubricated.u_zz, rtol=1e-12)
    assert [truth(scan)["gain"] for scan in wrong.scans.values()] == [1.0, 1.05, 1.05]
    assert {truth(scan)["conversion_constant"] for scan in wrong.scans.values()} == {1e-7}


def test_a_thicker_film_than_is_stated_is_under_all_indenters() -> None:
    wrong = memscal.simulate_experiment(**FEW, **STILL, thickness_factor=1.05)
    thick = replace(PAPER_FILM, thickness=2.1e-3)
    right = memscal.simulate_experiment(**FEW, **STILL, film=thick)
    for one, other in zip(wrong.scans.values(), right.scans.values(), strict=True):
        np.testing.assert_allclose(one.u_zz, other.u_zz, rtol=1e-12)
        assert (one.film.thickness, truth(one)["thickness"]) == (2e-3, pytest.approx(2.1e-3))


def test_a_lubricated_contact_keeps_the_normal_compliance_of_its_surface() -> None:
    law = memscal.Interface(
        normal=memscal.ExponentialCompliance(decay_length=1e-6, reference_pressure=1e6),
        slip_length=2e-6,
    )
    found = memscal.simulate_experiment(**FEW, load_scatter=0.0, friction=0.3, interface=law)
    dry, lubricated = truth(found.dry), truth(found.lubricated)
    assert (dry["slip_length"], dry["decay_length"]) == (2e-6, 1e-6)
    assert "slip_length" not in lubricated
    assert lubricated["decay_length"] == 1e-6


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"gain": 0.0}, "gain is 0"),
        ({"thickness_factor": -1.0}, "thickness_factor"),
        ({"load_uncertainty": -0.1}, "uncertainty of the load"),
        ({"seed": -1}, "seed is -1"),
        ({"loads": []}, "list of loads is empty"),
        ({"rod_load": 0.0}, "load"),
        ({"repeats": 0}, "one row"),
    ],
)
def test_an_experiment_that_cannot_be_made_is_refused(
    options: dict[str, Any], problem: str
) -> None:
    with pytest.raises(InputError, match=problem):
        memscal.simulate_experiment(**{**FEW, **options})
