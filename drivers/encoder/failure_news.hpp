#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace splid {

// Decides which failures of a connection are reported: the same failure once, up to over(), and
// failures that differ from each other five at once, then one every ten seconds.
//
// Threads: one. Errors: none.
class FailureNews {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // The report of a failure; absent: it is not reported now.
  std::optional<std::string> say(const std::string& sentence, Time now) {
    if (sentence == said_) return std::nullopt;
    spent_until_ = std::max(spent_until_, now);
    if (spent_until_ - now > (at_once - 1) * between) {
      ++unsaid_;
      return std::nullopt;
    }
    spent_until_ += between;
    said_ = sentence;
    const std::uint64_t unsaid = std::exchange(unsaid_, 0);
    if (unsaid == 0) return sentence;
    return sentence + "; " + std::to_string(unsaid) + " more failures were not said";
  }

  // The connection works: its next failure is new.
  void over() { said_.clear(); }

 private:
  static constexpr int at_once = 5;
  static constexpr std::chrono::seconds between{10};

  std::string said_;
  Time spent_until_;
  std::uint64_t unsaid_ = 0;
};

}  // namespace splid
