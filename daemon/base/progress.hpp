#pragma once

#include <cstdint>
#include <string>

#include "daemon/base/clock.hpp"

namespace splid {

// One line on standard error that is written over again and again; nothing where standard error is
// no terminal.
//
// Threads: one. Errors: none.
class Progress {
 public:
  explicit Progress(const Clock& clock);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // True at most five times a second, so that the text is made only when it will be seen.
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
