"""Friction along a path: history, energy, unloading, and the two loadings."""

import math

import numpy as np
import pytest
from helpers.paper import FILM, SPHERE, film

from memscal import Rod, indent

R = np.linspace(0.0, 8e-3, 60)


def test_a_frictionless_contact_knows_no_history():
    path = indent(FILM, SPHERE, load=[1.0, 2.75, 0.3, 1.0])
    np.testing.assert_allclose(path[3].base_stress(R), path[0].base_stress(R), rtol=1e-9)
    assert path[3].depth == pytest.approx(path[0].depth, rel=1e-12)


def test_without_friction_both_loadings_are_one():
    slow, sudden = (indent(FILM, SPHERE, load=1.0, loading=way) for way in ("incremental", "total"))
    np.testing.assert_allclose(slow.base_stress(R), sudden.base_stress(R), rtol=1e-12)


def test_a_path_and_its_end_alone_are_one_contact():
    through = indent(FILM, SPHERE, load=[0.34, 0.69, 1.37], friction=0.3)[-1]
    straight = indent(FILM, SPHERE, load=1.37, friction=0.3)
    assert through.depth == pytest.approx(straight.depth, rel=5e-5)
    difference = np.max(np.abs(through.base_stress(R) - straight.base_stress(R)))
    assert difference < 1e-4 * straight.max_base_stress


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_what_sticks_gives_back_the_work_done(nu):
    for contact in indent(film(nu), SPHERE, load=[0.5, 2.0], friction=math.inf, rings=64):
        assert contact.dissipated_energy == 0
        assert contact.work == pytest.approx(contact.elastic_energy, rel=1e-3)


@pytest.mark.parametrize("nu", [0.3, 0.5])
@pytest.mark.parametrize("friction", [0.05, 0.2])
def test_work_is_stored_or_lost_to_friction(nu, friction):
    previous = 0.0
    for contact in indent(film(nu), SPHERE, load=[0.5, 2.0, 1.0, 2.0], friction=friction, rings=64):
        assert contact.work is not None
        assert contact.dissipated_energy > previous
        balance = contact.elastic_energy + contact.dissipated_energy
        assert contact.work == pytest.approx(balance, rel=2e-3)
        previous = contact.dissipated_energy


def test_a_sphere_that_sticks_unloads_along_the_way_it_came():
    up, top, down = indent(FILM, SPHERE, load=[1.0, 2.0, 1.0], friction=math.inf)
    assert top.load == pytest.approx(2.0)
    assert down.depth == pytest.approx(up.depth, rel=1e-4)
    assert np.max(np.abs(down.base_stress(R) - up.base_stress(R))) < 1e-3 * up.max_base_stress


def test_a_sphere_that_slips_remembers_where_it_has_been():
    up, _, down, _, again = indent(
        FILM, SPHERE, load=[0.5, 2.75, 0.5, 2.75, 0.5], friction=0.1, rings=48
    )
    assert abs(down.base_stress(0.0) / up.base_stress(0.0) - 1) > 5e-3
    # The second cycle retraces the first's way down.
    assert again.depth == pytest.approx(down.depth, rel=2e-3)


def test_shear_holds_the_film_in_while_loading_and_out_after_unloading():
    up, down = indent(FILM, SPHERE, load=[2.75, 1.0], friction=0.1)[:2]
    # The squeezed film slides outward under the indenter, which pulls it back; on the way up
    # it flows back, and near the edge the pull turns around.
    assert up.interface_shear(0.8 * up.contact_radius) < 0
    assert down.interface_shear(0.95 * down.contact_radius) > 0


def test_a_film_that_sticks_at_once_has_not_moved_sideways():
    total = indent(FILM, SPHERE, load=1.37, friction=math.inf, loading="total", rings=96)
    slow = indent(FILM, SPHERE, load=1.37, friction=math.inf, rings=96)
    r = np.linspace(0.0, 0.98, 60) * total.contact_radius
    scale = float(np.max(np.abs(slow.surface_outward(r))))
    assert np.max(np.abs(total.surface_outward(r))) < 1e-2 * scale
    assert total.depth < slow.depth


def test_a_rod_slips_in_proportion_while_it_is_loaded():
    rod = Rod(radius=0.5e-3)
    half, whole, back = indent(film(0.3), rod, load=[0.1, 0.2, 0.1], friction=0.2)
    assert whole.depth == pytest.approx(2 * half.depth, rel=1e-4)
    assert whole.stick_radius == pytest.approx(half.stick_radius, rel=1e-6)
    # On the way back a part sticks that had slipped: less is given back than was put in.
    assert back.depth > half.depth * 1.0001
    assert back.work > half.work


def test_asking_for_the_same_load_again_moves_nothing():
    once, again = indent(FILM, SPHERE, load=[1.0, 1.0], friction=0.2)
    for name in ("depth", "stick_radius", "steps"):
        assert getattr(again, name) == getattr(once, name)
