"""Save closed-form numbers with VTK as ParaView does: compressed, in appended raw bytes.

Needs the package vtk; nothing of memscal is in it.  In mm and MPa: a section with a stress
tensor whose component yy carries 1 N at the base, and the stress in the cells.
"""

import sys

import numpy as np


def main(path):
    """Make the mesh and save it."""
    import vtk

    radii = np.linspace(0.0, 8.0, 41)
    heights = np.linspace(0.0, 2.0, 4)
    r, z = (each.ravel() for each in np.meshgrid(radii, heights))
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for place in zip(r, z, np.zeros_like(r), strict=True):
        points.InsertNextPoint(place)
    grid.SetPoints(points)
    across = radii.size
    for first in np.flatnonzero((r < radii[-1]) & (z < heights[-1])):
        corners = [first, first + 1, first + 1 + across, first + across]
        grid.InsertNextCell(vtk.VTK_QUAD, 4, [int(each) for each in corners])
    stress = np.zeros((r.size, 6))
    stress[:, 1] = -np.exp(-(r**2) / 2) / (2 * np.pi) * (1 + z)
    stress[:, 3] = r * stress[:, 1] / 4
    add(grid.GetPointData(), "S", stress)
    middle = (radii[1:] + radii[:-1]) / 2
    each = -np.exp(-(middle**2) / 2) / (2 * np.pi)
    add(grid.GetCellData(), "S33", np.tile(each, heights.size - 1))
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(path)
    writer.SetInputData(grid)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetBlockSize(4096)
    writer.Write()


def add(place, name, values):
    """Add a field."""
    from vtk.util.numpy_support import numpy_to_vtk

    array = numpy_to_vtk(values, deep=True)
    array.SetName(name)
    place.AddArray(array)


if __name__ == "__main__":
    main(sys.argv[1])
