"""What the tests of packages share: a server of a build, and commands whose output is wanted."""

import contextlib
import re
import subprocess
import time


def run(*words, **options):
    """The stdout of a command that must succeed."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=600, **options)
    assert done.returncode == 0, f"{' '.join(map(str, words))}: status {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def digest_in(text):
    """The digest of a mesh that a program printed."""
    found = re.search(r"^digest ([0-9a-f]{32})$", text, re.M)
    assert found, f"no digest in: {text}"
    return found.group(1)


@contextlib.contextmanager
def serving(program, *words):
    """`intervale serve` on a free port; its address."""
    server = subprocess.Popen([str(program), "serve", *map(str, words), "--listen", "127.0.0.1:0"], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
    try:
        lines = []
        end = time.monotonic() + 30
        while time.monotonic() < end:
            line = server.stdout.readline()
            if not line:
                break
            lines.append(line)
            if found := re.search(r"127\.0\.0\.1:(\d+)", line):
                yield f"127.0.0.1:{found.group(1)}"
                return
        raise AssertionError(f"the server did not start: {''.join(lines)}")
    finally:
        server.terminate()
        server.wait(30)
