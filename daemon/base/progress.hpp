#pragma once

#include <cstdint>
#include <string>

#include "daemon/base/clock.hpp"

namespace splid {

// One line on standard error that each show() overwrites. Where standard error is no terminal,
// nothing is shown.
//
// Threads: one. Errors: none.
class Progress {
 public:
  explicit Progress(const Clock& clock);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // True at most five times a second: make the text only then.
  [[nodiscard]] bool due();
  void show(const std::string& text);
  void clear();

 private:
  const Clock& clock_;
  bool terminal_;
  bool shown_ = false;
  std::int64_t next_ns_ = 0;
};

}  // namespace splid
