#!/bin/sh
# The pages that people read: no line of prose has more than 120 columns, and every link between pages
# leads to a file that is there. Tables, code and pictures may be wider, as they cannot be broken.
#
#   pages_test.sh ROOT     ROOT: the source tree
set -eu
cd "$1"
LC_ALL=C.UTF-8
export LC_ALL
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0

for page in *.md docs/*.md docs/*/*.md docs/*/*/*.md; do
  # Code between fences becomes empty lines, so that line numbers stay.
  awk '/^```/ { code = !code; print ""; next } { print code ? "" : $0 }' "$page" >"$scratch/prose"
  if grep -nE '^.{121}' "$scratch/prose" | grep -vE '^[0-9]+:(\||    |!\[)' >"$scratch/wide"; then
    sed "s|^|FAIL: more than 120 columns: $page:|" "$scratch/wide"
    failed=1
  fi
  grep -oE '\]\([^)]+\)' "$scratch/prose" | sed -E 's/^\]\(//; s/\)$//; s/#.*//' |
    grep -vE '^([a-z]+:.*)?$' >"$scratch/links" || true
  while read -r link; do
    if [ ! -e "$(dirname "$page")/$link" ]; then
      echo "FAIL: $page links to $link, which is not there"
      failed=1
    fi
  done <"$scratch/links"
done
exit "$failed"
