#pragma once

#include <termios.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace splid::view {

// The whole screen of the terminal at standard output: taken on construction, given back as it was
// by the destructor. Typed characters do not show meanwhile; Ctrl-C still ends the program.
//
// Threads: one. Errors: show() throws Error(Fault::device) where the terminal cannot be written.
class TerminalScreen {
 public:
  // Whether standard output is a terminal that can be filled.
  static bool can_be_had();

  TerminalScreen();
  ~TerminalScreen();
  TerminalScreen(const TerminalScreen&) = delete;
  TerminalScreen& operator=(const TerminalScreen&) = delete;

  [[nodiscard]] std::size_t columns() const { return columns_; }
  [[nodiscard]] std::size_t rows() const { return rows_; }
  // Asks for the terminal's size. Returns whether the size has changed.
  bool look_at_size();

  // Replaces the picture. lines: at most rows() of at most columns() characters.
  void show(const std::vector<std::string>& lines) const;

 private:
  std::size_t columns_ = 80;
  std::size_t rows_ = 24;
  std::optional<termios> before_;  // the settings of standard input, if that is a terminal
};

}  // namespace splid::view
