#!/bin/sh
# The package python3-splid, as it would be installed: it holds the module, its patterns and its
# documentation, asks for what the module needs, and the module in it can be imported and works.
#
#   python_package_test.sh BUILD_FOLDER PYTHON
#
# Exit code 77 where dpkg is not installed.
set -eu
command -v dpkg-deb >/dev/null || {
  echo "skipped: dpkg-deb is not installed"
  exit 77
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
fail() {
  echo "FAIL: $*"
  exit 1
}

cpack --config "$1/CPackPython.cmake" -B "$scratch" >"$scratch/log" 2>&1 || fail "$(cat "$scratch/log")"
package=$(find "$scratch" -maxdepth 1 -name 'python3-splid_*.deb')
[ -n "$package" ] || fail "no package was made: $(cat "$scratch/log")"
dpkg-deb --extract "$package" "$scratch/root"
for needed in python3-numpy libnlopt; do
  dpkg-deb --field "$package" Depends | grep -q "$needed" || fail "it does not ask for $needed"
done
# Nothing of what only the service needs.
if dpkg-deb --field "$package" Depends | grep -E 'libzmq|libsystemd|libhdf5|microhttpd'; then
  fail "it asks for what only the service needs"
fi
for file in copyright changelog.Debian.gz python.md notebooks/recording.ipynb; do
  [ -f "$scratch/root/usr/share/doc/python3-splid/$file" ] || fail "it has no $file"
done
[ -d "$scratch/root/usr/lib/python3/dist-packages/splid/patterns" ] || fail "it has no patterns"

cd "$scratch"
PYTHONPATH=$scratch/root/usr/lib/python3/dist-packages "$2" -c '
import splid, splid.plots
assert splid.__file__.startswith("'"$scratch"'"), splid.__file__
config = splid.Config({"source": {"driver": "simulator", "pace": "max"},
                                 "pattern": {"file": "interleaved-180-189.json"}})
assert len(splid.frames(splid.simulate(config, 0.12).tags, config)) >= 2
' || fail "the module in the package does not work"
