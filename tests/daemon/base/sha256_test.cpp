#include "daemon/base/sha256.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

TEST(Sha256, IsThatOfTheStandard) {
  const test::TempFolder folder;
  EXPECT_EQ(sha256_of_file(folder.write("abc", "abc"), {}),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of_file(folder.write("nothing", ""), {}),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  // FIPS 180-4's example of a million times the letter a, over the end of a block of a mebibyte.
  EXPECT_EQ(sha256_of_file(folder.write("million", std::string(1'000'000, 'a')), {}),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, OfATextIsThatOfAFileWithIt) {
  const test::TempFolder folder;
  for (const std::string text : {"", "abc"}) {
    EXPECT_EQ(sha256_of(text), sha256_of_file(folder.write("text", text), {}));
  }
}

TEST(Sha256, IsAbsentWhereItCannotBeKnown) {
  const test::TempFolder folder;
  EXPECT_EQ(sha256_of_file(folder.path("none"), {}), std::nullopt);
  EXPECT_EQ(sha256_of_file(folder.path(""), {}), std::nullopt);  // a folder
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_EQ(sha256_of_file(folder.write("abc", "abc"), stopped.get_token()), std::nullopt);
}

}  // namespace
}  // namespace splid
