"""Displacement and stress on a mesh of the film's cross-section, as finite elements give them."""

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.model.arrays import FloatArray, frozen_array, keyword_array_record


@keyword_array_record
class FieldMesh:
    r"""Displacement and stress in the half-plane :math:`r \ge 0` of an axisymmetric film.

    Unlike everywhere else in memscal, stress is **tension positive**, as other programs expect of
    a mesh: the normal stress at the base of a film under an indenter is negative here.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Radius :math:`r` and height :math:`z` of the nodes before the film is deformed, in m.
        The base is at z = 0 and the surface at z = h.
    triangles : ndarray of int, shape (m, 3) or (m, 6)
        Indices of each triangle's nodes: its corners, anticlockwise; with six columns also the
        nodes in the middle of the sides 0-1, 1-2 and 2-0 (VTK's order of a quadratic triangle).
    displacement : ndarray, shape (n, 2)
        Displacement of the nodes, outward and upward, in m.
    stress : ndarray, shape (n, 4)
        Stress at the nodes, :math:`\sigma_{rr}, \sigma_{zz}, \sigma_{\theta\theta},
        \sigma_{rz}`, in Pa, tension positive.
    notes : str
        What it is a field of: film, load, elements.

    Examples
    --------
    >>> corner = FieldMesh(
    ...     points=[[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]],
    ...     triangles=[[0, 1, 2]],
    ...     displacement=np.zeros((3, 2)),
    ...     stress=np.zeros((3, 4)),
    ... )
    >>> corner
    <FieldMesh: 3 points, 1 triangles>
    """

    points: FloatArray
    triangles: NDArray[np.int64]
    displacement: FloatArray
    stress: FloatArray
    notes: str = ""

    def __post_init__(self) -> None:
        triangles = frozen_array(self.triangles, dtype=np.int64)
        object.__setattr__(self, "triangles", triangles)
        count = len(self.points)
        for name, columns in (("points", 2), ("displacement", 2), ("stress", 4)):
            values = frozen_array(getattr(self, name))
            object.__setattr__(self, name, values)
            if values.shape != (count, columns):
                raise InputError(
                    f"{name} of the field mesh has shape {values.shape}, but {(count, columns)} "
                    f"is needed: {columns} columns and one row for each point."
                )
            if not np.all(np.isfinite(values)):
                raise InputError(f"{name} of the field mesh holds a value that is not finite.")
        if triangles.ndim != 2 or triangles.shape[1] not in {3, 6}:
            raise InputError(
                f"triangles of the field mesh has shape {triangles.shape}, but three columns "
                "(corners) or six (corners, then middles of the sides) are needed."
            )
        if triangles.size and not 0 <= triangles.min() <= triangles.max() < count:
            raise InputError(
                f"A triangle of the field mesh has a node outside 0 to {count - 1}.",
                cure="Count the nodes from 0, in the order of points.",
            )

    def __repr__(self) -> str:
        """Return its size in place of thousands of array elements."""
        return f"<FieldMesh: {self.points.shape[0]} points, {self.triangles.shape[0]} triangles>"
