#!/bin/sh
# What `cmake --install` puts below /usr/local: the program on the PATH, its man page and completion, units that
# name it where it is, and the Python module where that was built; and all that the pages tell to copy or to start.
#
#   install_test.sh BUILD_FOLDER
set -eu
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
fail() {
  echo "FAIL: $*"
  exit 1
}

DESTDIR=$scratch cmake --install "$1" --prefix /usr/local >"$scratch/log" 2>&1 || fail "$(cat "$scratch/log")"
local=$scratch/usr/local
for file in share/man/man1/splid.1.gz share/bash-completion/completions/splid share/splid/demo.json \
  share/splid/patterns lib/udev/rules.d/60-splid.rules lib/sysusers.d/splid.conf; do
  [ -e "$local/$file" ] || fail "$file is not installed"
done
[ -f "$scratch/etc/splid/splid.json" ] || fail "the service's configuration is not installed"
for unit in splid.service splid-view.service splid-bridge@.service splid-forward@.service; do
  grep -q '^ExecStart=/usr/local/bin/splid ' "$local/lib/systemd/system/$unit" || fail "$unit starts another program"
  ! grep -E '/usr/(bin/splid|share)' "$local/lib/systemd/system/$unit" || fail "$unit names another place"
done

# What the pages name below /usr is there, and starts where a line of theirs begins with it.
pages=$(dirname "$0")/../../docs
for file in $(grep -rhoE --include='*.md' '/usr/(share|lib)/[A-Za-z0-9/_.-]*[a-z0-9]' "$pages" | sort -u); do
  [ -e "$local${file#/usr}" ] || fail "$file is not installed, which a page names"
done
for file in $(grep -rhoE --include='*.md' '^    /usr/(share|lib)/[^ ]+' "$pages" | sort -u); do
  [ -x "$local${file#/usr}" ] || fail "$file cannot be started, as a page does"
done

cd "$scratch"
PATH=$local/bin:$PATH
splid --version >version || fail "splid does not run"
splid pattern periodic --output one.json 2>log || fail "$(cat log)"
splid check one.json >/dev/null || fail "splid check does not run"
module=$(find "$local/lib" -path '*/dist-packages/splid' 2>/dev/null || true)
[ -z "$module" ] || PYTHONPATH=$(dirname "$module") /usr/bin/python3 -c '
import splid, splid.plots
assert splid.__file__.startswith("'"$scratch"'"), splid.__file__
' || fail "the Python module does not work"
[ -n "$module" ] || ! ls "$1"/python/splid/_splid*.so 2>/dev/null || fail "the Python module is not installed"
