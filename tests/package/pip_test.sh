#!/bin/sh
# pip install ./python: what it installs can be imported, and its version is the program's. The compiled
# part is taken from the build folder, so that nothing is compiled twice.
#
#   pip_test.sh ROOT BUILD_FOLDER PYTHON VERSION
set -eu
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# setuptools writes beside what it installs.
cp -R "$1/python" "$scratch/python"
cp "$1/CMakeLists.txt" "$scratch"
SPLID_BUILD=$2 "$3" -m pip install --quiet --no-build-isolation --no-deps --no-index --root-user-action=ignore \
  --target "$scratch/site" "$scratch/python"
cd "$scratch/site"
said=$(PYTHONPATH=$scratch/site "$3" -c '
import importlib.metadata, splid
assert splid.__file__.startswith("'"$scratch"'"), splid.__file__
assert splid.Config({"source": {"driver": "simulator"}, "pattern": {"file": "interleaved-180-189.json"}})
print(splid.__version__, importlib.metadata.version("splid"))')
if [ "$said" != "$4 $4" ]; then
  echo "FAIL: versions $said were installed instead of $4"
  exit 1
fi
