#!/bin/sh
# Has systemd judge the unit before it is ever started.
#
#   unit_test.sh verify|security UNIT SPLID
#
# verify: no word of complaint; the program that it starts is the one built, not one installed.
# security: an exposure of at most 1.5 of 10. Exit code 77 where there is no systemd-analyze.
set -eu
command -v systemd-analyze >/dev/null || {
  echo "skipped: systemd-analyze is not installed"
  exit 77
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# Of a template, one that it makes.
unit=$scratch/$(basename "$2" | sed 's/@[.]/@picoquant./')
sed "s|/usr/bin/splid|$3|" "$2" >"$unit"

case "$1" in
  verify)
    # No man page is installed here.
    systemd-analyze verify --man=no "$unit" >"$scratch/said" 2>&1 || echo "exit code $?"
    cat "$scratch/said"
    [ ! -s "$scratch/said" ]
    ;;
  security) systemd-analyze security --offline=true --threshold=15 --no-pager "$unit" ;;
esac
