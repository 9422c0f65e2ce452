"""``memscal reference``."""

import numpy as np
import pytest

import memscal


@pytest.mark.parametrize("law", [["--strain", "finite"], ["--film-law", "neo-hookean"]])
def test_finite_strain_is_a_reference_like_any_other(run, folder, law):
    done = run("reference", "rod", "--load", 0.02, *law, "-o", "finite.h5").exits(0)
    assert "sticking (fem, neo-Hookean)" in done.out
    profile = memscal.read_reference("finite.h5")
    assert profile.solver == "memscal, fem backend, finite strain"
    assert (profile.film.law, profile.friction_coefficient) == ("neo-hookean", np.inf)
    assert profile.force == pytest.approx(0.02, rel=1e-3)
    assert "inf" in next(x for x in run("inspect", "finite.h5").out.splitlines() if "fricti" in x)


def test_small_strain_is_linear_whatever_the_law(run):
    own = run("reference", "rod", "--json").json["solutions"]
    law = ["--film-law", "neo-hookean", "--strain", "linear"]
    assert run("reference", "rod", *law, "--json").json["solutions"] == own
    assert (own[0]["strain"], own[0]["film_law"]) == ("linear", "linear")


@pytest.mark.parametrize("way", [["--backend", "fem", "--rings", 16], ["--strain", "finite"]])
def test_the_field_goes_to_a_mesh_that_can_be_imported(run, folder, way):
    run("reference", "sphere", "--load", 0.34, *way, "--mesh", "film.vtu", "-o", "film.h5").exits(0)
    units = ["--r-unit", "mm", "--sigma", "stress_Pa", "--sigma-unit", "Pa", "--load", 0.34]
    run("import", "film.vtu", "-o", "back.h5", "--format", "reference", *units).exits(0)
    written = memscal.read_reference("film.h5")
    imported = memscal.read_reference("back.h5")
    # A mesh holds stresses at its nodes, which are less accurate than the base's reaction.
    direct = np.interp(imported.r, written.r, written.sigma_zz)
    assert np.max(np.abs(imported.sigma_zz - direct)) < 1e-2 * written.sigma_zz.max()
