#!/bin/sh
# What a release stands on: the version, and its date, are the same in CMakeLists.txt, in CHANGELOG.md and in the
# changelogs of the Debian packages. And scripts/release refuses what should not be released.
#
#   release_test.sh ROOT BUILD_FOLDER VERSION
set -eu
cd "$1"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
fail() {
  echo "FAIL: $*"
  exit 1
}

heading=$(sed -n '/^## /{p;q}' CHANGELOG.md)
dated=$(echo "$heading" | sed -n "s/^## $3 (\(.*\))\$/\1/p")
case "$dated" in
  "not yet released") dated= ;; # packages are of the day when CMake looked
  ????-??-??) ;;
  *) fail "CHANGELOG.md begins with \"$heading\", not with \"## $3 (DATE)\", the version of CMakeLists.txt" ;;
esac
for changelog in "$2/systemd/changelog.Debian" "$2/systemd/python3-splid/changelog.Debian"; do
  [ -f "$changelog" ] || continue # built without the Python module
  head -n 1 "$changelog" | grep -qE "^(python3-)?splid \($3-1(~deb[0-9]+)?\) " ||
    fail "$changelog has another version than $3: $(head -n 1 "$changelog")"
  day=$(date -u -d "$(sed -n 's/^ -- .*>  //p' "$changelog")" +%F)
  [ "${dated:-$day}" = "$day" ] ||
    fail "$changelog is of $day, and CHANGELOG.md says $dated (cmake $2 looks again)"
done

# A repository with what scripts/release looks at.
mkdir "$scratch/scripts"
cp scripts/release "$scratch/scripts"
cd "$scratch"
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null
git init --quiet
# commit VERSION HEADING
commit() {
  echo "project(splid VERSION $1 LANGUAGES CXX)" >CMakeLists.txt
  printf '# Changes\n\n## %s\n\nText.\n\n## 1.1.0 (2026-01-31)\n' "$2" >CHANGELOG.md
  git add .
  git -c user.name=splid -c user.email=splid@example.org commit --quiet --allow-empty --message x
}
# refuses WORDS: with exit code 2, and one sentence, which has these words
refuses() {
  code=0
  said=$(scripts/release --check 2>&1) || code=$?
  [ "$code" -eq 2 ] || fail "exit code $code instead of 2: $1"
  case "$said" in
    *"
"*) fail "more than \"$1\": $said" ;;
    *"$1"*) ;;
    *) fail "not \"$1\" but: $said" ;;
  esac
}

commit 1.2.0 '1.2.0 (2026-02-28)'
scripts/release --check || fail "a commit that can be released is refused"
git tag v1.2.0
scripts/release --check || fail "the tag of this very commit is refused"
touch new
refuses "changes without a commit"
rm new
echo >>CHANGELOG.md
refuses "changes without a commit"
commit 1.2.0 '1.2.0 (2026-02-28)'
refuses "the tag v1.2.0 is that of another commit"
commit 1.3.0 '1.3.0 (not yet released)'
refuses "has no date"
commit 1.3.0 '1.3.0 (2026-02-30)'
refuses "has no date"
commit 1.3.0 '1.2.0 (2026-02-28)'
refuses "begins with \"## 1.2.0 (2026-02-28)\", and project() in CMakeLists.txt has 1.3.0"
