"""Multiresolution interval volume meshes: the part of a volume whose values lie in a range, as tetrahedra.

    import intervale
    volume = intervale.read("scan.nii.gz")            # or intervale.Volume(array, axes="zyx", spacing=(1, 1, 2))
    data_set = intervale.build(volume)                # of every range of values; a path will do, too
    mesh = data_set.extract(range=(300, 1200), error_percent=1)
    mesh.points, mesh.tets                            # NumPy arrays: (n, 3) float64, (m, 4) uint32

    for state in intervale.connect("ws://127.0.0.1:8080/scan", range=(300, 1200)):
        state.mesh                                    # coarse first, then finer

Positions are in the world that the volume's affine says, lengths in its unit. Ranges are closed, and may be infinite.
Wrong arguments raise ValueError, damaged files FormatError, missing files FileNotFoundError, servers that fail
ConnectionError.
"""

from ._data_sets import DataSet, Histogram, build, decode, open
from ._intervale import Camera, FormatError, Mesh, MeshState, __version__
from ._meshes import Boundary
from ._serve import Server, serve
from ._streams import Stream, connect, data_sets, fetch
from ._volumes import Volume, read, sample

__all__ = ["Boundary", "Camera", "DataSet", "FormatError", "Histogram", "Mesh", "MeshState", "Server", "Stream", "Volume",
           "__version__", "build", "connect", "data_sets", "decode", "fetch", "open", "read", "sample", "serve"]
