"""Print the table of the paper's sphere of docs/sphere.md, and that for a Poisson's ratio of 0.495.

Run it where memscal is installed: ``python docs/sphere_table.py``.
"""

from __future__ import annotations

import math
import sys

import memscal

LOADS = (0.34, 0.69, 1.37, 2.75)
FRICTIONS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 1.0, 1.6, math.inf)
LOADINGS = ("incremental", "total")
HEAD = (
    "| P (N) | μ | depth (µm) | contact radius (mm) | interface (kPa) | base (kPa) |",
    "|---:|---:|---:|---:|---:|---:|",
)


def table(poisson_ratio: float, frictions: tuple[float, ...] = FRICTIONS) -> list[str]:
    """Return the rows for one film, both loadings in each cell."""
    film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=poisson_ratio, thickness=2e-3)
    sphere = memscal.Sphere(radius=128.8e-3)
    contacts = {
        (friction, loading): memscal.indent(
            film, sphere, load=LOADS, friction=friction, loading=loading
        )
        for friction in frictions
        for loading in LOADINGS
    }
    rows = list(HEAD)
    for i, load in enumerate(LOADS):
        for friction in frictions:
            pair = [contacts[friction, loading][i] for loading in LOADINGS]
            cells = (
                f"{load:g}",
                "∞" if math.isinf(friction) else f"{friction:g}",
                " / ".join(f"{contact.depth * 1e6:.2f}" for contact in pair),
                " / ".join(f"{contact.contact_radius * 1e3:.3f}" for contact in pair),
                " / ".join(f"{contact.max_interface_stress * 1e-3:.2f}" for contact in pair),
                " / ".join(f"{contact.max_base_stress * 1e-3:.2f}" for contact in pair),
            )
            rows.append("| " + " | ".join(cells) + " |")
    return rows


if __name__ == "__main__":
    for ratio in (0.5, 0.495):
        sys.stdout.write("\n".join([f"### ν = {ratio}", "", *table(ratio), "", ""]))
