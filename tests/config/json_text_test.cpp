#include "config/json_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/json_value.hpp"
#include "tests/support/error_text.hpp"

namespace splid {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string error_of(const std::string& text) {
  return test::error_text([&] { parse_json_text(text, "a.json"); });
}

TEST(JsonText, ReadsJson) { EXPECT_EQ(parse_json_text("{\"a\": [1, 2]}", "")["a"][1], 2); }

TEST(JsonText, SaysLineAndColumnOfWhatIsNoJson) {
  EXPECT_THAT(error_of("{\n  \"a\": 1,\n  \"b\": x\n}"), StartsWith("a.json: line 3, column 8: "));
  EXPECT_THAT(error_of("x"), StartsWith("a.json: line 1, column 1: "));
  EXPECT_THAT(error_of(""), StartsWith("a.json: line 1, column 1: is not JSON"));
  EXPECT_THAT(error_of("{\"a\": 1\n"), StartsWith("a.json: line 2, column 1: "));
  EXPECT_THAT(error_of("{} {}"), StartsWith("a.json: line 1, column 4: "));
  EXPECT_THAT(error_of("{\"a\": \"\xff\"}"), HasSubstr("is not JSON"));
  EXPECT_THAT(error_of("\x8f\xff"), ::testing::EndsWith("last read: '?'"));
}

TEST(JsonText, RefusesNumbersThatNoDoubleHolds) {
  EXPECT_THAT(error_of("{\"a\": 1e999}"), HasSubstr("1e999"));
}

TEST(JsonText, RefusesWhatIsNestedTooDeeply) {
  const std::string levels(32, '[');
  EXPECT_EQ(error_of(levels + std::string(32, ']')), "");
  EXPECT_THAT(error_of(std::string(100'000, '[')), StartsWith("a.json: is nested too deeply"));
}

TEST(JsonText, RefusesKeysGivenTwice) {
  EXPECT_THAT(error_of(R"({"a": 1, "a": 2})"), StartsWith("a.json: /a: is given twice"));
  EXPECT_THAT(error_of(R"({"b": {"c": 0}, "a": [{}, [7, {"c": 1}], {"c": 1, "d": {}, "c": 2}]})"),
              StartsWith("a.json: /a/2/c: is given twice"));
}

// As a callback of the parser does it, this takes minutes.
TEST(JsonText, ALongListTakesTimeByItsLength) {
  std::string text = "[{}";
  for (int i = 0; i < 200'000; ++i) text += ",{}";
  EXPECT_EQ(parse_json_text(text + "]", "").size(), 200'001U);
}

TEST(JsonText, AKeyMayComeAgainInAnotherObject) {
  EXPECT_EQ(error_of(R"({"a": {"a": 1}, "b": [{"a": 1}, {"a": 1}]})"), "");
}

TEST(JsonText, PointersEscapeTheirMarks) {
  EXPECT_EQ(pointer_to("/a", "b"), "/a/b");
  EXPECT_EQ(pointer_to("", "m/s~"), "/m~1s~0");
}

TEST(JsonText, ShowsLongValuesCut) {
  EXPECT_EQ(shown("short"), "\"short\"");
  EXPECT_EQ(shown(std::string(58, 'x')).size(), 60U);
  EXPECT_EQ(shown(std::string(59, 'x')).size(), 60U);
  EXPECT_THAT(shown(std::string(59, 'x')), ::testing::EndsWith("x..."));
}

TEST(JsonText, WholeNumbersPrintWithoutAPoint) {
  EXPECT_EQ(json_text(plain_number(50)), "50");
  EXPECT_EQ(json_text(plain_number(-0.5)), "-0.5");
  EXPECT_EQ(json_text(plain_number(-9007199254740991)), "-9007199254740991");
  EXPECT_EQ(json_text(plain_number(1e300)), "1e+300");
  EXPECT_EQ(json_text(plain_number(-1e300)), "-1e+300");
}

}  // namespace
}  // namespace splid
