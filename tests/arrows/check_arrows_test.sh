#!/bin/sh
# Shows that scripts/check-arrows lets pass what is allowed and finds each kind of forbidden include.
#
#   check_arrows_test.sh CHECK_ARROWS
set -eu
check=$1
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
failed=0

# expect EXIT_CODE FILE INCLUDE: the code for a tree with that one line
expect() {
  rm -rf "$tree"/*
  for folder in protocol estimator/fold estimator/search drivers/replay config daemon/base \
    daemon/stream daemon/output python/src; do mkdir -p "$tree/$folder"; done
  printf '// a comment\n%s\n' "$3" >"$tree/$2"
  code=0
  said=$("$check" "$tree") || code=$?
  if [ "$code" -ne "$1" ]; then
    echo "FAIL: '$3' in $2: exit code $code, expected $1"
    failed=1
  elif [ "$1" -eq 1 ] && [ "${said#"$2":2: }" = "$said" ]; then
    echo "FAIL: '$3' in $2: the place is missing in: $said"
    failed=1
  fi
}

expect 0 protocol/a.hpp '#include "protocol/tag.hpp"'
expect 0 protocol/a.cpp '#include <nlohmann/json.hpp>'
expect 0 estimator/a.cpp '#include <Eigen/Dense>'
expect 0 estimator/a.cpp '// #include "daemon/stream/ring.hpp"'
expect 0 drivers/replay/a.cpp '#include <thread>'
expect 0 config/a.cpp '#include "estimator/model/options.hpp"'
expect 0 daemon/base/a.cpp '#include <zmq.hpp>'

expect 0 daemon/output/a.cpp '#include "daemon/stream/a.hpp"'
expect 0 estimator/a.cpp '#include "estimator/search/a.hpp"'

expect 0 python/src/a.cpp '#include "daemon/stream/a.hpp"'
expect 0 python/src/a.cpp '#include <pybind11/pybind11.h>'

expect 1 python/src/a.cpp '#include "daemon/output/a.hpp"'
expect 1 python/src/a.cpp '#include <zmq.hpp>'
expect 1 daemon/stream/a.cpp '#include "python/src/a.hpp"'
expect 1 daemon/stream/a.cpp '#include "daemon/output/a.hpp"'
expect 1 daemon/base/a.cpp '#include "daemon/unknown/a.hpp"'
expect 1 estimator/fold/a.cpp '#include "estimator/search/a.hpp"'
expect 1 estimator/fold/a.cpp '#include "estimator/frame_estimator.hpp"'
expect 1 protocol/a.hpp '#include "estimator/model/options.hpp"'
expect 1 protocol/a.hpp '#  include <fstream>'
expect 1 protocol/a.cpp '#include <chrono>'
expect 1 protocol/a.cpp '#include <sys/stat.h>'
expect 1 protocol/a.cpp '#include <protocol/tag.hpp>'
expect 1 estimator/a.cpp '#include <nlohmann/json.hpp>'
expect 1 estimator/a.cpp '#include "drivers/source.hpp"'
expect 1 estimator/a.cpp '#include <spdlog/spdlog.h>'
expect 1 estimator/a.cpp '#include <thread>'
expect 1 drivers/replay/a.cpp '#include "estimator/model/options.hpp"'
expect 1 drivers/replay/a.hpp '#include "config/config.hpp"'
expect 1 drivers/replay/a.cpp '#include <zmq.hpp>'
expect 1 config/a.cpp '#include "daemon/stream/ring.hpp"'
expect 1 daemon/base/a.cpp '#include "tests/support/sink.hpp"'
expect 1 daemon/base/a.cpp '#include "ring.hpp"'
expect 0 estimator/a.cpp 'const double a = std::exp(b);'
expect 1 estimator/a.cpp 'const double a = std::hypot(b, c);'
expect 1 daemon/base/a.cpp 'return std::erf(b);'

rm -rf "$tree"/*
code=0
"$check" "$tree" 2>/dev/null || code=$?
if [ "$code" -ne 2 ]; then
  echo "FAIL: an empty tree: exit code $code, expected 2"
  failed=1
fi
exit "$failed"
