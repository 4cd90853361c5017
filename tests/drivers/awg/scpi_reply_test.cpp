#include "drivers/awg/scpi_reply.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace splid::awg {
namespace {

TEST(ScpiIdentity, HasFourFields) {
  const auto found = parse_scpi_identity("Keysight Technologies, M8195A ,DE12345678,3.6.0.0-2\r");
  EXPECT_EQ(found, (ScpiIdentity{"Keysight Technologies", "M8195A", "DE12345678", "3.6.0.0-2"}));
  EXPECT_EQ(parse_scpi_identity("a,b,,"), (ScpiIdentity{"a", "b", "", ""}));
  for (const char* line : {"", "M8195A", "a,b,c", "a,b,c,d,e", ",b,c,d", "a,,c,d"}) {
    EXPECT_FALSE(parse_scpi_identity(line)) << line;
  }
}

TEST(ScpiError, IsACodeAndAText) {
  EXPECT_EQ(parse_scpi_error("-223,\"Too much data\""), (ScpiError{-223, "Too much data"}));
  EXPECT_EQ(parse_scpi_error("0,\"No error\""), (ScpiError{0, "No error"}));
  EXPECT_EQ(parse_scpi_error(" +0, No error\r"), (ScpiError{0, "No error"}));
  EXPECT_EQ(parse_scpi_error("-113,\"a,b;\"c\"\""), (ScpiError{-113, "a,b;\"c\""}));
  EXPECT_EQ(parse_scpi_error("2147483647,x"), (ScpiError{2'147'483'647, "x"}));
  for (const char* line : {"", "0", "No error", ",x", "1,", "2147483648,x", "+-1,x", "1 2,x"}) {
    EXPECT_FALSE(parse_scpi_error(line)) << line;
  }
}

TEST(ScpiNumber, IsADecimal) {
  EXPECT_EQ(parse_scpi_number("+6.00042328042328E+10"), 6.00042328042328e10);
  EXPECT_EQ(parse_scpi_number(" -0.4\r"), -0.4);
  EXPECT_EQ(parse_scpi_number("1"), 1);
  EXPECT_EQ(parse_scpi_number("0"), 0);
  for (const char* line : {"", " ", "+", "1x", "x", "1,2", "NaN", "inf", "1e999", "+-1"}) {
    EXPECT_FALSE(parse_scpi_number(line)) << line;
  }
}

TEST(ScpiIntegers, StandBetweenCommas) {
  EXPECT_EQ(parse_scpi_integers("1, 226816\r"), (std::vector<std::int64_t>{1, 226'816}));
  EXPECT_EQ(parse_scpi_integers("-128"), (std::vector<std::int64_t>{-128}));
  for (const char* line : {"", ",", "1,", ",1", "1,,2", "1.5", "1 2", "9223372036854775808"}) {
    EXPECT_FALSE(parse_scpi_integers(line)) << line;
  }
}

TEST(ScpiBlockHead, IsPinned) {
  EXPECT_EQ(scpi_block_head(0), "#10");
  EXPECT_EQ(scpi_block_head(1), "#11");
  EXPECT_EQ(scpi_block_head(453'632), "#6453632");
  EXPECT_EQ(scpi_block_head(999'999'999), "#9999999999");
  for (const std::size_t bytes : {0U, 1U, 453'632U, 999'999'999U}) {
    const std::string head = scpi_block_head(bytes);
    EXPECT_EQ(parse_scpi_block_head(head + "..."), (ScpiBlockHead{head.size(), bytes}));
  }
  for (const char* text :
       {"", "#", "#1", "#0", "#0abc", "#21", "#2+1", "#2-1", "#21x", "1#1", "#a"}) {
    EXPECT_FALSE(parse_scpi_block_head(text)) << text;
  }
}

TEST(ScpiShown, IsShortAndPrintable) {
  EXPECT_EQ(shown_scpi(" *OPC?\r\n"), "*OPC?");
  EXPECT_EQ(shown_scpi(std::string("a\0\x80\x1b[0mz", 8)), "a???[0mz");
  EXPECT_EQ(shown_scpi(std::string(60, 'x')), std::string(60, 'x'));
  EXPECT_EQ(shown_scpi(std::string(61, 'x')), std::string(60, 'x') + "...");
}

// What comes from a socket may be anything; a sanitizer build sees reads beyond the end.
TEST(ScpiReply, StandsAnyBytes) {
  const std::string letters = "#0123456789+-,.\"eE \r\nxM\x80\xff";
  std::mt19937 random(1);
  for (int round = 0; round < 20'000; ++round) {
    std::string text;
    for (auto size = random() % 12; size > 0; --size) text += letters[random() % letters.size()];
    parse_scpi_identity(text);
    parse_scpi_error(text);
    parse_scpi_number(text);
    parse_scpi_integers(text);
    const auto head = parse_scpi_block_head(text);
    EXPECT_LE(head ? head->head_bytes : 0, text.size());
    EXPECT_LE(shown_scpi(text).size(), text.size());
  }
}

}  // namespace
}  // namespace splid::awg
