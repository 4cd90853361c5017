#pragma once

#include <sys/mount.h>

#include <string>

#include "tests/support/temp_folder.hpp"

namespace splid::test {

// A file system of its own that is soon full. Takes root; see mounted().
class SmallDisk {
 public:
  explicit SmallDisk(int mib) {
    const std::string size = "size=" + std::to_string(mib) + "m";
    mounted_ = mount("splid-test", folder_.path("").c_str(), "tmpfs", 0, size.c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount2(folder_.path("").c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool mounted() const { return mounted_; }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.path(name); }
  // Leaves that many bytes free.
  void fill_but(std::uintmax_t bytes) const {
    const auto free = std::filesystem::space(folder_.path("")).available;
    const std::string text(free > bytes ? free - bytes : 0, 'x');
    (void)folder_.write("ballast", text);
  }
  void clear() const { std::filesystem::remove(folder_.path("ballast")); }

 private:
  TempFolder folder_;
  bool mounted_ = false;
};

}  // namespace splid::test
