"""Checked by mypy, not run: what a typed program says of the package."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import intervale


def volume_of(url: str) -> float:
    camera = intervale.Camera(eye=(0, 0, 3), look_at=(0, 0, 0), pixel_error=2)
    with intervale.connect(url, (1.0, 2.0), camera=camera) as stream:
        for state in stream:
            points: NDArray[np.float64] = state.mesh.points
            assert points.shape[1] == 3
        stream.set_range(1, 3)
        return stream.finish().volume


def built(array: NDArray[Any]) -> intervale.DataSet:
    data_set = intervale.build(intervale.Volume(array, spacing=(1, 1, 2), unit="mm"), progress=print)
    intervale.build(Path("scan.nrrd"), range=(1, 2), channels={"flow": "flow.nrrd"})
    mesh = data_set.extract([(1, 2), (3, 4)], error_percent=1, channels=["flow"])
    mesh.save("mesh.vtu")
    return data_set


def corner_of(path: Path) -> tuple[intervale.Volume, str]:
    corner = intervale.read(path, part="1", crop=((0, 31), (0, 31), (0, 31)))
    return intervale.Volume(corner.array, affine=corner.affine, space=corner.space), intervale.build(corner).space
