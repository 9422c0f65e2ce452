"""A film under a rod for CalculiX: axisymmetric second-order elements, from mesh to results.

All in mm, N and MPa.  The elements are eight-noded with reduced integration (CAX8R), which do
not lock close to incompressibility.  CalculiX solves a sector of two degrees: forces are scaled
to the full circle here.  The stress at the base is not sampled inside the elements but found
from the reactions of its nodes, as the traction that is consistent with them.
"""

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from helpers.getfem_sphere import REACH
from numpy.typing import NDArray

from memscal import ElasticFilm

FloatArray = NDArray[np.float64]
SECTORS = 180.0


@dataclass(frozen=True)
class Mesh:
    """Quadrilaterals in rows and columns; middle nodes halfway, none inside the elements.

    Nodes and coordinates are by half columns and half rows, from the axis and from the base.
    """

    r: FloatArray
    z: FloatArray

    @classmethod
    def of_corners(cls, r: FloatArray, z: FloatArray) -> Self:
        return cls(_with_middles(r), _with_middles(z))

    @property
    def nodes(self) -> NDArray[np.int64]:
        column, row = np.indices(self.r.shape)
        exists = (column % 2 == 0) | (row % 2 == 0)
        return np.where(exists, np.cumsum(exists).reshape(exists.shape), 0)

    @property
    def elements(self) -> NDArray[np.int64]:
        n = self.nodes
        corners = (n[:-2:2, :-2:2], n[2::2, :-2:2], n[2::2, 2::2], n[:-2:2, 2::2])
        middles = (n[1::2, :-2:2], n[2::2, 1::2], n[1::2, 2::2], n[:-2:2, 1::2])
        return np.stack(corners + middles, axis=-1).reshape(-1, 8)


@dataclass(frozen=True)
class PressedRod:
    """Stiffness in N/mm, and stress at the base in MPa for a load of 1 N, at radii in mm."""

    stiffness: float
    base_r: FloatArray
    base_normal: FloatArray


def press_rod(
    film: ElasticFilm, radius: float, halvings: int, folder: Path, *, sticking: bool
) -> PressedRod:
    """Press a flat rod down by a tenth of a millimetre; the problem is linear."""
    depth = 0.1
    mesh = rod_mesh(radius, film.thickness * 1e3, halvings)
    deck = [
        *_film_deck(film, mesh),
        *_node_set("ROD", mesh.nodes[:, -1][mesh.r[:, -1] < radius * (1 + 1e-9)]),
        "*STEP",
        "*STATIC",
        "*BOUNDARY",
        f"ROD, 2, 2, {-depth}",
        *(["ROD, 1, 1"] if sticking else []),
        "*NODE PRINT, NSET=ROD",
        "RF",
        "*NODE PRINT, NSET=BASE",
        "RF",
        "*END STEP",
    ]
    tables = run(deck, folder)
    load = -SECTORS * sum(force[1] for force in tables["ROD", 1.0].values())
    return PressedRod(load / depth, mesh.r[:, 0], _base_stress(mesh, tables["BASE", 1.0]) / load)


def rod_mesh(radius: float, thickness: float, halvings: int) -> Mesh:
    """Columns that crowd at the rod's edge and fan out evenly toward the base.

    Straight columns as thin as the edge asks for would let reduced integration's pressure
    waver at the base.
    """
    toward_edge = 0.45 ** np.arange(9)
    surface = np.concatenate([1 - toward_edge, [1.0], 1 + toward_edge[::-1]]) * radius
    base = np.linspace(0.0, 0.8 * thickness, surface.size)
    below = list(base)
    while below[-1] < REACH:
        widest = 0.25 * thickness if below[-1] < 4 * thickness else thickness
        below.append(below[-1] + min(1.25 * (below[-1] - below[-2]), widest))
    far = np.array(below[base.size :])
    far = base[-1] + (far - base[-1]) * (REACH - base[-1]) / (far[-1] - base[-1])
    above = surface[-1] + np.cumsum(0.35 * radius * 1.25 ** np.arange(far.size))
    above = np.append(np.minimum(above, far)[:-1], REACH)
    depth = np.append(radius * toward_edge, 0.0)[::-1]
    depth = np.append(depth, np.linspace(radius, thickness, 9)[1:])[::-1]
    surface = np.append(surface, above)
    base = np.append(base, far)
    for _ in range(halvings):
        surface, base, depth = (_with_middles(part) for part in (surface, base, depth))
    fan = 1 / (1 + (depth / (0.2 * thickness)) ** 2)
    fan = (fan - fan[0]) / (fan[-1] - fan[0])
    r = base[:, None] + np.outer(surface - base, fan)
    return Mesh.of_corners(r, np.broadcast_to(thickness - depth, r.shape))


def trace_mass(r: FloatArray) -> FloatArray:
    """Integrals of products of the quadratic shape functions over a circular face."""
    x, weights = np.polynomial.legendre.leggauss(4)
    shapes = np.array([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
    mass = np.zeros((r.size, r.size))
    for i in range(0, r.size - 1, 2):
        half = (r[i + 2] - r[i]) / 2
        rings = 2 * np.pi * (r[i + 1] + half * x) * half * weights
        mass[i : i + 3, i : i + 3] += (shapes * rings) @ shapes.T
    return mass


def run(deck: list[str], folder: Path) -> dict[tuple[str, float], dict[int, FloatArray]]:
    """Run CalculiX on one thread; the tables that it printed."""
    (folder / "film.inp").write_text("\n".join(deck) + "\n", encoding="ascii")
    program = shutil.which("ccx")
    assert program is not None
    done = subprocess.run(
        [program, "film"],
        cwd=folder,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Job finished" in done.stdout, done.stdout[-2000:]
    return parse((folder / "film.dat").read_text(encoding="ascii"))


def parse(printed: str) -> dict[tuple[str, float], dict[int, FloatArray]]:
    """Tables of a .dat file by the set of nodes and the time; each has components by node."""
    tables = {}
    for line in printed.splitlines():
        heading = re.search(r"for set (\S+) and time\s+(\S+)", line)
        if heading:
            table = tables.setdefault((heading[1], float(heading[2])), {})
        elif line.strip():
            node, *values = line.split()
            table[int(node)] = np.array(values, dtype=np.float64)
    return tables


def _with_middles(corners):
    for axis in range(corners.ndim):
        ends = np.moveaxis(corners, axis, 0)
        both = np.empty((2 * len(ends) - 1, *ends.shape[1:]))
        both[::2] = ends
        both[1::2] = (ends[1:] + ends[:-1]) / 2
        corners = np.moveaxis(both, 0, axis)
    return corners


def _film_deck(film, mesh):
    exists = mesh.nodes > 0
    nodes = mesh.nodes
    points = zip(nodes[exists], mesh.r[exists], mesh.z[exists], strict=True)
    return [
        "*NODE",
        *(f"{node}, {r:.13g}, {z:.13g}, 0" for node, r, z in points),
        "*ELEMENT, TYPE=CAX8R, ELSET=FILM",
        *(f"{i}, {', '.join(map(str, e))}" for i, e in enumerate(mesh.elements, start=1)),
        "*MATERIAL, NAME=ELASTIC",
        "*ELASTIC",
        f"{film.young_modulus * 1e-6}, {film.poisson_ratio}",
        "*SOLID SECTION, ELSET=FILM, MATERIAL=ELASTIC",
        *_node_set("BASE", nodes[:, 0]),
        *_node_set("AXIS", nodes[0]),
        "*BOUNDARY",
        "BASE, 1, 2",
        "AXIS, 1, 1",
    ]


def _node_set(name, nodes):
    return [f"*NSET, NSET={name}", *(f"{node}," for node in nodes if node > 0)]


def _base_stress(mesh, base):
    """Normal stress, quadratic on every element, that does the work of the reactions.

    The radial reactions are of no such use: CalculiX leaves out of them what the hoop stress on
    the sides of its sector adds.
    """
    forces = SECTORS * np.array([base[node][1] for node in mesh.nodes[:, 0]])
    return np.linalg.solve(trace_mass(mesh.r[:, 0]), forces)
