#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "config/config.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/schema_table.hpp"

namespace splid {
namespace {

using nlohmann::ordered_json;

std::string read_text(const std::string& file) {
  std::ifstream in(SPLID_SOURCE_DIR "/" + file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// With SPLID_UPDATE set, generated files are written instead of compared.
void expect_generated(const std::string& file, const std::string& text) {
  if (std::getenv("SPLID_UPDATE") != nullptr) {
    std::ofstream(SPLID_SOURCE_DIR "/" + file, std::ios::binary) << text;
  }
  EXPECT_TRUE(read_text(file) == text)
      << file << " is not what the options say; write it anew with\n"
      << "SPLID_UPDATE=1 ctest --preset release -R config.ConfigSchema";
}

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
  expect_generated("config/config.schema.json", config_schema());
}

TEST(ConfigSchema, IsWhatTheManualSays) {
  const std::string mark =
      "<!-- Generated from here on; see tests/config/config_schema_test.cpp -->\n";
  const std::string manual = read_text("docs/reference/configuration.md");
  const std::size_t begin = manual.find(mark);
  ASSERT_NE(begin, std::string::npos);
  expect_generated("docs/reference/configuration.md",
                   manual.substr(0, begin) + mark + "\n" +
                       test::SchemaTable::of(ordered_json_value_if_any(config_schema())));
}

}  // namespace
}  // namespace splid
