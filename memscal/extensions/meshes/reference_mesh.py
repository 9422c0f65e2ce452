"""Import of a stress profile from the mesh of any FEM program."""

from dataclasses import replace
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.extensions.meshes.mesh_files import Cells, Mesh, read_mesh
from memscal.formats.files import FilePath
from memscal.formats.tables import reference
from memscal.formats.units import to_si
from memscal.model.arrays import (
    ArrayPair,
    Arrays,
    FloatArray,
    IndexArray,
    array_record,
    value_record,
)
from memscal.model.checks import Message, import_notes
from memscal.model.notation import printable

AXES = "xyz"
# Of the largest coordinate: meshes are often stored in single precision.
_TOLERANCE = 1e-6
_FEWEST = 4
_CIRCLES = 501
_DIRECTIONS = 72


@array_record
class Frame:
    """How a mesh lies in space: ``points`` (n, 3) and ``tolerance`` in m, and its axes."""

    points: FloatArray
    radial: tuple[int, ...]
    vertical: int
    tolerance: float
    notes: tuple[Message, ...]

    @property
    def height(self) -> FloatArray:
        """Coordinate across the film, in m."""
        return self.points[:, self.vertical]


@array_record
class Base:
    """Nodes on the base, cells with a side there and that side's middle; 1 or -1 is outward."""

    nodes: IndexArray
    cells: tuple[tuple[Cells, IndexArray, FloatArray], ...]
    outward: int
    note: str


def find_frame(mesh: Mesh, points: FloatArray, vertical: str | None) -> Frame:
    """Find which coordinates are radial and which is vertical; ``points`` (n, 3) are in m."""
    name = mesh.source.file_name
    inside = points[mesh.used]
    tolerance = _TOLERANCE * np.abs(inside).max()
    varying = [i for i in range(3) if np.ptp(inside[:, i]) > tolerance]
    if len(varying) < 2:
        raise InputError(
            f"{name} holds a mesh that is a line or a point.",
            cure="Give a section of the film from the axis outward, or the film in 3-D.",
        )
    up = varying[-1] if vertical is None else AXES.find(vertical)
    if up not in varying:
        raise InputError(
            f"The vertical axis is {vertical!r}, but the mesh in {name} extends along "
            f"{' and '.join(AXES[i] for i in varying)}.",
            cure="Name the axis that points across the film, from base to surface.",
        )
    radial = tuple(i for i in varying if i != up)
    across = f"{AXES[up]} across the film"
    if len(radial) > 1:
        text = f"The mesh is a body in 3-D: {across} was taken, and its base in the other two."
    else:
        text = f"The mesh is a section: {AXES[radial[0]]} as the radius and {across} were taken."
    notes = import_notes([text])
    wide, high = (np.ptp(inside[:, i]) * 1e3 for i in (radial[0], up))
    if high > wide:
        text = (
            f"the mesh extends {high:.4g} mm along {AXES[up]} but {wide:.4g} mm along "
            f"{AXES[radial[0]]}. A film is wider than thick: if the axis across it is "
            f"{AXES[radial[0]]}, say so (vertical; --vertical)."
        )
        notes.append(Message("vertical_axis", text, "warning"))
    return Frame(points, radial, up, tolerance, tuple(notes))


def find_base(mesh: Mesh, frame: Frame, level: float | None) -> Base:
    """Find what lies on the base, at a level of the vertical axis in m: by default the lowest."""
    heights = frame.height[mesh.used]
    lowest = heights.min()
    highest = heights.max()
    position = lowest if level is None else level
    # Only where nothing lies above it is the base the upper face of the film.
    outward = 1 if position >= highest - frame.tolerance else -1
    on_base = np.abs(frame.height - position) <= frame.tolerance
    sides = []
    nodes = []
    for block in mesh.solid:
        touching = on_base[block.nodes]
        middle = frame.height[block.nodes].mean(axis=1)
        # An indenter or a substrate may be in the mesh too, on the other side of the base.
        film = touching.any(axis=1) & (outward * (middle - position) < 0)
        nodes.append(block.nodes[film][touching[film]])
        with_side = np.flatnonzero(film & (touching.sum(axis=1) > len(frame.radial)))
        on_side = touching[with_side][..., None]
        corners = frame.points[block.nodes[with_side]]
        middles = (on_side * corners).sum(axis=1) / on_side.sum(axis=1)
        sides.append((block, with_side, middles))
    base_nodes = np.unique(np.concatenate(nodes))
    level_text = f"{AXES[frame.vertical]} = {position * 1e3:.6g} mm"
    if base_nodes.size < _FEWEST:
        nearest = heights[np.argmin(np.abs(heights - position))]
        raise InputError(
            f"{mesh.source.file_name} has too few nodes on its film's base: {base_nodes.size}, "
            f"at {level_text}.",
            why=f"The mesh reaches from {AXES[frame.vertical]} = {lowest * 1e3:.6g} mm to "
            f"{highest * 1e3:.6g} mm, and its nearest node is at {nearest * 1e3:.6g} mm.",
            cure="Name the axis across the film (vertical; --vertical) or the position of the "
            "flat base on it (base; --base).",
        )
    which = ", its lowest level" if level is None else ""
    note = f"The base was taken at {level_text}{which}: {base_nodes.size} nodes."
    return Base(base_nodes, tuple(sides), outward, note)


def average_over_circles(places: FloatArray, columns: Arrays) -> tuple[Arrays, str]:
    """Interpolate between places (n, 2), in m from the axis, and average over circles."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    reach = np.hypot(*places.T).max() or 1.0
    r = np.linspace(0.0, reach, _CIRCLES)
    # On the axis and along an edge of the mesh, rounding decides what is inside.
    directions = 2 * np.pi * (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    circles = np.maximum(r, 1e-6 * reach)[:, None]
    points = np.stack([circles * np.cos(directions), circles * np.sin(directions)], axis=-1)
    distinct, index = np.unique(np.round(places / reach, 7), axis=0, return_inverse=True)
    sums = [np.bincount(index.ravel(), values) for values in columns.values()]
    at_places = np.stack(sums, axis=1) / np.bincount(index.ravel())[:, None]
    try:
        fields = LinearNDInterpolator(distinct * reach, at_places)(points)
    except QhullError as error:
        raise InputError(
            "The nodes on the base of the film lie on one line.",
            cure="Name the axis across the film (vertical; --vertical).",
        ) from error
    # Circles of which less than half as much is inside as of others are left out: the corners.
    share = np.isfinite(fields[..., 0]).sum(axis=1)
    kept = share >= max(1, share.max() / 2)
    means = np.nansum(fields[kept], axis=1) / share[kept, None]
    spread = np.nanmax(np.abs(fields[kept, :, 0] - means[:, :1]))
    peak = np.abs(means[:, 0]).max()
    note = (
        f"Means over {kept.sum()} circles about the axis, interpolated linearly between "
        f"{distinct.shape[0]} places in the base; on a circle the normal stress differs from its "
        f"mean by up to {spread / peak if peak else 0:.2g} of the maximum."
    )
    return {"r": r[kept], **dict(zip(columns, means.T, strict=True))}, note


# VTK's order of a symmetric tensor, and that of axisymmetric elements in FEM programs.
_SYMMETRIC = ("xx", "yy", "zz", "xy", "yz", "xz")
_MOST_LISTED = 30
#: Share of the largest normal stress that a shear may have and be zero.
_ZERO = 1e-3


@value_record
class Component:
    """One component of a field: of its values at the points, or in the cells."""

    field: str
    at_points: bool
    column: int
    meaning: str
    tensor: int = 0  # how many components it has


def _find(mesh: Mesh, frame: Frame, field: str, axis: int) -> Component:
    """Return the stress along an axis on the base; ``name:number`` takes a component, from 1."""
    at_points = {name: values.shape[1] for name, values in mesh.point_data.items()}
    in_cells: dict[str, int] = {}
    for block in mesh.solid:
        in_cells |= {name: values.shape[1] for name, values in block.data.items()}
    counts = in_cells | at_points
    name, _, number = field.rpartition(":")
    if field not in counts and name in counts and number.isdecimal():
        if not 1 <= int(number) <= counts[name]:
            raise InputError(
                f"The field {name!r} in {mesh.source.file_name} has no component {number}.",
                why=f"It has {counts[name]}, counted from 1.",
            )
        return Component(name, name in at_points, int(number) - 1, f"component {number}")
    if field not in counts:
        raise _no_such_field(mesh, field, at_points, in_cells)
    if counts[field] == 1:
        return Component(field, field in at_points, 0, "the value")
    column, meaning = _tensor_component(mesh, frame, field, counts[field], axis)
    return Component(field, field in at_points, column, meaning, counts[field])


def _tensor_component(
    mesh: Mesh, frame: Frame, field: str, count: int, axis: int
) -> tuple[int, str]:
    """Return the column of a tensor's component along an axis, and what it is called."""
    axes = "".join(sorted(AXES[axis] + AXES[frame.vertical]))
    if count == 9:
        return 3 * axis + frame.vertical, f"the component {axes}"
    if count == 6 and mesh.tensor_order:
        return _SYMMETRIC.index(axes), f"the component {axes} (of {', '.join(_SYMMETRIC)})"
    if count == 4 and len(frame.radial) == 1 and not _is_plane(mesh, field):
        number = 2 if axis == frame.vertical else 4
        return number - 1, f"component {number} of 4 (radial, vertical, hoop, shear)"
    raise InputError(
        f"The field {field!r} in {mesh.source.file_name} has {count} components, and which of "
        "them is meant is not plain.",
        why="In an XDMF file the order of a tensor's six components depends on the program."
        if count == 6
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
    lists = []
    for where, fields in (("at the nodes", points), ("in the cells", cells)):
        names = [f"{name} ({count})" for name, count in fields.items()]
        more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
        if names:
            lists.append(f"{where}: {', '.join(names[:_MOST_LISTED])}{more}")
    has = "has no fields at all"
    if lists:
        has = f"has, with their numbers of components, {'; '.join(lists)}"
    return InputError(
        f"{mesh.source.file_name} has no field {printable(field, 80)!r}.",
        why=f"It {has}.",
        cure="Give the name of the stress among them, or save the mesh with its stress.",
    )


_FEWEST_RADII = 3


def read_reference_mesh(
    path: FilePath,
    *,
    sigma: str,
    r_unit: str,
    sigma_unit: str,
    sign: int = -1,
    shear: str | None = None,
    shear_sign: int | None = None,
    vertical: str | None = None,
    base: float | None = None,
    centre: tuple[float, float] | None = None,
    value: float | None = None,
    **stated: Any,
) -> reference.ImportedProfile:
    """Read the stress at the base of the film from a mesh; ``stated`` are the profile's fields."""
    # sigma is a field of the normal stress or of a tensor of 4, 6 or 9 components, "name:2" its
    # component 2. Base and centre are in m. Without shear_sign the shear is taken for the stress
    # component rz; with 1, for the radial traction of the base on the film.
    reference.require_sign("sign", sign)
    if shear_sign is not None:
        reference.require_sign("shear sign", shear_sign)
    mesh = read_mesh(path)
    name = mesh.source.file_name
    frame = find_frame(mesh, to_si(mesh.points, r_unit, "length", name), vertical)
    normal = _find(mesh, frame, sigma, frame.vertical)
    section = len(frame.radial) == 1
    if section and centre is not None:
        raise InputError(
            f"A centre was given, but the mesh in {name} is a section.",
            why="The axis of a section is at radius 0.",
            cure="Leave out the centre (--centre), or shift the mesh.",
        )
    if not section and shear is not None:
        raise InputError(
            f"A shear field was given, but the mesh in {name} is a body in 3-D.",
            why="The radial shear is read from sections only.",
            cure="Leave it out (shear; --shear), or give a section of the film.",
        )
    tangential = _shear_component(mesh, frame, normal, shear) if section else None
    footing = find_base(mesh, frame, base)
    places, values = _at_base(mesh, frame, footing, normal)
    columns = {"sigma_zz": sign * to_si(values, sigma_unit, "stress", f"{name}: {sigma}")}
    treatment = "compression negative" if sign < 0 else "as it is"
    notes = [
        *import_notes([f"Imported from {name} (sha256 {mesh.source.sha256}).", *mesh.notes]),
        *frame.notes,
        *import_notes([footing.note]),
        _component_note(normal, "Normal stress", treatment),
    ]
    if tangential is not None:
        if tangential.tensor == 6:
            _require_order(mesh, frame, footing, tangential, _ZERO * np.abs(values).max())
        turned = footing.outward if shear_sign is None else shear_sign
        values = _at_base(mesh, frame, footing, tangential)[1]
        columns["sigma_rz"] = turned * to_si(values, sigma_unit, "stress", name)
        notes.append(_component_note(tangential, "Radial shear", f"times {turned}"))
    size = f"{len(mesh.points)} nodes, {sum(len(block.nodes) for block in mesh.solid)} cells"
    samples = reference.Samples(
        columns=columns,
        source=mesh.source,
        notes=notes,
        kind="mesh",
        item="base node" if normal.at_points else "base cell",
        units=(r_unit, sigma_unit),
        sign=sign,
        spacing=frame.tolerance,
        discretisation=f"{size}, {len(footing.nodes)} nodes on the base",
    )
    samples = _along_radius(samples, frame, places, centre or (0.0, 0.0))
    return reference.profile_of(samples, stated, value)


def _along_radius(
    samples: reference.Samples, frame: Frame, places: FloatArray, centre: tuple[float, float]
) -> reference.Samples:
    """Give samples their radii: those of a section as they are, those of a plane by circles."""
    if len(frame.radial) == 1:
        r = np.where(np.abs(places[:, 0]) <= frame.tolerance, 0.0, places[:, 0])
        distinct = 1 + np.count_nonzero(np.diff(np.sort(r)) > frame.tolerance)
        if distinct < _FEWEST_RADII:
            raise InputError(
                f"The base in {samples.source.file_name} has values at too few radii: {distinct}.",
                cure="Name the axis across the film (vertical; --vertical), or give a finer mesh.",
            )
        return replace(samples, columns={"r": r, **samples.columns})
    reference.require_numbers(samples)  # a mean would leave out what is missing
    columns, note = average_over_circles(places - np.array(centre), samples.columns)
    return replace(samples, columns=columns, notes=[*samples.notes, *import_notes([note])])


def _shear_component(
    mesh: Mesh, frame: Frame, normal: Component, shear: str | None
) -> Component | None:
    """Return the shear that is asked for, or the one that comes with a stress tensor."""
    if shear is not None:
        component = _find(mesh, frame, shear, frame.radial[0])
        if component.at_points != normal.at_points:
            raise InputError(
                f"In {mesh.source.file_name}, one of {normal.field!r} and {component.field!r} is "
                "given at the nodes and the other in the cells.",
                cure="Give both in the same way.",
            )
        return component
    return _find(mesh, frame, normal.field, frame.radial[0]) if normal.tensor else None


def _require_order(mesh: Mesh, frame: Frame, base: Base, shear: Component, zero: float) -> None:
    """Refuse six components of a section of which another shear than that in it is not zero."""
    for column in {3, 4, 5} - {shear.column}:
        if np.abs(_at_base(mesh, frame, base, replace(shear, column=column))[1]).max() > zero:
            other = f"{shear.field}:{column + 1}"
            raise InputError(
                f"In {mesh.source.file_name} the shear {other!r} is not zero.",
                why="Shears across a section are, so that the components are not in the order "
                f"{', '.join(_SYMMETRIC)}.",
                cure=f'Name the shear (shear; --shear "{other}"), and the normal stress likewise '
                "(sigma; --sigma).",
            )


def _at_base(mesh: Mesh, frame: Frame, base: Base, component: Component) -> ArrayPair:
    """Return places in the base and the values there: at nodes, or at the middles of sides."""
    if component.at_points:
        places = frame.points[base.nodes][:, frame.radial]
        return places, mesh.point_data[component.field][base.nodes, component.column]
    blocks = [block for block in base.cells if component.field in block[0].data]
    if not sum(len(cells) for _, cells, _ in blocks):
        raise InputError(
            f"No cell with a value of {component.field!r} has a side on the base in "
            f"{mesh.source.file_name}.",
            cure="Name the position of the base (base; --base), or save the stress at the nodes.",
        )
    places = np.concatenate([middles for _, _, middles in blocks])[:, frame.radial]
    values = [block.data[component.field][cells, component.column] for block, cells, _ in blocks]
    return places, np.concatenate(values)


def _component_note(component: Component, name: str, treatment: str) -> Message:
    place = "at the nodes" if component.at_points else "of the cells"
    field = f"{component.meaning} of the field {component.field!r} {place}"
    text = f"{name}: {field}, {treatment}"
    if not component.at_points:
        text += "; each value is taken at the middle of its cell's side on the base"
    return Message("import", f"{text}.")
