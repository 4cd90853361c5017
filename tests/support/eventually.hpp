#pragma once

#include <chrono>
#include <thread>

#include "tests/support/patience.hpp"

namespace splid::test {

// Whether a condition comes true while a test has patience.
template <class Condition>
bool eventually(const Condition& condition) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
  }
  return true;
}

}  // namespace splid::test
