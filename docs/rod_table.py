"""Make the table of rods at finite strain: ``python docs/rod_table.py FOLDER [PROCESSES]``.

A file for each column of depths is kept in the folder, so that the script can be stopped and run
again; when all are there it joins them in the package.  It takes some 30 minutes on two cores.
"""

from __future__ import annotations

import itertools
import sys
from multiprocessing import Pool
from pathlib import Path

import numpy as np

import memscal
from memscal.extensions.finite_strain.solve import Request
from memscal.mechanics.solver.step import Depth
from memscal.mechanics.tabulated_rod import FILE

POISSON = (0.45, 0.475, 0.49, 0.5)
RADII = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.36, 0.44, 0.52, 0.6)  # over the thickness
DEPTHS = (0.005, 0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.13, 0.16, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45)
# A film that slides is drawn out from under the rod: deeper ones are not solved for all radii.
DEEPEST = {"sticking": 0.45, "sliding": 0.16}
# Where a film that sticks comes to lie depends on the length of a step and on the elements at the
# edge: together they change the stiffness by 4e-3.  Deep below a thin rod the film is stretched to
# eight times its length, and needs fine elements there too.
STEP, SHORTEST = 0.03, 0.004  # over the radius, but no shorter than this over the thickness
FINER, FINER_BELOW_THIN, THIN = (2.0, 1.0), (1.5, 3.5), 0.14
KH = np.linspace(0.0, 20.0, 81)
# The table is dimensionless.
THICKNESS, MODULUS = 2e-3, 1e6

Key = tuple[str, float, float]


def column_file(folder: Path, key: Key) -> Path:
    """Return the file of one column: whether it sticks, Poisson's ratio, radius."""
    return folder / "{}_{:g}_{:g}.npz".format(*key)


def make_column(job: tuple[Path, Key]) -> None:
    """Solve a rod at all depths, as far as it goes; keep P/(G h^2) and spectra over the load."""
    folder, key = job
    if column_file(folder, key).exists():
        return
    friction, poisson, radius = key
    film = memscal.ElasticFilm(
        young_modulus=MODULUS, poisson_ratio=poisson, thickness=THICKNESS, law="neo-hookean"
    )
    rod, k = memscal.Rod(radius=radius * THICKNESS), KH / THICKNESS
    sticking, rows = friction == "sticking", []
    depths = [depth for depth in DEPTHS if depth <= DEEPEST[friction]]
    way, finer = depths, (1.0, 1.0)
    if sticking:
        way = steps_to(depths, max(STEP * radius, SHORTEST))
        finer = FINER_BELOW_THIN if radius <= THIN else FINER
    # In mm, on a film of 12.5 thicknesses, as far as it goes.
    goals = [Depth(1e3 * depth * THICKNESS) for depth in way]
    contacts = Request(film, rod, goals, sticking, 12.5e3 * THICKNESS, None, finer).reached(1.0)
    for depth, contact in zip(way, contacts, strict=False):
        if depth not in depths:
            continue
        load = contact.load / (film.shear_modulus * THICKNESS**2)
        spectra = contact.base_spectrum(k), contact.base_shear_spectrum(k)
        rows.append(np.concatenate([[load], *(s / contact.load for s in spectra)]))
        sys.stdout.write(f"{column_file(folder, key).stem}: {depth:.3f} h, {contact.steps} steps\n")
    np.savez(column_file(folder, key), rows=np.array(rows))


def steps_to(depths: list[float], longest: float) -> list[float]:
    """Return the depths and others between them, so that no step is longer."""
    way: list[float] = []
    for begin, end in itertools.pairwise([0.0, *depths]):
        way += [*np.linspace(begin, end, int(np.ceil((end - begin) / longest)) + 1)[1:-1], end]
    return way


def start_of_column(poisson: float, radius: float, *, sticking: bool) -> np.ndarray:
    """Return P/(G h d) and spectra at no depth: the flat end alone, in closed form."""
    film = memscal.ElasticFilm(young_modulus=MODULUS, poisson_ratio=poisson, thickness=THICKNESS)
    rod, k = memscal.Rod(radius=0.9 * radius * THICKNESS), KH / THICKNESS
    contact = memscal.indent(film, rod, load=1e-6, friction=np.inf if sticking else 0.0)
    slope = contact.load / contact.depth / (film.shear_modulus * THICKNESS)
    spectra = contact.base_spectrum(k), contact.base_shear_spectrum(k)
    return np.concatenate([[slope], *(s / contact.load for s in spectra)])


def join(folder: Path, keys: list[Key]) -> None:
    """Write the table: loads over G h d and spectra per load; NaN where a rod does not reach."""
    shape = (len(DEEPEST), len(POISSON), len(RADII), len(DEPTHS) + 1, 1 + 2 * KH.size)
    table = np.full(shape, np.nan)
    for place, key in zip(np.ndindex(shape[:3]), keys, strict=True):
        rows = np.load(column_file(folder, key))["rows"]
        rows[:, 0] /= DEPTHS[: len(rows)]
        table[place][0] = start_of_column(*key[1:], sticking=key[0] == "sticking")
        table[place][1 : 1 + len(rows)] = rows
    axes = {"poisson_ratio": POISSON, "radius": RADII, "depth": (0.0, *DEPTHS), "kh": KH}
    np.savez_compressed(FILE, table=table.astype(np.float32), **axes)


if __name__ == "__main__":
    target = Path(sys.argv[1])
    columns = list(itertools.product(DEEPEST, POISSON, RADII))
    with Pool(int(sys.argv[2]) if len(sys.argv) > 2 else 2) as pool:
        for _ in pool.imap_unordered(make_column, [(target, key) for key in columns], chunksize=1):
            pass
    join(target, columns)
