#pragma once

#include <sys/stat.h>

#include <cstddef>
#include <string>

namespace splid {

// The largest configuration, pattern or other text that is read. A pattern of a million pulses, the
// most that there may be, has less.
inline constexpr std::size_t largest_text_bytes = std::size_t{64} << 20U;

// A regular file, open for reading. facts() are those of the bytes that are read, even if another
// file gets its name meanwhile. A folder, a device, a pipe or a socket is refused, without waiting
// for the other end of a pipe.
//
// Errors: Error(Fault::usage) with asked_by, the file and the reason.
class RegularFile {
 public:
  // asked_by: stands before the file in the error's sentence, such as the key that named it.
  explicit RegularFile(std::string name, std::string asked_by = "");
  ~RegularFile();
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  [[nodiscard]] const struct stat& facts() const { return facts_; }
  // The whole file. A file of more bytes than max_bytes is refused once so many are read.
  [[nodiscard]] std::string read(std::size_t max_bytes) const;

 private:
  [[noreturn]] void refuse(const std::string& what) const;
  [[noreturn]] void refuse_by_errno() const;

  std::string name_;
  std::string asked_by_;
  int file_;
  struct stat facts_ {};
};

// Reads a whole file that a person named, a regular file of at most largest_text_bytes.
// asked_by, errors: as RegularFile.
std::string read_file(const std::string& file, const std::string& asked_by = "");

// Reads the first bytes of a file of any kind, at most `count`; of a pipe it waits for them.
// Errors: Error(Fault::usage) with the file and the errno text where it cannot be read.
std::string read_start(const std::string& file, std::size_t count,
                       const std::string& asked_by = "");

}  // namespace splid
