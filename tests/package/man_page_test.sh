#!/bin/sh
# The man page, as a reader sees it, has an entry for every command that splid --help lists, and for no
# other; the command lines are well formed, and their options are those that the command's --help
# knows.
#
#   man_page_test.sh MAN_PAGE SPLID
set -eu
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0
fail() {
  echo "FAIL: $*"
  failed=1
}

groff -man -Tascii -P-c -P-b -P-o -P-u -rLL=200n -ww "$1" >"$scratch/page" 2>"$scratch/complaints"
[ ! -s "$scratch/complaints" ] || fail "groff: $(cat "$scratch/complaints")"

sed -n '/^COMMANDS/,/^EXIT/ s/^       \([a-z]\)/\1/p' "$scratch/page" >"$scratch/lines"
listed=$("$2" --help | sed -n '/^Subcommands:/,$ s/^  \([a-z][^ ]*\).*/\1/p' | LC_ALL=C sort)
described=$(cut -d ' ' -f 1 "$scratch/lines" | LC_ALL=C sort)
if [ -z "$listed" ] || [ "$listed" != "$described" ]; then
  fail "splid --help lists
$listed
the man page describes
$described"
fi

while read -r line; do
  # Each [ ends, has a word next to it and a space before it; nothing is quoted.
  case "$line" in
    *\"* | *\\* | *'[ '* | *' ]'*) fail "the man page shows: $line" ;;
  esac
  rest=$(echo "$line" | sed -E ':again; s/ \[[^][]+\]//; t again')
  case "$rest" in
    *'['* | *']'*) fail "the man page's brackets do not match: $line" ;;
  esac
  # "pattern interleaved|random ...": what the first of them takes
  command=$(echo "$line" | sed -E 's/^([a-z]+)( [a-z]+[| ])?.*/\1\2/; s/[| ]$//')
  # shellcheck disable=SC2086
  "$2" $command --help >"$scratch/help"
  for option in $(echo "$line" | grep -oE -e '--[a-z-]+' || true); do
    grep -qE -e "$option([ ,=]|\$)" "$scratch/help" || fail "no $option in splid $command --help"
  done
done <"$scratch/lines"
exit "$failed"
