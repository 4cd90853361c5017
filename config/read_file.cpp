#include "config/read_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>

#include "protocol/error.hpp"

namespace splid {

std::string read_start(const std::string& file, std::size_t count, const std::string& asked_by) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"),
                                                               std::fclose);
  std::string text;
  if (stream) {
    constexpr std::size_t block = 65'536;
    for (std::size_t got = 1; got > 0 && text.size() < count;) {
      const std::size_t begin = text.size();
      text.resize(begin + std::min(block, count - begin));
      got = std::fread(text.data() + begin, 1, text.size() - begin, stream.get());
      text.resize(begin + got);
    }
    if (std::ferror(stream.get()) == 0) return text;
  }
  throw Error(Fault::usage, asked_by + file + ": cannot be read: " + std::strerror(errno));
}

std::string read_file(const std::string& file, const std::string& asked_by) {
  return read_start(file, std::numeric_limits<std::size_t>::max(), asked_by);
}

}  // namespace splid
