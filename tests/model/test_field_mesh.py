"""A mesh with a field holds what it says, or says what it lacks."""

import numpy as np
import pytest

from memscal import FieldMesh
from memscal.errors import InputError


def parts(**changes):
    return {
        "points": [[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]],
        "triangles": [[0, 1, 2]],
        "displacement": np.zeros((3, 2)),
        "stress": np.zeros((3, 4)),
        **changes,
    }


def test_a_field_mesh_keeps_its_own_read_only_copy():
    stress = np.ones((3, 4))
    mesh = FieldMesh(**parts(stress=stress))
    stress[0, 0] = 7.0
    assert mesh.stress[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.triangles[0, 0] = 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stress": np.zeros((3, 3))}, r"stress .* \(3, 3\), but \(3, 4\)"),
        ({"displacement": np.zeros((2, 2))}, r"displacement .* \(2, 2\), but \(3, 2\)"),
        ({"displacement": np.full((3, 2), np.nan)}, "displacement .* not finite"),
        ({"triangles": [[0, 1, 2, 0]]}, "three columns"),
        ({"triangles": [[1, 2, 3]]}, "outside 0 to 2"),
        ({"triangles": [[-1, 1, 2]]}, "outside 0 to 2"),
    ],
)
def test_a_field_mesh_refuses_parts_that_do_not_fit(changes, message):
    with pytest.raises(InputError, match=message):
        FieldMesh(**parts(**changes))
