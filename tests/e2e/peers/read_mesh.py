"""Reads mesh files with VTK and with meshio, and holds them against what `extract --json` said of them.

    read_mesh.py MESH.vtu MESH.vtp VERTICES TETS VOLUME

Says what is wrong on stdout, a line each. Needs Debian's python3-vtk9 and python3-meshio.
"""
import sys

import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def check(what, got, expected):
    if not np.array_equal(got, expected):
        print(f"{what}: {got}, expected {expected}")


def read(reader, path):
    reader.SetFileName(path)
    reader.Update()
    check(f"{path}: VTK's error code", reader.GetErrorCode(), 0)
    return reader.GetOutput()


def points_of(data):
    return vtk_to_numpy(data.GetPoints().GetData()) if data.GetNumberOfPoints() else np.zeros((0, 3))


def rows(array, width):
    return vtk_to_numpy(array).reshape(-1, width) if array.GetNumberOfValues() else np.zeros((0, width), np.int64)


def six_volumes(a, b, c, d):
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)


vtu, vtp, vertices, tets, volume = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5])

grid = read(vtk.vtkXMLUnstructuredGridReader(), vtu)
check("points", grid.GetNumberOfPoints(), vertices)
check("cells", grid.GetNumberOfCells(), tets)
check("cells that are no tetrahedra", sum(grid.GetCellType(i) != vtk.VTK_TETRA for i in range(tets)), 0)
points, corners = points_of(grid), rows(grid.GetCells().GetConnectivityArray(), 4)
check("type of the points", points.dtype, np.float64)
six = six_volumes(*(points[corners[:, i]] for i in range(4)))
check("inverted tetrahedra", int((six <= 0).sum()), 0)
check("volume", abs(six.sum() / 6 - volume) <= 1e-9 * volume, True)
surface = grid.GetPointData().GetArray("surface")
check("type of surface", surface.GetDataType(), vtk.VTK_UNSIGNED_CHAR)
surface = vtk_to_numpy(surface) if vertices else np.zeros(0, np.uint8)
check("values of surface", np.setdiff1d(surface, (0, 1, 2)), [])

if tets:
    mesh = meshio.read(vtu)
    check("meshio's points", mesh.points, points)
    check("meshio's cells", [(cells.type, len(cells.data)) for cells in mesh.cells], [("tetra", tets)])
    check("meshio's corners", mesh.cells[0].data, corners)
    check("meshio's surface", mesh.point_data["surface"], surface)

# The boundary of the tetrahedra has their volume, by the divergence theorem.
boundary = read(vtk.vtkXMLPolyDataReader(), vtp)
check("cells of the boundary", boundary.GetNumberOfCells() > 0, tets > 0)
check("cells of the boundary that are no triangles", boundary.GetNumberOfCells() - boundary.GetNumberOfPolys(), 0)
points, corners = points_of(boundary), rows(boundary.GetPolys().GetConnectivityArray(), 3)
enclosed = six_volumes(np.zeros((len(corners), 3)), *(points[corners[:, i]] for i in range(3))).sum() / 6
check("volume within the boundary", abs(enclosed - volume) <= 1e-9 * volume, True)
