#include "protocol/shown_text.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

std::string shown(std::string_view text) { return shown_text(text, 1000); }

TEST(ShownText, PrintableTextStays) {
  for (const char* text : {"", "a b~", "Größe 5 µm", "距離 🔭"}) EXPECT_EQ(shown(text), text);
}

TEST(ShownText, ControlCharactersDoNot) {
  EXPECT_EQ(shown("\x1b[2J\r\n\ta\x7f"), "?[2J???a?");
  EXPECT_EQ(shown(std::string_view("a\0b", 3)), "a?b");
  EXPECT_EQ(shown("\xc2\x9b"
                  "31m"),
            "?"
            "?31m");  // C1: one byte in Latin-1, two in UTF-8
  EXPECT_EQ(shown("\xe2\x80\xae"
                  "a"),
            "???a");  // turns the direction
  EXPECT_EQ(shown("\xe2\x80\xa8"
                  "a"),
            "???a");  // a line separator
}

TEST(ShownText, WhatIsNoUtf8DoesNot) {
  EXPECT_EQ(shown("\x80\x9b"), "??");
  EXPECT_EQ(shown("\xc0\xaf\xc1\xbf"), "????");                 // overlong
  EXPECT_EQ(shown("\xe0\x80\xaf\xf0\x80\x80\xaf"), "???????");  // overlong
  EXPECT_EQ(shown("\xed\xa0\x80"), "???");                      // a surrogate
  EXPECT_EQ(shown("\xf4\x90\x80\x80\xff"), "?????");            // beyond Unicode
  EXPECT_EQ(shown("a\xc3"), "a?");                              // cut
  EXPECT_EQ(shown("\xc3"
                  "a"),
            "?a");
}

TEST(ShownText, LongTextIsCutBetweenCharacters) {
  EXPECT_EQ(shown_text("abc", 3), "abc");
  EXPECT_EQ(shown_text("abcd", 3), "abc...");
  EXPECT_EQ(shown_text("abµ", 3), "ab...");
  EXPECT_EQ(shown_text("abµ", 4), "abµ");
  EXPECT_EQ(shown_text(std::string(10'000'000, 'x'), 40), std::string(40, 'x') + "...");
}

TEST(ShownText, AReportKeepsItsLines) {
  EXPECT_EQ(shown_lines("a\x1b\n\nb\r\n"), "a?\n\nb?\n");
  EXPECT_EQ(shown_lines(""), "");
}

}  // namespace
}  // namespace splid
