#!/bin/sh
# The pages that people read: no line of prose has more than 120 columns, and every link between pages
# leads to a file and a heading that are there. So is every source file that a page names, and every
# page that a source file names. Tables, code and pictures may be wider, as they cannot be broken. No
# two tables of a page begin with the same header and row, as where one was put in the place of another.
# Pages of the manual begin with the most words that they may have; code and generated parts do not
# count. All of them together have a limit too, and so have the reference and the guides. The pages of
# instruments have one shape. No page and no source has a phrase that readers stumbled over.
#
#   pages_test.sh ROOT     ROOT: the source tree
set -eu
cd "$1"
LC_ALL=C.UTF-8
export LC_ALL
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0
phrases='is said|surely|by nothing|hangs? on|(more|less) to say|near copies|look-alikes?|blind time'
phrases="$phrases|sure or not|falls? on itself|that is none|path bends?"

# The headings of a page, as links name them.
headings() {
  sed -n 's/^##* //p' "$1" | tr '[:upper:]' '[:lower:]' | sed 's/[^a-z0-9 _-]//g; s/ /-/g'
}

for page in *.md docs/*.md docs/*/*.md docs/*/*/*.md; do
  # Code between fences becomes empty lines, so that line numbers stay.
  awk '/^```/ { code = !code; print ""; next } { print code ? "" : $0 }' "$page" >"$scratch/prose"
  if grep -nE '^.{121}' "$scratch/prose" | grep -vE '^[0-9]+:(\||    |!\[)' >"$scratch/wide"; then
    sed "s|^|FAIL: more than 120 columns: $page:|" "$scratch/wide"
    failed=1
  fi
  case ${page#docs/} in
  evidence/* | guide/* | reference/* | scale.md | architecture.md | estimation.md | README.md | CHANGELOG.md)
    limit=$(sed -n '1s/^<!-- at most \([0-9]*\) words -->$/\1/p' "$page")
    words=$(awk '/^<!-- Generated/ { made = !/up to here/ } !made && !/^(<!--|    |[|]-)/' \
      "$scratch/prose" | tr '|' ' ' | wc -w)
    echo "$page $words" >>"$scratch/words"
    if [ -z "$limit" ] || [ "$words" -gt "$limit" ]; then
      echo "FAIL: $page has $words words; its first line, <!-- at most N words -->, allows ${limit:-none}"
      failed=1
    fi
    ;;
  esac
  if grep -nwiE "$phrases" "$scratch/prose" >"$scratch/phrases"; then
    sed "s|^|FAIL: a phrase to be said plainly: $page:|" "$scratch/phrases"
    failed=1
  fi
  awk '/^\|---/ { header = before; next } header { print header $0; header = "" } { before = $0 }' \
    "$scratch/prose" | sort | uniq -d >"$scratch/twice"
  if [ -s "$scratch/twice" ]; then
    sed "s|^|FAIL: a table of $page stands there twice: |" "$scratch/twice"
    failed=1
  fi
  grep -oE '\]\([^)]+\)' "$scratch/prose" | sed -E 's/^\]\(//; s/\)$//' |
    grep -vE '^[a-z]+:' >"$scratch/links" || true
  while read -r link; do
    file=${link%%#*}
    target=$(dirname "$page")/$file
    [ -n "$file" ] || target=$page
    if [ ! -e "$target" ] || { [ "$file" != "$link" ] && ! headings "$target" | grep -qxF "${link#*#}"; }; then
      echo "FAIL: $page links to $link, which is not there"
      failed=1
    fi
  done <"$scratch/links"
  grep -oE '`(protocol|estimator|drivers|config|daemon|python|tests|bench|scripts|systemd|docs)/[^` ]+`' \
    "$scratch/prose" | tr -d '`' | grep -E '[.][a-z0-9]+$' | grep -vE '[*]|[A-Z]{4}' >"$scratch/files" || true
  while read -r file; do
    if [ ! -e "$file" ]; then
      echo "FAIL: $page names $file, which is not there"
      failed=1
    fi
  done <"$scratch/files"
done

# hold WHAT MOST: the pages on standard input have at most MOST words: what a reader can finish.
hold() {
  sum=$(awk '{ sum += $2 } END { print sum }')
  if [ "$sum" -gt "$2" ]; then
    echo "FAIL: $1 has $sum words, more than $2: cut what no reader acts on"
    failed=1
  fi
}
hold "the manual" 24000 <"$scratch/words"
grep '^docs/reference/' "$scratch/words" >"$scratch/reference"
hold "the reference" 2700 <"$scratch/reference"
grep '^docs/guide/' "$scratch/words" | grep -vE '/(first-hour|model)[.]md' >"$scratch/guides"
hold "the guide, without the first hour and the models," 9900 <"$scratch/guides"

# The pages of instruments that send tags have one shape, with five commands.
for name in brighteyes-ttm idq picoquant swabian tdc2 usb; do
  page=docs/guide/instruments/$name.md
  shape=$(sed -n 's/^## //p' "$page" | grep -E '^(What you need|Five commands|What goes wrong)$' | tr '\n' ';')
  commands=$(awk '/^## / { here = $0 == "## Five commands" } here && /^    / { print }' "$page" | wc -l)
  if [ "$shape $commands" != "What you need;Five commands;What goes wrong; 5" ]; then
    echo "FAIL: $page has $shape and $commands commands: What you need, Five commands, What goes wrong are expected"
    failed=1
  fi
done

# No comment, help or error has such a phrase either.
if grep -rnwIE "$phrases" protocol estimator drivers config daemon python bench scripts systemd --exclude-dir=data \
  >"$scratch/phrases"; then
  sed 's/^/FAIL: a phrase to be said plainly: /' "$scratch/phrases"
  failed=1
fi

# And the other way round: every page that a source file sends its reader to is there.
grep -rhoE 'docs/[A-Za-z0-9/_-]+[.](md|csv|svg|json|1)' protocol estimator drivers config daemon python tests \
  bench scripts systemd README.md --exclude-dir=data --exclude-dir=corpus | sort -u >"$scratch/named"
while read -r file; do
  if [ ! -e "$file" ]; then
    echo "FAIL: $(grep -rlF "$file" protocol estimator drivers config daemon python tests bench scripts \
      systemd README.md | head -1) names $file, which is not there"
    failed=1
  fi
done <"$scratch/named"
exit "$failed"
