#include "daemon/base/progress.hpp"

#include <unistd.h>

#include <cstdio>

namespace splid {
namespace {

constexpr std::int64_t interval_ns = 200'000'000;
constexpr const char* erase_line = "\r\033[K";

}  // namespace

Progress::Progress(const Clock& clock)
    : clock_(clock), terminal_(::isatty(STDERR_FILENO) == 1), next_ns_(clock.steady_ns()) {}

bool Progress::due() {
  if (!terminal_) return false;
  const std::int64_t now_ns = clock_.steady_ns();
  if (now_ns < next_ns_) return false;
  next_ns_ = now_ns + interval_ns;
  return true;
}

void Progress::show(const std::string& text) {
  std::fprintf(stderr, "%s%s", erase_line, text.c_str());
  shown_ = true;
}

void Progress::clear() {
  if (shown_) std::fputs(erase_line, stderr);
  shown_ = false;
}

}  // namespace splid
