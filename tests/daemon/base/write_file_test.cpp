#include "daemon/base/write_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

// As processes of two containers may, which can have the same number.
TEST(WriteFile, SeveralMayWriteTheSameFileAtOnce) {
  const test::TempFolder folder;
  const std::string file = folder.path("a.json");
  const std::string text(100'000, 'x');
  std::vector<std::string> faults(2);
  {
    std::vector<std::jthread> writers;
    for (std::string& fault : faults) {
      writers.emplace_back([&] {
        try {
          for (int i = 0; i < 500; ++i) write_file(file, text);
        } catch (const Error& error) {
          fault = error.what();
        }
      });
    }
  }
  for (const std::string& fault : faults) EXPECT_EQ(fault, "");
  EXPECT_EQ(test::file_text(file), text);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path("")), {}), 1);
}

TEST(WriteFile, AFileHasTheUsualModeAndKeepsItsOwn) {
  const test::TempFolder folder;
  const mode_t mask = ::umask(0027);
  write_file(folder.path("a.json"), "a");
  ::umask(mask);
  namespace fs = std::filesystem;
  const auto mode = [&] { return fs::status(folder.path("a.json")).permissions(); };
  EXPECT_EQ(mode(), fs::perms{0640});
  fs::permissions(folder.path("a.json"), fs::perms{0604});
  write_file(folder.path("a.json"), "b");
  EXPECT_EQ(mode(), fs::perms{0604});
  EXPECT_EQ(test::file_text(folder.path("a.json")), "b");
}

}  // namespace
}  // namespace splid
