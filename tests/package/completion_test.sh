#!/bin/bash
# Completes commands, options, values and files as bash does after the package's completion is read.
#
#   completion_test.sh COMPLETION SPLID
set -eu
source "$1"
PATH=$(dirname "$2"):$PATH
failed=0

# completes WORD... // EXPECTED...: the last word is the one that the cursor is in
completes() {
  local expected
  COMP_WORDS=(splid)
  while [[ $1 != // ]]; do
    COMP_WORDS+=("$1")
    shift
  done
  shift
  expected=$*
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  COMPREPLY=()
  _splid
  if [[ ${COMPREPLY[*]} != "$expected" ]]; then
    echo "FAIL: ${COMP_WORDS[*]}: '${COMPREPLY[*]}', expected '$expected'"
    failed=1
  fi
}

completes re // replay record
completes simu // simulate
completes bat // batch
completes batch --sh // --shard
completes mer // merge
completes --ver // --version
completes run --con // --config
completes run -c // -c
completes replay --speed 1 --js // --json
completes run --log-level de // debug
completes run --config --log // --log-level
completes listen st // status
completes listen fol // fold
completes view --ht // --http
completes dem // demo
completes forw // forward
completes forward --cr // --credentials
completes forward --topics sc // scene
completes plo // plot
completes plot --ou // --output
completes demo --ht // --http
completes listen --wat // --watch
completes pattern inter // interleaved
completes pattern interleaved --subp // --subperiods-ns
completes run --config my. //
completes check my. //
completes ctl st // status start stop
completes ctl record st // start stop
completes nothing re // replay record

complete -p splid | grep -q -- '-o default' || {
  echo "FAIL: names of files are not completed"
  failed=1
}
exit "$failed"
