"""Meshes as those of other packages. Mesh itself is C++; this adds what is convenient."""

from typing import NamedTuple

import numpy as np

from ._intervale import Mesh


class Boundary(NamedTuple):
    """The boundary of a mesh: points (n, 3), triangles (m, 3), counterclockwise seen from outside; indices: which points of
    the mesh they are, so that mesh.value[indices] are their values.
    """

    points: np.ndarray
    triangles: np.ndarray
    indices: np.ndarray


def boundary(mesh):
    """The triangles that belong to one tetrahedron only, with their own points."""
    indices, triangles = mesh._boundary()
    return Boundary(mesh.points[indices], triangles, indices)


def _arrays(mesh):
    """Of the points, by name."""
    arrays = {"surface": mesh.surface}
    if len(mesh.value):
        arrays["value"] = mesh.value
    return {**arrays, **mesh.channels}


def to_vtk(mesh):
    """A vtkUnstructuredGrid with the arrays surface, value and those of channels, and range of several."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkUnstructuredGrid

    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(mesh.points), deep=True))
    cells = vtkCellArray()
    count = len(mesh.tets)
    cells.SetData(numpy_to_vtkIdTypeArray(np.arange(0, 4 * count + 1, 4, dtype=np.int64), deep=True),
                  numpy_to_vtkIdTypeArray(mesh.tets.ravel().astype(np.int64), deep=True))
    grid = vtkUnstructuredGrid()
    grid.SetPoints(points)
    grid.SetCells(VTK_TETRA, cells)
    data = [(grid.GetPointData(), name, array) for name, array in _arrays(mesh).items()]
    if mesh.part is not None:
        data.append((grid.GetCellData(), "range", mesh.part))
    for target, name, array in data:
        converted = numpy_to_vtk(np.ascontiguousarray(array), deep=True)
        converted.SetName(name)
        target.AddArray(converted)
    return grid


def to_pyvista(mesh):
    """A pyvista.UnstructuredGrid of to_vtk()."""
    import pyvista

    return pyvista.wrap(to_vtk(mesh))


def to_meshio(mesh):
    """A meshio.Mesh."""
    import meshio

    cell_data = {} if mesh.part is None else {"range": [mesh.part]}
    return meshio.Mesh(mesh.points, [("tetra", mesh.tets)], point_data=_arrays(mesh), cell_data=cell_data)


def to_trimesh(mesh):
    """The boundary as a trimesh.Trimesh."""
    import trimesh

    surface = boundary(mesh)
    return trimesh.Trimesh(surface.points, surface.triangles, process=False)


def _repr(mesh):
    return f"<intervale.Mesh: {len(mesh.points)} points, {len(mesh.tets)} tetrahedra>"


for _function in (boundary, to_vtk, to_pyvista, to_meshio, to_trimesh):
    setattr(Mesh, _function.__name__, _function)
Mesh.__repr__ = _repr
