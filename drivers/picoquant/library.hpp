#pragma once

#include <chrono>
#include <span>
#include <stdexcept>
#include <string>

#include "drivers/picoquant/call_watch.hpp"
#include "drivers/picoquant/family.hpp"

namespace splid::picoquant {

// A call of the library that failed, or a library that cannot be used.
class LibraryError : public std::runtime_error {
 public:
  explicit LibraryError(const std::string& what, int code = 0)
      : std::runtime_error(what), code_(code) {}
  // The instrument does not answer on USB any more, or is not open.
  [[nodiscard]] bool device_is_gone() const {
    constexpr int open_fail = -1;
    constexpr int not_open = -10;
    constexpr int first_usb = -38;
    constexpr int last_usb = -32;
    return code_ == open_fail || code_ == not_open || (code_ >= first_usb && code_ <= last_usb);
  }
  // Another program uses the instrument.
  [[nodiscard]] bool device_is_busy() const {
    constexpr int busy = -2;
    constexpr int locked = -11;
    constexpr int instance_running = -16;
    return code_ == busy || code_ == locked || code_ == instance_running;
  }
  [[nodiscard]] int code() const { return code_; }

 private:
  int code_;
};

// PicoQuant's library for one family of instruments, opened at run time. The functions of all four
// libraries are called in much the same way; where one differs, the comment at its caller says so.
//
// Threads: one. Errors: LibraryError, with the call, the library's words and its number.
// Timeouts: the library's own; `watch` tells others how long a call may take.
class Library {
 public:
  // file: empty for the names that the family's library has. watch: outlives this object.
  Library(Family family, const std::string& file, CallWatch& watch);
  ~Library();
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  [[nodiscard]] const FamilyTraits& traits() const { return traits_; }

  // Calls prefix + name, and throws where the result is below zero. name: a literal. The types of
  // the arguments are those of the library's function: int, double*, unsigned int*, int* or char*.
  template <class... Arguments>
  int call(const char* name, Arguments... arguments) {
    return checked(name, try_call(name, arguments...));
  }
  // Returns the result as it is.
  template <class... Arguments>
  int try_call(const char* name, Arguments... arguments) {
    auto* function = reinterpret_cast<int (*)(Arguments...)>(find(name));
    watch_.enter(name, patience_of(name));
    const int result = function(arguments...);
    watch_.leave();
    return result;
  }
  // The error of a call that returned a code below zero.
  LibraryError error(const char* name, int code);

 private:
  void open(const std::string& file);
  void check_version();
  void* find(const char* name);
  int checked(const char* name, int result) {
    if (result < 0) throw error(name, result);
    return result;
  }
  static std::chrono::milliseconds patience_of(const char* name);

  const FamilyTraits& traits_;
  CallWatch& watch_;
  std::string file_;
  void* handle_ = nullptr;
};

}  // namespace splid::picoquant
