#include "daemon/view/terminal_screen.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "protocol/error.hpp"

namespace splid::view {
namespace {

// The terminal's other screen without a cursor, and back: what stood there before returns.
constexpr const char* enter = "\033[?1049h\033[?25l\033[2J";
constexpr const char* leave = "\033[0m\033[?25h\033[?1049l";

bool put(const std::string& text) {
  return std::fwrite(text.data(), 1, text.size(), stdout) == text.size() &&
         std::fflush(stdout) == 0;
}

}  // namespace

bool TerminalScreen::can_be_had() {
  const char* kind = std::getenv("TERM");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  const bool moves_cursor = kind != nullptr && *kind != '\0' && std::string_view(kind) != "dumb";
  return moves_cursor && ::isatty(STDOUT_FILENO) == 1;
}

TerminalScreen::TerminalScreen() {
  look_at_size();
  termios now{};
  if (::isatty(STDIN_FILENO) == 1 && ::tcgetattr(STDIN_FILENO, &now) == 0) {
    before_ = now;
    now.c_lflag &= ~static_cast<tcflag_t>(ECHO | ICANON);
    // Ctrl-Z would leave the shell on this screen.
    now.c_cc[VSUSP] = _POSIX_VDISABLE;
    (void)::tcsetattr(STDIN_FILENO, TCSANOW, &now);
  }
  (void)put(enter);
}

TerminalScreen::~TerminalScreen() {
  (void)put(leave);
  // What was typed unseen is for nobody.
  if (before_) (void)::tcsetattr(STDIN_FILENO, TCSAFLUSH, &*before_);
}

bool TerminalScreen::look_at_size() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    return false;
  }
  const bool changed = size.ws_col != columns_ || size.ws_row != rows_;
  columns_ = size.ws_col;
  rows_ = size.ws_row;
  return changed;
}

void TerminalScreen::show(const std::vector<std::string>& lines) const {
  std::string text = "\033[H";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    // The rest of the line is erased before it is written: after its last column the cursor still
    // stands on that column, which would be erased too.
    text += (i == 0 ? "\033[K" : "\r\n\033[K") + lines[i];
  }
  if (lines.size() < rows_) text += "\r\n\033[J";
  if (put(text)) return;
  if (errno == EPIPE || errno == EIO) return;  // the terminal is gone, and SIGHUP on its way
  throw Error(Fault::device, std::string("the terminal at standard output: ") +
                                 std::strerror(errno));  // NOLINT(concurrency-mt-unsafe)
}

}  // namespace splid::view
