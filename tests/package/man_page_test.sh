#!/bin/sh
# The man page has an entry for every command that splid --help lists, and for no other.
#
#   man_page_test.sh MAN_PAGE SPLID
set -eu
listed=$("$2" --help | sed -n '/^Subcommands:/,$ s/^  \([a-z][^ ]*\).*/\1/p' | LC_ALL=C sort)
# ".BI "run \-\-config ..." and ".BR devices ..." after a .TP, in the section of commands
described=$(sed -n '/^\.SH COMMANDS/,/^\.SH EXIT/ s/^\.B[IR] "*\([a-z]*\)[ "].*/\1/p' "$1" |
  LC_ALL=C sort)
if [ -z "$listed" ] || [ "$listed" != "$described" ]; then
  printf 'FAIL: splid --help lists\n%s\nthe man page describes\n%s\n' "$listed" "$described"
  exit 1
fi
