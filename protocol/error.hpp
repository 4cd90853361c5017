#pragma once

#include <stdexcept>
#include <string>

namespace splid {

// Whose fault an error is; the value is the program's exit code.
enum class Fault : int {
  usage = 2,   // command line or configuration
  device = 3,  // instrument, socket, disk
  data = 4,    // the content of a recording or a pattern
};

// An error that a person can act on: `what()` says what happened, where (file and byte offset, JSON
// pointer, device serial) and what to do. Thrown at start-up and at the end of a stream, never on
// the way of a tag.
class Error : public std::runtime_error {
 public:
  Error(Fault fault, const std::string& what) : std::runtime_error(what), fault_(fault) {}
  [[nodiscard]] Fault fault() const { return fault_; }
  [[nodiscard]] int exit_code() const { return static_cast<int>(fault_); }

 private:
  Fault fault_;
};

// Returns what make() returns. An Error that make() throws begins with who asked for the thing: the
// option, or the configuration's key.
template <class Make>
auto asked_by(const std::string& who, const Make& make) {
  try {
    return make();
  } catch (const Error& error) {
    throw Error(error.fault(), who + ": " + error.what());
  }
}

}  // namespace splid
