#include "config/read_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::size_t file_block = 65'536;

}  // namespace

RegularFile::RegularFile(std::string name, std::string asked_by)
    : name_(std::move(name)),
      asked_by_(std::move(asked_by)),
      // O_NONBLOCK: does not wait for the other end of a pipe.
      file_(::open(name_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  // A socket cannot be opened.
  if (file_ < 0 && errno != ENXIO) refuse_by_errno();
  const bool is_known = file_ >= 0 && ::fstat(file_, &facts_) == 0;
  if (is_known && S_ISREG(facts_.st_mode)) return;
  if (file_ >= 0) ::close(file_);
  refuse("is no file but a folder, a device, a pipe or a socket; name the file itself");
}

RegularFile::~RegularFile() { ::close(file_); }

std::string RegularFile::read(std::size_t max_bytes) const {
  std::string text;
  std::array<char, file_block> some{};
  for (ssize_t got = 0; (got = ::read(file_, some.data(), some.size())) != 0;) {
    if (got < 0) refuse_by_errno();
    text.append(some.data(), static_cast<std::size_t>(got));
    if (text.size() > max_bytes) {
      refuse("has more than " + std::to_string(max_bytes >> 20U) +
             " MiB, the most that splid reads of such a file; is it the right file?");
    }
  }
  return text;
}

void RegularFile::refuse(const std::string& what) const {
  throw Error(Fault::usage, asked_by_ + name_ + ": " + what);
}

void RegularFile::refuse_by_errno() const {
  refuse(std::string("cannot be read: ") + std::strerror(errno));
}

std::string read_file(const std::string& file, const std::string& asked_by) {
  return RegularFile(file, asked_by).read(largest_text_bytes);
}

std::string read_start(const std::string& file, std::size_t count, const std::string& asked_by) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"),
                                                               std::fclose);
  std::string text;
  if (stream) {
    for (std::size_t got = 1; got > 0 && text.size() < count;) {
      const std::size_t begin = text.size();
      text.resize(begin + std::min(file_block, count - begin));
      got = std::fread(text.data() + begin, 1, text.size() - begin, stream.get());
      text.resize(begin + got);
    }
    if (std::ferror(stream.get()) == 0) return text;
  }
  throw Error(Fault::usage, asked_by + file + ": cannot be read: " + std::strerror(errno));
}

}  // namespace splid
