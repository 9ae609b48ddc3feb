"""Meshes from a server, coarse to fine."""

import asyncio
import json

import numpy as np

from . import _intervale
from ._request import make_request


class Stream:
    """A mesh that refines. A thread receives; iterate over it for states of the mesh, each finer than the one before,
    until all that was asked for is here:

        with intervale.connect(url, range=(128, 188)) as stream:
            for state in stream: draw(state.mesh)
            stream.set_range(100, 150)
            for state in stream: draw(state.mesh)

    `async for` does the same without blocking the event loop.
    """

    def __init__(self, handle, request):
        self._handle, self._request = handle, request
        self._state = None
        for name, value in handle._info.to_dict().items():
            setattr(self, name, value)
        self.affine = np.reshape(self.affine, (3, 4))

    def look(self, **request):
        """Changes these keywords of what is asked for (see DataSet.extract), and keeps the others. Nothing is received
        twice.
        """
        request = {**self._request, **request}
        self._handle.look(make_request(**request))
        self._request, self._state = request, None

    def set_range(self, low, high):
        """Asks for another range."""
        self.look(range=(low, high))

    @property
    def is_done(self):
        """All that was asked for is here, and was seen."""
        return self._state is not None and self._state.is_done

    @property
    def mesh(self):
        """The last mesh that was seen; None before the first."""
        return self._state and self._state.mesh

    def wait(self, seconds=None):
        """The next state; None if there is none within that time. Without a time it waits for one."""
        left = float("inf") if seconds is None else float(seconds)
        while True:  # in short pieces, so that Ctrl-C works
            state = self._handle.wait(max(0.0, min(left, 0.2)))
            left -= 0.2
            if state is not None:
                self._state = state
            if state is not None or left <= 0:
                return state

    def __iter__(self):
        while not self.is_done:
            yield self.wait()

    async def __aiter__(self):
        loop = asyncio.get_running_loop()
        while not self.is_done:
            state = await loop.run_in_executor(None, self.wait, 0.2)
            if state is not None:
                yield state

    def finish(self):
        """The mesh with all that was asked for."""
        for _ in self:
            pass
        return self.mesh

    def close(self):
        """Ends the connection. The meshes stay."""
        self._handle.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def connect(url, range=None, *, token=None, ca=None, reconnect=30, prefetch_ranges=False, **request):
    """Connects to a data set of a server: ws://HOST:PORT/NAME, or wss://. The keywords are those of DataSet.extract().

    token: for a server that asks for one. ca: a file of certificates (PEM) to trust instead of the system's. reconnect:
    seconds to try to reach a lost server again. prefetch_ranges: when all is here, ask for every other range coarsely,
    too, so that a change of range finds something at once.
    """
    request = {"range": range, **request}
    return Stream(_intervale.connect(url, make_request(**request), token, ca, reconnect, prefetch_ranges), request)


def fetch(url, range=None, **keywords):
    """The whole mesh, by connect()."""
    with connect(url, range, **keywords) as stream:
        return stream.finish()


def data_sets(url, *, token=None, ca=None):
    """What a server has, as a list of dictionaries: name, dims, values or range, and more."""
    return json.loads(_intervale.list_data_sets(url, token, ca))["datasets"]
