#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

// Parts of the sources that are written by the program's own descriptions of them.

namespace splid::test {

inline std::string source_text(const std::string& file) {
  std::ifstream in(SPLID_SOURCE_DIR "/" + file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// With SPLID_UPDATE set, generated files are written instead of compared. suite: of the test.
inline void expect_generated(const std::string& file, const std::string& text,
                             const std::string& suite) {
  if (std::getenv("SPLID_UPDATE") != nullptr) {
    std::ofstream(SPLID_SOURCE_DIR "/" + file, std::ios::binary) << text;
  }
  EXPECT_TRUE(source_text(file) == text)
      << file << " is not what the program says; write it anew "
      << "with\nSPLID_UPDATE=1 ctest --preset release -R " << suite;
}

// The same for the part of a file between the lines `begin` and `end`.
inline void expect_generated_part(const std::string& file, const std::string& begin,
                                  const std::string& end, const std::string& part,
                                  const std::string& suite) {
  const std::string text = source_text(file);
  const std::size_t first = text.find(begin);
  const std::size_t last = text.find(end, first);
  ASSERT_NE(first, std::string::npos) << begin;
  ASSERT_NE(last, std::string::npos) << end;
  expect_generated(file, text.substr(0, first) + begin + part + text.substr(last), suite);
}

}  // namespace splid::test
