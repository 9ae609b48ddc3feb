"""A server for a notebook: the program `intervale serve`."""

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from ._data_sets import DataSet


class Server:
    """A running `intervale serve`. In Jupyter it shows itself: the viewer in a frame. close() ends it, and so does the end
    of Python. url: of the viewer; address: for connect(), without a data set's name.
    """

    def __init__(self, process, port, host, folder):
        self._process, self._folder = process, folder
        self.url, self.address = f"http://{host}:{port}/", f"ws://{host}:{port}"

    def close(self):
        """Ends the server."""
        if self._process.poll() is None:
            self._process.terminate()
            self._process.wait(30)
        self._process.stdout.close()
        if self._folder:
            self._folder.cleanup()
            self._folder = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        self.close()

    def _repr_html_(self):
        return f'<iframe src="{self.url}" width="100%" height="600" style="border:0"></iframe>'


def serve(*sources, host="127.0.0.1", port=0, program=None):
    """Serves .ivm files, folders of them, and DataSets, and returns at once. port 0: a free one. program: the path of
    `intervale`; by default that on the PATH, or in $INTERVALE_PROGRAM.
    """
    program = program or os.environ.get("INTERVALE_PROGRAM") or shutil.which("intervale")
    if not program:
        raise FileNotFoundError("the program intervale is not on the PATH: name it with program= or $INTERVALE_PROGRAM")
    folder, paths = None, []
    for source in sources:
        if not isinstance(source, DataSet):
            paths.append(os.fspath(source))
            continue
        folder = folder or tempfile.TemporaryDirectory()
        paths.append(str(Path(folder.name) / f"{re.sub(r'[^A-Za-z0-9_.-]', '_', source.name) or 'data_set'}.ivm"))
        source.save(paths[-1])
    process = subprocess.Popen([program, "serve", *paths, "--listen", f"{host}:{port}"], stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True)
    lines = []
    for line in process.stdout:
        lines.append(line.rstrip())
        if found := re.search(rf"{re.escape(host)}:(\d+)", line):
            return Server(process, int(found.group(1)), host, folder)
    process.wait()
    process.stdout.close()
    if folder:
        folder.cleanup()
    raise OSError(f"the server did not start: {' '.join(lines)}")
