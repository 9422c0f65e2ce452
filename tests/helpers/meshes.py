"""Meshes as finite-element programs leave them, with a stress in closed form."""

from pathlib import Path

import meshio
import numpy as np

RADII = np.linspace(0.0, 8.0, 41)
HEIGHTS = np.linspace(0.0, 2.0, 4)


def write(mesh: meshio.Mesh, path: Path, **options) -> Path:
    """Write a mesh with meshio, in the format of the file's name."""
    formats = {".vtu": meshio.vtu, ".vtk": meshio.vtk, ".xdmf": meshio.xdmf}
    formats[path.suffix].write(str(path), mesh, **options)
    return path


def pressure(r):
    """Normal stress at the base in MPa, r in mm, that carries 1 N."""
    return np.exp(-np.square(r) / 2) / (2 * np.pi)


def tensor(r, z) -> np.ndarray:
    """Components rr, zz, hoop, rz of a stress in MPa, tension positive; not in equilibrium."""
    s = pressure(r)
    return np.stack([-s / 3, -s * (1 + z), -s / 5, r * s / 4], axis=-1)


def grid(*axes) -> tuple[np.ndarray, np.ndarray]:
    """Points of a grid, and the corners of its quadrilaterals or hexahedra."""
    points = np.stack([each.ravel() for each in np.meshgrid(*axes, indexing="ij")], axis=-1)
    index = np.arange(len(points)).reshape([len(axis) for axis in axes])
    a = slice(None, -1)
    b = slice(1, None)
    if len(axes) == 2:
        corners = [(a, a), (b, a), (b, b), (a, b)]
    else:
        bottom = [(a, a), (b, a), (b, b), (a, b)]
        corners = [(*each, end) for end in (a, b) for each in bottom]
    return points, np.stack([index[each].ravel() for each in corners], axis=-1)


def section(plane="xy", *, radii=RADII, heights=HEIGHTS) -> meshio.Mesh:
    """A section of the film in a plane, radius first, with its stress in many shapes."""
    flat, cells = grid(radii, heights)
    r, z = flat.T
    across = ["xyz".index(axis) for axis in plane]
    points = np.zeros((len(flat), 3))
    points[:, across] = flat
    rr, zz, hoop, rz = tensor(r, z).T
    full = np.zeros((len(flat), 3, 3))
    i, j = across
    (k,) = {0, 1, 2} - set(across)
    full[:, i, i] = rr
    full[:, j, j] = zz
    full[:, k, k] = hoop
    full[:, i, j] = full[:, j, i] = rz
    six = np.stack([full[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], 1)
    middle = flat[cells].mean(axis=1)
    four = np.stack([rr, zz, hoop, rz], axis=1)
    nine = full.reshape(-1, 9)
    at_points = {"S4": four, "S6": six, "S9": nine, "S33": zz, "S13": rz, "u": points}
    at_cells = {"C33": [-pressure(middle[:, 0])], "C4": [tensor(middle[:, 0], 0 * middle[:, 0])]}
    return meshio.Mesh(points, [("quad", cells)], point_data=at_points, cell_data=at_cells)


def block(x, y, *, centre=(0.0, 0.0)) -> meshio.Mesh:
    """A film in 3-D, z across it, with the same stress about the axis through the centre."""
    points, cells = grid(x, y, np.linspace(0.0, 2.0, 3))
    dx = points[:, 0] - centre[0]
    dy = points[:, 1] - centre[1]
    rr, zz, hoop, rz = tensor(np.hypot(dx, dy), points[:, 2]).T
    angle = np.arctan2(dy, dx)
    c = np.cos(angle)
    s = np.sin(angle)
    plane = [rr * c**2 + hoop * s**2, rr * s**2 + hoop * c**2, zz, (rr - hoop) * c * s]
    at_points = {"S6": np.stack([*plane, rz * s, rz * c], axis=1), "S33": zz}
    return meshio.Mesh(points, [("hexahedron", cells)], point_data=at_points)
