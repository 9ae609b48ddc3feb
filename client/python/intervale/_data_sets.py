"""Data sets: built from volumes or read from .ivm files."""

import os
from typing import NamedTuple

import numpy as np

from . import _intervale
from ._request import check_count, make_request
from ._volumes import Volume, read


class Histogram(NamedTuple):
    """counts: of the samples in each bin; edges: one more than bins, ascending."""

    counts: np.ndarray
    edges: np.ndarray


class DataSet:
    """An interval volume of one range or of every range. Nothing changes it; any threads may use it."""

    def __init__(self, handle):
        self._handle = handle
        for name, value in handle._info.to_dict().items():
            setattr(self, name, value)
        self.affine = np.reshape(self.affine, (3, 4))

    def __repr__(self):
        kind = "every range" if self.range is None else f"range {list(self.range)}"
        return f"<intervale.DataSet {self.name!r}: {' x '.join(map(str, self.dims))} samples, {kind}, {self.updates} updates>"

    def extract(self, range=None, **request):
        """The mesh of these keywords:

        range: (low, high), or a list of up to four; not needed for a data set of one range.
        refine: "boundary" (the surfaces of the range) or "uniform" (its inside, too).
        error: the largest error, in the field's units; error_percent: of the data set's largest error, instead.
        roi: ((x, y, z), (x, y, z)), the only box that is refined. camera: a Camera; refines what it sees.
        max_tets, max_updates: budgets, the most important refinement first.
        channels: names of channels that the mesh brings along.
        """
        return self._handle._extract(make_request(range, **request))

    def save(self, path):
        """Writes an .ivm file: a temporary one, which is then renamed."""
        self._handle.save(os.fspath(path))

    def histogram(self):
        """Of the samples, to choose a range by; None for a data set of one range."""
        found = self._handle._histogram()
        if found is None:
            return None
        least, width, counts = found
        return Histogram(np.array(counts, np.uint64), least + width * np.arange(len(counts) + 1))

    def enclosed_volume(self, low, high):
        """The volume that the closed range encloses, in world units cubed, at once: off by 0.1 % of the box at most. None
        for a data set of one range.
        """
        if low > high:
            raise ValueError(f"a range needs low <= high, not {low} and {high}")
        return self._handle._enclosed_volume(low, high)


def build(volume, range=None, *, refine="boundary", step=None, nan=None, channels=None, progress=None, threads=0):
    """A data set of a volume, of a file that read() reads, by its path, or of what Volume.wrap() takes.

    range: the (low, high) to keep; None: every range. refine: of a range, "boundary" or "uniform". step: distance of the
    values that floats are rounded to; 0: exact. nan: replaces NaN and infinite samples. channels: {name: volume}, other
    fields on the same grid, each whatever volume may be. progress: called with the fraction done. threads: 0: one for
    each core.
    """
    check_count("threads", threads)

    def raw(source):
        if isinstance(source, (str, os.PathLike)):
            source = read(source)
        return (source if isinstance(source, Volume) else Volume.wrap(source))._raw()

    others = [(name, raw(source), None) for name, source in (channels or {}).items()]
    return DataSet(_intervale.build(raw(volume), range, refine, step, nan, others, progress, threads))


def open(path):
    """The data set of an .ivm file."""
    os.stat(path)  # what is not there is FileNotFoundError, as of any other file
    return DataSet(_intervale.open(os.fspath(path)))


def decode(data, name="data set"):
    """The data set of the bytes of an .ivm file."""
    return DataSet(_intervale.decode(bytes(data), name))
