"""The installed C++ package: cpp_test.py BUILD EXAMPLES, or cpp_test.py --installed PREFIX EXAMPLES

Installs BUILD into an empty prefix, unless there is a prefix; builds the examples against it, with CMake and with
pkg-config, and compares the meshes that they make with those of the programs.
"""

import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

from support import digest_in, run, serving

IS_INSTALLED = sys.argv[1] == "--installed"
PLACE, EXAMPLES = map(Path, sys.argv[-2:])  # PLACE: the build, or the prefix


def check_symbols(prefix):
    """The libraries show symbols of ours only."""
    libraries = [path for path in prefix.rglob("libintervale-*.so") if path.is_symlink()]
    assert len(libraries) == 3, libraries
    for library in libraries:
        for line in run("nm", "-DC", "--defined-only", library).splitlines():
            name = line.split(maxsplit=2)[2]
            assert re.match(r"(typeinfo (name )?for |vtable for |guard variable for )?intervale::", name), f"{library.name} shows {name}"


def check_view(program, url, folder):
    """The window's picture has both surfaces of the shell."""
    if not shutil.which("xvfb-run"):
        return print("refining_view is not run: xvfb-run is missing")
    picture = folder / "view.ppm"
    out = run("xvfb-run", "-a", program, url, 10, 20, picture)
    assert out.splitlines()[-1].endswith(", done"), out
    header, pixels = picture.read_bytes().split(b"255\n", 1)
    width, height = map(int, header.split()[1:3])
    assert len(pixels) == 3 * width * height
    white = pixels.count(b"\xff\xff\xff")
    assert 0.2 * width * height < white < 0.95 * width * height, f"{white} white pixels of {width} x {height}"


def main(folder):
    prefix, examples = PLACE if IS_INSTALLED else folder / "prefix", folder / "examples"
    if not IS_INSTALLED:
        run("cmake", "--install", PLACE, "--prefix", prefix)
    check_symbols(prefix)

    environment = {name: text for name, text in os.environ.items() if not name.startswith(("CMAKE", "PKG_CONFIG"))}
    run("cmake", "-S", EXAMPLES, "-B", examples, f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=Release",
        "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror", env=environment)
    run("cmake", "--build", examples, env=environment)

    ball, mesh = folder / "ball.ivm", folder / "ball.vtu"
    built = run(examples / "build_and_extract", ball, mesh)
    assert mesh.stat().st_size > 10000
    intervale, client = prefix / "bin" / "intervale", prefix / "bin" / "intervale-client"
    request = ["--range", "10", "20", "--error-percent", "0.1", "--digest"]
    assert digest_in(built) == digest_in(run(intervale, "extract", ball, *request))

    extracted = run(examples / "extract_to_file", ball, 10, 20, 0.1, mesh)
    assert digest_in(extracted) == digest_in(built)
    needed = run("readelf", "-d", examples / "extract_to_file")
    assert "libintervale-core" in needed and "libintervale-builder" not in needed, needed

    # The same with pkg-config.
    folder_of_pc = next(prefix.rglob("intervale-client.pc")).parent
    environment["PKG_CONFIG_PATH"] = str(folder_of_pc)
    flags = run("pkg-config", "--cflags", "--libs", "intervale-client", env=environment).split()
    by_hand = folder / "fetch_by_hand"
    run("c++", "-std=c++20", EXAMPLES / "fetch_to_arrays.cpp", "-o", by_hand, *flags, f"-Wl,-rpath,{folder_of_pc.parent}")

    with serving(intervale, ball) as address:
        url = f"ws://{address}/ball"
        expected = digest_in(run(client, "fetch", url, *request))
        for program in (examples / "fetch_to_arrays", by_hand):
            assert digest_in(run(program, url, 10, 20, 0.1)) == expected
        if (examples / "refining_view").exists():
            check_view(examples / "refining_view", url, folder)
        else:
            print("refining_view was not built")
    print("the package works")


with tempfile.TemporaryDirectory() as name:
    main(Path(name))
