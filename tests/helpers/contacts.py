"""Contact scans of the paper's sphere at several loads, and what is measured of them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from helpers.scans import EXACT_FILM
from helpers.spheres import SPHERE, known_apparatus

import memscal
from memscal.model.measured_stress import MeasuredStress
from memscal.model.scan import Scan
from memscal.simulation.contact_scan import simulate_contacts

LOADS = (0.34, 0.69, 1.37, 2.75)
CENTRE = 0.14e-3


def contact_scan(seed: int = 0, **options: Any) -> Scan:
    """Scan contacts on an exactly known film, at exactly known nominal loads."""
    exact = {"film": EXACT_FILM, "sphere": SPHERE, "load": LOADS, "load_uncertainty": None}
    return simulate_contacts(seed=seed, **(exact | options))


@lru_cache
def measured(seed: int = 0, conversion_uncertainty: float = 0.0, **options: Any) -> MeasuredStress:
    """Measure such a scan with a sensor whose G is known."""
    known = known_apparatus(conversion_uncertainty=conversion_uncertainty)
    return memscal.measure_stress(contact_scan(seed, **options), known)
