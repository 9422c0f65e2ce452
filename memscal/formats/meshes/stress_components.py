"""Normal and shear stress among the fields of a mesh: scalars, tensors, or one component."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.errors import InputError
from memscal.formats.meshes.film_base import AXES, Frame
from memscal.formats.meshes.mesh_files import Mesh
from memscal.model.notation import printable

# VTK's order of a symmetric tensor, and that of axisymmetric elements in FEM programs.
_SYMMETRIC = ("xx", "yy", "zz", "xy", "yz", "xz")
_SCALAR, _AXISYMMETRIC, _SIX, _NINE = 1, 4, 6, 9
_MOST_LISTED = 30


@dataclass(frozen=True)
class Component:
    """One component of a field: of its values at the points, or in the cells."""

    field: str
    at_points: bool
    column: int
    meaning: str
    tensor: bool = False

    def __str__(self) -> str:
        """Return its name in notes."""
        place = "at the nodes" if self.at_points else "of the cells"
        return f"{self.meaning} of the field {self.field!r} {place}"


def find_normal(mesh: Mesh, frame: Frame, field: str) -> Component:
    """Return the normal stress across the film; ``name:number`` takes a component, from 1."""
    up = frame.vertical
    return _find(mesh, frame, field, (up, up))


def find_shear(mesh: Mesh, frame: Frame, field: str) -> Component:
    """Return the radial shear stress of a section."""
    return _find(mesh, frame, field, (frame.radial[0], frame.vertical))


def _find(mesh: Mesh, frame: Frame, field: str, pair: tuple[int, int]) -> Component:
    sizes = {name: values.shape[1] for name, values in mesh.point_data.items()}
    in_cells = {
        name: values.shape[1] for block in mesh.solid for name, values in block.data.items()
    }
    name, _, number = field.rpartition(":")
    if field not in {*sizes, *in_cells} and name in {*sizes, *in_cells} and number.isdecimal():
        count = sizes.get(name, in_cells.get(name, 0))
        if not 1 <= int(number) <= count:
            raise InputError(
                f"The field {name!r} in {mesh.source.file_name} has no component {number}.",
                why=f"It has {count}, counted from 1.",
            )
        return Component(name, name in sizes, int(number) - 1, f"component {number}")
    if field not in {*sizes, *in_cells}:
        raise _no_such_field(mesh, field, sizes, in_cells)
    count = sizes.get(field, in_cells.get(field, 0))
    if count == _SCALAR:
        return Component(field, field in sizes, 0, "the value")
    column, meaning = _of_tensor(mesh, frame, field, count, pair)
    return Component(field, field in sizes, column, meaning, tensor=True)


def _of_tensor(
    mesh: Mesh, frame: Frame, field: str, count: int, pair: tuple[int, int]
) -> tuple[int, str]:
    """Return the column of a tensor's component, and what it is called."""
    axes = "".join(AXES[i] for i in sorted(pair))
    if count == _NINE:
        return 3 * pair[0] + pair[1], f"the component {axes}"
    if count == _SIX and mesh.tensor_order:
        return _SYMMETRIC.index(axes), f"the component {axes} (of {', '.join(_SYMMETRIC)})"
    if count == _AXISYMMETRIC and len(frame.radial) == 1 and not _is_plane(mesh, field):
        normal = pair[0] == pair[1]
        return (1 if normal else 3), (
            f"component {2 if normal else 4} of 4 (radial, vertical, hoop, shear)"
        )
    raise InputError(
        f"The field {field!r} in {mesh.source.file_name} has {count} components, and which of "
        "them is meant is not plain.",
        why="In an XDMF file the order of a tensor's six components depends on the program."
        if count == _SIX
        else "A stress is one value, or a tensor of 4 components (radial, vertical, hoop and shear "
        "in a section), 6 or 9.",
        cure=f'Name one, counted from 1, such as "{field}:2".',
    )


def _is_plane(mesh: Mesh, field: str) -> bool:
    """Return whether four components are xx, xy, yx, yy: the middle ones are the same."""
    fields = [mesh.point_data, *(block.data for block in mesh.solid)]
    tensors = [values[field] for values in fields if field in values]
    return all(np.array_equal(tensor[:, 1], tensor[:, 2]) for tensor in tensors)


def _no_such_field(
    mesh: Mesh, field: str, points: dict[str, int], cells: dict[str, int]
) -> InputError:
    def listed(fields: dict[str, int], where: str) -> str:
        names = [f"{name} ({count})" for name, count in list(fields.items())[:_MOST_LISTED]]
        more = len(fields) - len(names)
        return f"{where}: " + ", ".join(names) + (f" and {more} more" if more else "")

    lists = [
        listed(fields, where)
        for fields, where in ((points, "at the nodes"), (cells, "in the cells"))
        if fields
    ]
    has = (
        f"It has, with their numbers of components, {'; '.join(lists)}."
        if lists
        else ("It has no fields at all.")
    )
    return InputError(
        f"{mesh.source.file_name} has no field {printable(field, 80)!r}.",
        why=has,
        cure="Give the name of the stress among them, or save the mesh with its stress.",
    )
