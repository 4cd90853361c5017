#!/bin/sh
# Shows on a product of two functions that scripts/mutants puts its faults in one at a time, tells which
# of them a test noticed, and leaves the source as it was, whichever way it ends.
#
#   mutants_test.sh MUTANTS COMPILER
set -eu
mutants=$1
compiler=$2
tree=$(mktemp -d)
running=
clean_up() {
  rm -f "$tree/slow" # which ends what it still builds
  [ -z "$running" ] || kill "$running" 2>/dev/null || true
  rm -rf "$tree"
}
trap clean_up EXIT
cd "$tree"
failed=0
fail() {
  echo "FAIL: $1"
  failed=1
}

mkdir -p protocol tests/protocol build/tests bin
cat >protocol/seen.cpp <<'END'
int seen(int a) {
  if (a < 3) return 9;
  return a + 4;
}
END
cat >protocol/unseen.cpp <<'END'
int unseen(int a) {
  return a + 4;
}
END
cat >tests/protocol/seen_test.cpp <<'END'
#define TEST(suite, name) int main(int count, char** words)
int seen(int a);
TEST(Seen, OnBothSides) {
  const char* filter = count < 2 ? "" : words[1];
  return filter[0] == '-' && seen(2) == 9 && seen(3) == 7 && seen(4) == 8 ? 0 : 1;
}
END
cat >bin/cmake <<END
#!/bin/sh
if ! diff -r protocol original >/dev/null; then
  touch built
  while [ -e slow ]; do sleep 0.05; done
fi
exec "$compiler" protocol/*.cpp tests/protocol/*.cpp -o build/tests/protocol_tests
END
chmod +x bin/cmake
PATH=$tree/bin:$PATH
export PATH
cp -r protocol original

same() { diff -r protocol original >/dev/null || fail "$1: the source has changed"; }

# Faults that a test notices: whichever they are, all are red, and so is the exit code's word.
"$mutants" --build build --faults 4 --seed 2 protocol/seen.cpp >said || fail "seen: exit code $?"
[ "$(tail -n 1 said)" = "4 of 4 faults turned a test red" ] || fail "seen: $(cat said)"
[ "$(grep -c '^protocol/seen.cpp:[23]: [a-z ]*: .* -> .*: red: exit code 1$' said)" = 4 ] ||
  fail "seen: lines are others: $(cat said)"
same seen
"$mutants" --build build --faults 4 --seed 2 protocol/seen.cpp >again || fail "again: exit code $?"
cmp -s said again || fail "the same seed made other faults"

# Faults that no test notices. By default it takes what was changed.
git init -q .
git add protocol
git -c user.name=a -c user.email=a@b commit -q -m a
sed -i 's/4/5/' protocol/unseen.cpp
cp protocol/unseen.cpp original
code=0
"$mutants" --build build --faults 2 --since HEAD >said || code=$?
[ "$code" = 1 ] || fail "unseen: exit code $code"
[ "$(tail -n 1 said)" = "0 of 2 faults turned a test red" ] || fail "unseen: $(cat said)"
[ "$(grep -c '^protocol/unseen.cpp:2: .*: SURVIVED$' said)" = 2 ] || fail "unseen: $(cat said)"
same unseen

# Ended while it builds a fault: at once by a request, which restores the source; by force, after which the next
# run restores it.
begin_slowly() {
  rm -f built
  touch slow
  "$mutants" --build build protocol/seen.cpp >/dev/null 2>&1 &
  running=$!
  while [ ! -e built ]; do sleep 0.05; done
}
begin_slowly
kill -TERM "$running"
code=0
wait "$running" || code=$?
[ "$code" = 143 ] || fail "terminated: exit code $code"
same terminated
begin_slowly
kill -KILL "$running"
{ wait "$running" || true; } 2>/dev/null
running=
if diff -r protocol original >/dev/null; then fail "killed: there was no fault to restore"; fi
rm slow
"$mutants" --build build --faults 0 protocol/seen.cpp >/dev/null || fail "after a kill: exit code $?"
same "after a kill"

sed -i 's/9/8/' protocol/seen.cpp
code=0
"$mutants" --build build protocol/seen.cpp >said 2>&1 || code=$?
[ "$code" = 2 ] || fail "red before: exit code $code"
grep -q 'its tests are to be green before there is a fault: red: exit code 1' said || fail "red before: $(cat said)"
code=0
"$mutants" --build build protocol/none.cpp 2>/dev/null || code=$?
[ "$code" = 2 ] || fail "no such file: exit code $code"
exit "$failed"
