"""Speed of families of profiles: kept against calculated, as a ratio on the same machine."""

from __future__ import annotations

from pathlib import Path
from statistics import median

import pytest
from helpers.timing import once, show

from memscal.friction.calculated import amontons_family
from memscal.friction.family import ProfileFamily
from memscal.mechanics.solver.refinement import solve_on_rings
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere

FILM = ElasticFilm(
    young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3, thickness_uncertainty=2e-5
)
SPHERE = Sphere(radius=128.8e-3)


def family(cache: Path | None) -> ProfileFamily:
    solve_on_rings.cache_clear()
    return amontons_family(
        FILM, SPHERE, [0.34, 2.75], friction=[0.0, 0.3], reach=12e-3, cache=cache
    )


@pytest.mark.benchmark
def test_a_kept_family_is_read_ten_times_faster_than_it_is_calculated(tmp_path: Path) -> None:
    family(tmp_path)
    pairs = [(once(lambda: family(None)), once(lambda: family(tmp_path))) for _ in range(3)]
    ratio = median(kept / calculated for calculated, kept in pairs)
    show("kept family, over a calculated one", ratio, 1 / 10)
