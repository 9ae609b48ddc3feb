"""Makes the wheel: python3 -m build --wheel --no-isolation client/python

CMake compiles what is C++, in a folder of its own, or in $INTERVALE_BUILD, a build that exists.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parents[2]
VERSION = re.search(r"project\(intervale VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)


class CMakeBuild(build_ext):
    """Copies the package that CMake builds."""

    def build_extension(self, ext):
        with tempfile.TemporaryDirectory() as folder:
            build = os.environ.get("INTERVALE_BUILD") and Path(os.environ["INTERVALE_BUILD"]).resolve()
            if not build:
                build = folder
                subprocess.run(["cmake", "-S", ROOT, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DINTERVALE_TESTS=OFF",
                                "-DINTERVALE_VIEWER=OFF", "-DINTERVALE_PYTHON_PACKAGE=ON", f"-DPython3_EXECUTABLE={sys.executable}"], check=True)
            subprocess.run(["cmake", "--build", build, "--target", "intervale_python"], check=True)
            target = Path(self.get_ext_fullpath(ext.name)).parent
            shutil.copytree(Path(build) / "python" / "intervale", target, dirs_exist_ok=True,
                            ignore=shutil.ignore_patterns("__pycache__"))


setup(version=VERSION, ext_modules=[Extension("intervale._intervale", [])], cmdclass={"build_ext": CMakeBuild},
      package_data={"intervale": ["py.typed", "*.pyi"]})
