#include "protocol/json_writer.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace splid {
namespace {

TEST(NumberText, FewestDigits) {
  EXPECT_EQ(number_text(0), "0");
  EXPECT_EQ(number_text(50), "50");
  EXPECT_EQ(number_text(-3'780'000), "-3780000");
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(0.1 + 0.2), "0.30000000000000004");
  EXPECT_EQ(number_text(1e-12), "1e-12");
  EXPECT_EQ(number_text(5e-324), "5e-324");
  EXPECT_EQ(number_text(9007199254740991), "9007199254740991");
  EXPECT_EQ(number_text(-9007199254740991), "-9007199254740991");
  EXPECT_EQ(number_text(1e300), "1e+300");
  EXPECT_EQ(number_text(-1e300), "-1e+300");
  EXPECT_EQ(number_text(std::numeric_limits<double>::max()), "1.7976931348623157e+308");
}

TEST(NumberText, ReadsBackAsTheSameDouble) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 100'000; ++i) {
    const auto value = std::bit_cast<double>(static_cast<std::uint64_t>(random()));
    if (!std::isfinite(value)) continue;
    ASSERT_EQ(std::strtod(number_text(value).c_str(), nullptr), value);
  }
}

TEST(JsonString, EscapesAndReplaces) {
  EXPECT_EQ(json_string("a\"b\\c\n\x01"), R"("a\"b\\c\n\u0001")");
  EXPECT_EQ(json_string("\xFF"), "\"\xEF\xBF\xBD\"");
  EXPECT_EQ(json_string("µm"), "\"µm\"");
}

TEST(JsonNumbers, Array) {
  EXPECT_EQ(json_numbers({}), "[]");
  EXPECT_EQ(json_numbers(std::vector<double>{1, 2.5, -3}), "[1,2.5,-3]");
}

TEST(JsonWriter, MembersInOrder) {
  EXPECT_EQ(JsonWriter().finish(), "{}");
  EXPECT_EQ(JsonWriter()
                .text("z", "x")
                .flag("yes", true)
                .flag("no", false)
                .integer("max", std::numeric_limits<std::uint64_t>::max())
                .integer("min", std::numeric_limits<std::int64_t>::min())
                .number("a", 0.5)
                .object("o", JsonWriter().number("p", 1))
                .finish(),
            R"({"z":"x","yes":true,"no":false,"max":18446744073709551615,)"
            R"("min":-9223372036854775808,"a":0.5,"o":{"p":1}})");
}

TEST(JsonWriter, LeavesOutWhatIsUnknown) {
  EXPECT_EQ(JsonWriter()
                .number("absent", std::nullopt)
                .number("nan", std::nan(""))
                .number("inf", HUGE_VAL)
                .object("empty", JsonWriter())
                .finish(),
            "{}");
}

}  // namespace
}  // namespace splid
