"""Import of a stress profile from the mesh of any FEM program."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np

from memscal.errors import InputError
from memscal.formats.meshes import film_base
from memscal.formats.meshes.mesh_files import Mesh, read_mesh
from memscal.formats.meshes.stress_components import Component, find_normal, find_shear
from memscal.formats.tables.reference import (
    ImportedProfile,
    Samples,
    profile_of,
    require_numbers,
    require_sign,
)
from memscal.formats.units import to_si
from memscal.model.arrays import FloatArray
from memscal.model.checks import Message, import_notes
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter

_FEWEST_RADII = 3


def read_reference_mesh(
    path: str | os.PathLike[str],
    *,
    sigma: str,
    r_unit: str,
    sigma_unit: str,
    load: float,
    sign: int = -1,
    shear: str | None = None,
    shear_sign: int | None = None,
    vertical: str | None = None,
    base: float | None = None,
    centre: tuple[float, float] | None = None,
    film: ElasticFilm | None = None,
    indenter: Indenter | None = None,
    solver: str = "",
) -> ImportedProfile:
    """Read the stress at the base of the film from a mesh: a section, or a film in 3-D.

    ``sigma`` is a field of the normal stress or of a tensor of 4, 6 or 9 components, ``"name:2"``
    component 2.  ``base`` and ``centre`` are in m, ``load`` in N.  Without ``shear_sign`` the shear
    is taken for the stress component rz; with 1, for the radial traction of the base on the film.
    """
    require_sign("sign", sign)
    if shear_sign is not None:
        require_sign("shear sign", shear_sign)
    mesh = read_mesh(path)
    name = mesh.source.file_name
    frame = film_base.find_frame(mesh, to_si(mesh.points, r_unit, "length", name), vertical)
    normal = find_normal(mesh, frame, sigma)
    section = len(frame.radial) == 1
    _require_meaning(name, section, shear, centre)
    tangential = _shear_component(mesh, frame, normal, shear) if section else None
    footing = film_base.find_base(mesh, frame, base)
    places, values = _at_base(mesh, frame, footing, normal)
    columns = {"sigma_zz": sign * to_si(values, sigma_unit, "stress", f"{name}: {sigma}")}
    treatment = "compression negative" if sign < 0 else "as it is"
    notes = [
        *import_notes([f"Imported from {name} (sha256 {mesh.source.sha256}).", *mesh.notes]),
        *frame.notes,
        *import_notes(footing.notes),
        _component_note(normal, "Normal stress", treatment),
    ]
    if tangential is not None:
        turned = footing.outward if shear_sign is None else shear_sign
        values = _at_base(mesh, frame, footing, tangential)[1]
        columns["sigma_rz"] = turned * to_si(values, sigma_unit, "stress", name)
        notes.append(_component_note(tangential, "Radial shear", f"times {turned}"))
    samples = Samples(
        columns=columns,
        source=mesh.source,
        notes=notes,
        kind="mesh",
        item="base node" if normal.at_points else "base cell",
        units=(r_unit, sigma_unit),
        sign=sign,
        spacing=frame.tolerance,
        discretisation=f"{mesh.size}, {len(footing.nodes)} nodes on the base",
    )
    samples = _along_radius(samples, frame, places, centre or (0.0, 0.0))
    return profile_of(samples, load=load, film=film, indenter=indenter, solver=solver)


def _along_radius(
    samples: Samples, frame: film_base.Frame, places: FloatArray, centre: tuple[float, float]
) -> Samples:
    """Give samples their radii: those of a section as they are, those of a plane by circles."""
    if len(frame.radial) == 1:
        r = np.where(np.abs(places[:, 0]) <= frame.tolerance, 0.0, places[:, 0])
        distinct = 1 + np.count_nonzero(np.diff(np.sort(r)) > frame.tolerance)
        if distinct < _FEWEST_RADII:
            raise InputError(
                f"The base in {samples.source.file_name} has values at {distinct} radii only.",
                cure="Name the axis across the film (vertical; --vertical), or give a finer mesh.",
            )
        return replace(samples, columns={"r": r, **samples.columns})
    require_numbers(samples)  # a mean would leave out what is missing
    columns, note = film_base.average_over_circles(places - np.array(centre), samples.columns)
    return replace(samples, columns=columns, notes=[*samples.notes, *import_notes([note])])


def _require_meaning(
    name: str, section: bool, shear: str | None, centre: tuple[float, float] | None
) -> None:
    """Refuse an option that the mesh gives no meaning to."""
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


def _shear_component(
    mesh: Mesh, frame: film_base.Frame, normal: Component, shear: str | None
) -> Component | None:
    """Return the shear that is asked for, or the one that comes with a stress tensor."""
    if shear is not None:
        component = find_shear(mesh, frame, shear)
        if component.at_points != normal.at_points:
            raise InputError(
                f"In {mesh.source.file_name}, one of {normal.field!r} and {component.field!r} is "
                "given at the nodes and the other in the cells.",
                cure="Give both in the same way.",
            )
        return component
    return find_shear(mesh, frame, normal.field) if normal.tensor else None


def _at_base(
    mesh: Mesh, frame: film_base.Frame, base: film_base.Base, component: Component
) -> tuple[FloatArray, FloatArray]:
    """Return places in the base and the values there: at nodes, or at the middles of sides."""
    radial = list(frame.radial)
    if component.at_points:
        places = frame.points[base.nodes][:, radial]
        return places, mesh.point_data[component.field][base.nodes, component.column]
    blocks = [block for block in base.cells if component.field in block[0].data]
    if not sum(len(cells) for _, cells, _ in blocks):
        raise InputError(
            f"No cell with a value of {component.field!r} has a side on the base in "
            f"{mesh.source.file_name}.",
            cure="Name the position of the base (base; --base), or save the stress at the nodes.",
        )
    places = np.concatenate([middles for _, _, middles in blocks])[:, radial]
    values = [block.data[component.field][cells, component.column] for block, cells, _ in blocks]
    return places, np.concatenate(values)


def _component_note(component: Component, name: str, treatment: str) -> Message:
    text = f"{name}: {component}, {treatment}"
    if not component.at_points:
        text += "; each value is taken at the middle of its cell's side on the base"
    return Message("import", f"{text}.")
