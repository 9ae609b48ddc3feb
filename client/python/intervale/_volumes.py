"""Volumes: from files, arrays, and the images of other packages."""

import operator
import os
import sys

import numpy as np

from . import _intervale


class Volume:
    """A regular grid of samples.

    array: NumPy, z, y, x (and the three components of vectors last), contiguous, of integers of 8, 16 or 32 bits or
    floats of 32 or 64 bits; a view of what was given where possible. affine: 3 x 4, from sample (i, j, k) on x, y, z to
    the world. unit: of length; field, field_unit: what the values are; space: where the axes of the world point to, such
    as "RAS" (right, anterior, superior) or "LPS"; empty if not known.
    """

    def __init__(self, array, axes="zyx", spacing=None, origin=None, direction=None, affine=None, unit="", name="volume",
                 field="", field_unit="", space=""):
        """axes: what the array's axes are, such as "zyx" or "xyz"; components of vectors come last, without a letter.
        spacing, origin: x, y, z, whatever the axes; default 1 and 0. direction: 3 x 3, its columns are the directions of
        x, y and z. affine: 3 x 4 or 4 x 4, instead of those three.
        """
        if isinstance(array, (str, os.PathLike)):
            raise TypeError(f"{os.fspath(array)!r} is no array or image: intervale.read() reads files")
        array = np.asanyarray(array)
        if sorted(axes) != ["x", "y", "z"] or array.ndim not in (3, 4):
            raise ValueError(f"axes names x, y and z of an array of three axes (four of vectors), not {axes!r} of {array.ndim}")
        order = [axes.index(axis) for axis in "zyx"] + list(range(3, array.ndim))
        array = array.transpose(order)
        if array.dtype == bool:
            array = array.view(np.uint8)
        self.array = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
        if affine is None:
            columns = np.eye(3) if direction is None else np.asarray(direction, float).reshape(3, 3)
            steps = np.ones(3) if spacing is None else np.asarray(spacing, float).reshape(3)
            first = np.zeros(3) if origin is None else np.asarray(origin, float).reshape(3)
            self.affine = np.column_stack([columns * steps, first])
        elif spacing is None and origin is None and direction is None:
            self.affine = np.asarray(affine, float)[:3, :4].copy()
        else:
            raise ValueError("affine says what spacing, origin and direction say: give one or the other")
        if self.affine.shape != (3, 4):
            raise ValueError("affine is 3 x 4 or 4 x 4")
        self.unit, self.name, self.field, self.field_unit, self.space = unit, name, field, field_unit, space

    @classmethod
    def wrap(cls, image, **more):
        """An image of SimpleITK, nibabel, VTK, PyVista or xarray, or whatever NumPy takes for an array. more: arguments
        of Volume that take the place of what the image says. The space of nibabel's images is RAS, of SimpleITK's LPS,
        and of neither if more says where the samples lie. Files are for read().
        """
        if hasattr(image, "GetDirection") and hasattr(image, "GetSpacing") and hasattr(image, "GetPixelIDValue"):
            array = sys.modules["SimpleITK"].GetArrayViewFromImage(image)
            found = {"spacing": image.GetSpacing(), "origin": image.GetOrigin(), "direction": image.GetDirection(),
                     "space": "LPS"}
        elif hasattr(image, "dataobj") and hasattr(image, "affine"):  # nibabel
            array = np.asanyarray(image.dataobj)
            found = {"axes": "xyz", "affine": image.affine, "unit": "mm", "space": "RAS"}
        elif hasattr(image, "GetPointData") and hasattr(image, "GetDimensions"):  # VTK and PyVista
            array, found = _from_vtk(image)
        elif hasattr(image, "dims") and hasattr(image, "coords"):  # xarray
            array, found = _from_xarray(image)
        else:
            array, found = image, {}
        if any(name in more for name in ("spacing", "origin", "direction", "affine")):
            for name in ("spacing", "origin", "direction", "affine", "space"):
                found.pop(name, None)
        return cls(array, **{**found, **more})

    @property
    def spacing(self):
        """The distances from a sample to the next on x, y and z."""
        return tuple(np.linalg.norm(self.affine[:, :3], axis=0))

    @property
    def origin(self):
        """The world position of the first sample."""
        return tuple(self.affine[:, 3])

    def __repr__(self):
        z, y, x = self.array.shape[:3]
        return f"<intervale.Volume {self.name!r}: {x} x {y} x {z} samples of {self.array.dtype}>"

    def _raw(self):
        return _intervale.RawVolume(self.array, self.affine.ravel().tolist(), self.name, self.unit, self.field,
                                    self.field_unit, self.space)

    @classmethod
    def _of(cls, raw):
        return cls(raw.array, affine=np.reshape(raw.affine, (3, 4)), unit=raw.unit, name=raw.name, field=raw.field,
                   field_unit=raw.field_unit, space=raw.space)


def _from_vtk(image):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    scalars = image.GetPointData().GetScalars() or image.GetPointData().GetArray(0)
    if scalars is None:
        raise ValueError("the image has no array of its points")
    array = vtk_to_numpy(scalars).reshape(*reversed(image.GetDimensions()), -1)
    if array.shape[3] == 1:
        array = array[..., 0]
    matrix = image.GetDirectionMatrix() if hasattr(image, "GetDirectionMatrix") else None
    direction = [[matrix.GetElement(i, j) for j in range(3)] for i in range(3)] if matrix else np.eye(3)
    first = [image.GetExtent()[2 * i] for i in range(3)]
    columns = np.asarray(direction) * image.GetSpacing()
    return array, {"affine": np.column_stack([columns, image.GetOrigin() + columns @ first]), "field": scalars.GetName() or ""}


def _from_xarray(image):
    axes = "".join(str(name)[-1].lower() for name in image.dims[:3])
    spacing, origin = {}, {}
    for axis, name in zip(axes, image.dims):
        places = np.asarray(image.coords[name], float) if name in image.coords else np.arange(image.sizes[name], dtype=float)
        steps = np.diff(places)
        if len(steps) == 0 or not np.allclose(steps, steps[0], rtol=1e-3, atol=0):
            raise ValueError(f"the coordinates of {name!r} are not evenly spaced")
        spacing[axis], origin[axis] = steps.mean(), places[0]
    if sorted(axes) != ["x", "y", "z"]:
        raise ValueError(f"the dimensions {image.dims} are not named z, y and x")
    affine = np.column_stack([np.diag([spacing[axis] for axis in "xyz"]), [origin[axis] for axis in "xyz"]])
    return image.values, {"axes": axes, "affine": affine, "field": str(image.name or ""),
                          "field_unit": str(image.attrs.get("units", ""))}


def read(path, part=None, time_point=None, crop=None):
    """The volume of a file or folder: NRRD, NIfTI, MetaImage, MRC, NumPy, VTK, TIFF, DICOM, HDF5 ("file.h5:/array") or
    Zarr. part: which series, channel or array of several, by name. time_point: of several, from 0. crop: ((i0, i1),
    (j0, j1), (k0, k1)), the first and last sample to keep on x, y and z, both included; only they are in memory, and they
    stay where they are in the world.
    """
    if crop is not None:
        crop = [tuple(map(operator.index, ends)) for ends in crop]
        if [len(ends) for ends in crop] != [2, 2, 2]:
            raise ValueError("crop is ((i0, i1), (j0, j1), (k0, k1)): the first and last sample on x, y and z")
    path, part = _intervale.named_volume(path, part)
    os.stat(path)  # what is not there is FileNotFoundError, as of any other file
    return Volume._of(_intervale.read(path, part, time_point, crop))


def sample(name, size=129):
    """A volume made by formula: buckyball, gyroid, marschner-lobb or hydrogen, over [-1, 1] on each axis."""
    return Volume._of(_intervale.sample(name, size))
