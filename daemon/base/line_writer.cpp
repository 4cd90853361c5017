#include "daemon/base/line_writer.hpp"

#include <cerrno>
#include <cstring>

#include "protocol/error.hpp"

namespace splid {

bool LineWriter::write(const std::string& line) {
  if (!open_) return false;
  errno = 0;
  const bool written = std::fwrite(line.data(), 1, line.size(), stream_) == line.size() &&
                       std::fputc('\n', stream_) != EOF && std::fflush(stream_) == 0;
  if (written) return true;
  open_ = false;
  if (errno == EPIPE) return false;
  throw Error(Fault::device, name_ + ": " + std::strerror(errno) + "; the line is incomplete");
}

}  // namespace splid
