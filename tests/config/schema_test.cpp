#include "config/schema.hpp"

#include <gtest/gtest.h>

#include "protocol/json_value.hpp"
#include "tests/support/every_option.hpp"

namespace splid {
namespace {

using nlohmann::ordered_json;

ordered_json schema_of_every_option() {
  ordered_json schema;
  SchemaWriter writer(schema);
  test::EveryOption options;
  options.describe(writer);
  return schema;
}

ordered_json member(const std::string& key) { return schema_of_every_option()["properties"][key]; }

TEST(Schema, IsOfAnObjectWithoutFurtherKeys) {
  const ordered_json schema = schema_of_every_option();
  EXPECT_EQ(schema["type"], "object");
  EXPECT_EQ(schema["additionalProperties"], false);
  EXPECT_EQ(schema["required"], ordered_json::array());
  EXPECT_EQ(schema["properties"].size(), 13U);
}

TEST(Schema, NumbersHaveBoundsAndDefaults) {
  EXPECT_EQ(json_text(member("length_ms")),
            R"({"description":"a length, ms","type":"number","minimum":0.5,"maximum":60000,)"
            R"("default":50})");
  EXPECT_EQ(json_text(member("count")),
            R"({"description":"a count","type":"integer","minimum":-3,"maximum":8,"default":4})");
  EXPECT_FALSE(member("start_s").contains("default"));
}

TEST(Schema, TextsFlagsAndChoices) {
  EXPECT_EQ(json_text(member("live")),
            R"({"description":"a flag","type":"boolean","default":true})");
  EXPECT_EQ(json_text(member("name")),
            R"({"description":"a name","type":"string","default":"default"})");
  EXPECT_EQ(json_text(member("recording")),
            R"({"description":"a file","type":"string","minLength":1,"format":"path"})");
  EXPECT_EQ(json_text(member("colour")),
            R"({"description":"a choice","enum":["red","green"],"default":"red"})");
}

TEST(Schema, ArraysDescribeTheirItems) {
  EXPECT_EQ(json_text(member("times_s")),
            R"({"description":"some times, s","type":"array",)"
            R"("items":{"type":"number","minimum":0,"maximum":9},"default":[1,2.5]})");
  EXPECT_EQ(json_text(member("table")),
            R"({"description":"a table","type":"array","items":{"type":"array","maxItems":2,)"
            R"("minItems":2,"prefixItems":[{"type":"number","minimum":0,"maximum":9},)"
            R"({"type":"number","minimum":-3,"maximum":3}]},"default":[[1,-2]]})");
  const ordered_json targets = member("targets");
  EXPECT_EQ(targets["items"]["required"], ordered_json_value_if_any(R"(["distance_m"])"));
  EXPECT_EQ(targets["items"]["properties"]["distance_m"]["maximum"], 100);
  EXPECT_EQ(targets["default"], ordered_json::array());
}

TEST(Schema, ChannelsAreNumbersOrNames) {
  const ordered_json sync = member("sync");
  EXPECT_EQ(sync["default"], "sync");
  ASSERT_EQ(sync["anyOf"].size(), 2U);
  EXPECT_EQ(sync["anyOf"][0]["type"], "integer");
  const ordered_json photon = member("photon");
  EXPECT_EQ(photon["default"], ordered_json_value_if_any("[1]"));
  ASSERT_EQ(photon["anyOf"].size(), 3U);
  EXPECT_EQ(photon["anyOf"][2]["type"], "array");
}

}  // namespace
}  // namespace splid
