#pragma once

#include <sys/stat.h>

#include <string>

namespace splid {

// Whether an open file has lost its last name, so that what is written into it goes with the
// program. A file that got another name, or whose folder did, is still there. file: the name that
// it was opened by; some file systems count no names. Errors: none.
inline bool is_removed(int descriptor, const std::string& file) {
  struct stat open {};
  struct stat named {};
  if (::fstat(descriptor, &open) != 0 || !S_ISREG(open.st_mode) || open.st_nlink > 0) return false;
  return ::stat(file.c_str(), &named) != 0 || named.st_dev != open.st_dev ||
         named.st_ino != open.st_ino;
}

}  // namespace splid
