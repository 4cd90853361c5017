#pragma once

#include <cstdio>
#include <string>

namespace splid {

// Writes lines of data to a stream such as standard output. Each line is flushed, so that a reader
// at the other end of a pipe gets it at once.
//
// Threads: one. Errors: write() throws Error(Fault::device) with the errno text when the stream
// cannot be written.
class LineWriter {
 public:
  // stream: stays open afterwards. name: what an error calls the stream.
  LineWriter(std::FILE* stream, std::string name) : stream_(stream), name_(std::move(name)) {}

  // Returns false, from then on, when the reader at the other end of a pipe has left: that is no
  // error, but there is no reason to go on.
  bool write(const std::string& line);

 private:
  std::FILE* stream_;
  std::string name_;
  bool open_ = true;
};

}  // namespace splid
