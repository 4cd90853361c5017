#include "config/read_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>

#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ReadFile : public ::testing::Test {
 protected:
  static std::string fault_of(const std::string& file) {
    return test::error_text([&] { (void)read_file(file, "c.json: /pattern/file: "); });
  }

  // A file of zeros, which takes no room on the disk.
  std::string sized(std::size_t bytes) const {
    const std::string file = folder.write("sized", "");
    std::filesystem::resize_file(file, bytes);
    return file;
  }

  test::TempFolder folder;
};

TEST_F(ReadFile, TakesRegularFilesAndLinksToThem) {
  const std::string file = folder.write("file", "text");
  std::filesystem::create_symlink(file, folder.path("link"));
  EXPECT_EQ(read_file(file), "text");
  EXPECT_EQ(read_file(folder.path("link")), "text");
  EXPECT_EQ(read_file(folder.write("empty", "")), "");
}

// A device may never end, and nobody may write into a pipe.
TEST_F(ReadFile, RefusesFoldersDevicesPipesAndSocketsAtOnce) {
  ASSERT_EQ(::mkfifo(folder.path("pipe").c_str(), 0600), 0);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un place{AF_UNIX, {}};
  folder.path("socket").copy(place.sun_path, sizeof place.sun_path - 1);
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&place), sizeof place), 0);
  for (const std::string& file : {folder.path("pipe"), folder.path("socket"), folder.path(""),
                                  std::string("/dev/zero"), std::string("/dev/null")}) {
    EXPECT_THAT(fault_of(file), AllOf(StartsWith("c.json: /pattern/file: " + file + ": "),
                                      HasSubstr("is no file but a folder, a device")));
  }
  ::close(listener);
}

TEST_F(ReadFile, RefusesFilesOfMoreThanTheStatedSize) {
  EXPECT_EQ(read_file(sized(largest_text_bytes)).size(), largest_text_bytes);
  EXPECT_THAT(fault_of(sized(largest_text_bytes + 1)), HasSubstr("has more than 64 MiB"));
  const RegularFile small(sized(1 << 20));
  EXPECT_EQ(small.read(1 << 20).size(), std::size_t{1} << 20U);
  const RegularFile larger(sized((1 << 20) + 1));
  EXPECT_THAT(test::error_text([&] { (void)larger.read(1 << 20); }),
              HasSubstr("has more than 1 MiB"));
}

}  // namespace
}  // namespace splid
