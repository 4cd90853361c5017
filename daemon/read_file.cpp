#include "daemon/read_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>

#include "protocol/error.hpp"

namespace splid {

std::string read_start(const std::string& file, std::size_t count) {
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
  throw Error(Fault::usage, file + ": cannot be read: " + std::strerror(errno));
}

std::string read_file(const std::string& file) {
  return read_start(file, std::numeric_limits<std::size_t>::max());
}

void write_file(const std::string& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text << std::flush;
  if (!out) throw Error(Fault::device, file + ": cannot be written: " + std::strerror(errno));
}

void check_may_write(const std::string& file, bool force) {
  if (force || !std::filesystem::exists(file)) return;
  throw Error(Fault::usage, file + ": exists; --force writes over it");
}

void check_folder_of(const std::string& file) {
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  if (folder.empty() || std::filesystem::is_directory(folder)) return;
  throw Error(Fault::device, file + ": there is no folder " + folder.string() +
                                 "; make it, or name a file in another");
}

}  // namespace splid
