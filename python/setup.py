"""pip install ./python: builds the compiled part with the project's own CMake, and what it needs of
splid.

scripts/setup installs the compiler, CMake and the headers. SPLID_JOBS says how many files are
compiled at once (default: as many as the machine has processors). SPLID_BUILD names a folder that
CMake has configured with SPLID_BUILD_PYTHON for this Python; then nothing is compiled twice.
"""

import os
import pathlib
import re
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

if "bdist_wheel" in sys.argv:
    try:
        from setuptools.command import bdist_wheel as _
    except ImportError:
        try:
            import wheel as _
        except ImportError:
            sys.exit(f"{sys.executable} makes no wheels; take Debian's own Python for the virtual "
                     "environment: /usr/bin/python3 -m venv --system-site-packages venv; or leave "
                     "out --no-build-isolation")

ROOT = pathlib.Path(__file__).resolve().parent.parent


class CMakeBuild(build_ext):
    """Lets CMake build and install the module into the package."""

    def build_extension(self, ext):
        package = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve().parent
        folder = os.environ.get("SPLID_BUILD") or self.configured_folder()
        jobs = os.environ.get("SPLID_JOBS", str(os.cpu_count()))
        subprocess.run(["cmake", "--build", folder, "--target", "_splid", "--parallel", jobs],
                       check=True)
        subprocess.run(["cmake", "--install", folder, "--component", "python", "--prefix", package],
                       check=True)


    def configured_folder(self):
        folder = pathlib.Path(self.build_temp).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            ["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", "-Wno-dev",
             "-D", "CMAKE_BUILD_TYPE=Release", "-D", "SPLID_BUILD_PYTHON=ON",
             "-D", "SPLID_BUILD_TESTS=OFF", "-D", "SPLID_BUILD_BENCH=OFF",
             "-D", f"Python_EXECUTABLE={sys.executable}"], check=True)
        return folder


def version():
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"project\(splid VERSION (\S+)", text)[1]


setup(
    name="splid",
    version=version(),
    description="Single-photon lidar: recordings, frames, patterns, scenes",
    license="Apache-2.0",
    packages=["splid"],
    package_data={"splid": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("splid._splid", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
    python_requires=">=3.11",
    install_requires=["numpy"],
    extras_require={"listen": ["pyzmq"], "plots": ["matplotlib"]},
)
