#include "protocol/json_value.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace splid {
namespace {

TEST(JsonValue, ReadsText) {
  EXPECT_EQ(json_value(R"({"a": [1, 2.5]})")["a"][1], 2.5);
  EXPECT_THROW(json_value("{"), nlohmann::json::parse_error);
  EXPECT_THROW(json_value("1e999"), nlohmann::json::out_of_range);
}

TEST(JsonValue, DepthCountsBracketsOutsideStrings) {
  EXPECT_EQ(json_depth("1"), 0U);
  EXPECT_EQ(json_depth(R"([{"[": "\\\"{[{["}, [[]], []])"), 3U);
  EXPECT_EQ(json_depth("]]}["), 1U);
}

TEST(JsonValue, WhatIsNoJsonIsDiscardedWhereThatMayBe) {
  EXPECT_TRUE(json_value_if_any("hello").is_discarded());
  EXPECT_TRUE(ordered_json_value_if_any("").is_discarded());
  EXPECT_EQ(json_value_if_any("[3]")[0], 3);
}

TEST(JsonValue, AnOrderedValueKeepsTheOrderOfItsText) {
  const std::string text = R"({"b":1,"a":2})";
  EXPECT_EQ(json_text(ordered_json_value_if_any(text)), text);
  EXPECT_EQ(json_text(json_value(text)), R"({"a":2,"b":1})");
  EXPECT_EQ(indented_json_text(ordered_json_value_if_any(text)), "{\n  \"b\": 1,\n  \"a\": 2\n}");
}

TEST(JsonValue, BytesThatAreNoUtf8AreReplaced) {
  EXPECT_EQ(json_text(nlohmann::json("a\xff")), "\"a\xEF\xBF\xBD\"");
}

}  // namespace
}  // namespace splid
