"""Fields on a mesh as a VTU file, for ParaView and whatever else reads VTK."""

from __future__ import annotations

import os
import tempfile

import numpy as np

from memscal.formats.atomic import atomic_write_bytes
from memscal.formats.mesh_reader import load_meshio
from memscal.formats.text import printable
from memscal.formats.units import from_si
from memscal.model.field_mesh import FieldMesh
from memscal.version import __version__

__all__ = ["write_mesh"]

_CELLS = {3: "triangle", 6: "triangle6"}
_MAX_NOTES = 4000


def write_mesh(mesh: FieldMesh, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    r"""Write displacement and stress on a mesh as a VTU file, whole or not at all.

    The section lies in the plane of x (the radius) and y (the height), in mm.  At the points
    there are the vector ``displacement_mm``, by which ParaView can warp the mesh as it is, and
    ``stress_Pa``, tension positive, in VTK's order of a symmetric tensor: XX
    (:math:`\sigma_{rr}`), YY (:math:`\sigma_{zz}`), ZZ (:math:`\sigma_{\theta\theta}`), XY
    (:math:`\sigma_{rz}`), and zeros for YZ and XZ.

    Parameters
    ----------
    mesh : FieldMesh
        The fields; their notes become a comment at the head of the file.
    path : path
        The file; its name should end in ``.vtu``.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    InputError
        If meshio is not installed.
    OutputError
        If the file exists or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from memscal.formats.mesh_reader import read_mesh
    >>> corner = FieldMesh(
    ...     points=[[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]],
    ...     triangles=[[0, 1, 2]],
    ...     displacement=np.zeros((3, 2)),
    ...     stress=np.zeros((3, 4)),
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mesh(corner, f"{folder}/corner.vtu")
    ...     sorted(read_mesh(f"{folder}/corner.vtu").point_data)
    ['displacement_mm', 'stress_Pa']
    """
    meshio = load_meshio()
    points, unit = from_si(np.pad(mesh.points, ((0, 0), (0, 1))), "length")
    moved, _ = from_si(np.pad(mesh.displacement, ((0, 0), (0, 1))), "length")
    stress = np.pad(mesh.stress, ((0, 0), (0, 2)))
    written = meshio.Mesh(
        points,
        [(_CELLS[mesh.triangles.shape[1]], mesh.triangles)],
        point_data={f"displacement_{unit}": moved, "stress_Pa": stress},
    )
    with tempfile.TemporaryDirectory(prefix="memscal-") as folder:
        plain = os.path.join(folder, "mesh.vtu")
        # Not Mesh.write, which finds the format by the name, in any of forty.
        meshio.vtu.write(plain, written)
        with open(plain, "rb") as file:
            data = file.read()
    head, grid, rest = data.partition(b"<UnstructuredGrid>")
    atomic_write_bytes(path, head + _comment(mesh) + grid + rest, overwrite=overwrite)


def _comment(mesh: FieldMesh) -> bytes:
    """Return what the file is, as XML allows it: a comment may not hold two hyphens."""
    words = (
        f"Written by memscal {__version__}: an axisymmetric section, x = radius and y = height "
        f"in mm, z = hoop direction. {printable(mesh.notes, _MAX_NOTES)}"
    )
    return f"<!-- {words.replace('--', '- -').replace('--', '- -')} -->\n".encode()
