#pragma once

#include <cstdio>
#include <string>

namespace splid {

// Writes data lines to a stream such as standard output, each at once, so that a reader in a pipe
// has it.
//
// Threads: one. Errors: write() throws Error(Fault::device) with the errno text when the stream
// takes no more.
class LineWriter {
 public:
  // stream: stays open; name: for the error.
  LineWriter(std::FILE* stream, std::string name) : stream_(stream), name_(std::move(name)) {}

  // Returns false, from then on, when the reader of a pipe has left: no error, but no reason to go
  // on either.
  bool write(const std::string& line);

 private:
  std::FILE* stream_;
  std::string name_;
  bool open_ = true;
};

}  // namespace splid
