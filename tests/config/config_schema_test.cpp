#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "config/config.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/schema_table.hpp"

namespace splid {
namespace {

using nlohmann::ordered_json;

TEST(ConfigSchema, DescribesTheFileItself) {
  const auto schema = ordered_json_value_if_any(config_schema());
  EXPECT_EQ(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
  EXPECT_EQ(schema["additionalProperties"], false);
  EXPECT_EQ(schema["required"], ordered_json_value_if_any(R"(["schema", "source", "pattern"])"));
  EXPECT_EQ(schema["properties"]["schema"]["const"], "splid.config");
  EXPECT_EQ(schema["properties"]["v"]["prefixItems"][0]["const"], 1);
  EXPECT_EQ(schema["properties"]["v"]["default"], ordered_json_value_if_any("[1, 0]"));
  EXPECT_EQ(schema["properties"]["frame"]["properties"]["length_ms"]["default"], 50);
}

TEST(ConfigSchema, HasEveryDriverWithItsOwnKeys) {
  const auto schema = ordered_json_value_if_any(config_schema());
  const ordered_json& drivers = schema["properties"]["source"]["oneOf"];
  ASSERT_EQ(drivers.size(), source_names().size());
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    EXPECT_EQ(drivers[i]["properties"]["driver"]["const"], source_names()[i]);
    EXPECT_EQ(drivers[i]["required"][0], "driver");
    EXPECT_EQ(drivers[i]["additionalProperties"], false);
  }
}

TEST(ConfigSchema, IsTheShippedOne) {
  test::expect_generated("config/config.schema.json", config_schema(), "config.ConfigSchema");
}

TEST(ConfigSchema, IsWhatTheManualSays) {
  const std::string mark =
      "<!-- Generated from here on; see tests/config/config_schema_test.cpp -->\n";
  const std::string manual = test::source_text("docs/reference/configuration.md");
  const std::size_t begin = manual.find(mark);
  ASSERT_NE(begin, std::string::npos);
  test::expect_generated("docs/reference/configuration.md",
                         manual.substr(0, begin) + mark + "\n" +
                             test::SchemaTable::of(ordered_json_value_if_any(config_schema())),
                         "config.ConfigSchema");
}

}  // namespace
}  // namespace splid
