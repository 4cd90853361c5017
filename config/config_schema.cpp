#include <nlohmann/json.hpp>

#include "config/config.hpp"
#include "config/schema.hpp"
#include "config/sections.hpp"
#include "protocol/json_value.hpp"

namespace splid {
namespace {

using nlohmann::ordered_json;

void add_header(SchemaWriter& writer) {
  writer.require("schema");
  writer.add("schema", "marks the file as a configuration of splid")["const"] = config_schema_name;
  ordered_json& version = writer.add("v", "version of the format, major and minor");
  version["type"] = "array";
  version["prefixItems"] = {{{"const", config_major_version}},
                            {{"type", "integer"}, {"minimum", 0}}};
  version["minItems"] = 2;
  version["maxItems"] = 2;
  version["default"] = {config_major_version, config_minor_version};
}

ordered_json driver_schema(const std::string& driver) {
  ordered_json schema;
  SchemaWriter writer(schema);
  writer.require("driver");
  writer.add("driver", "name of the driver")["const"] = driver;
  make_source_options(driver)->describe(writer);
  return schema;
}

// The list may stand in a file of its own.
void allow_file(ordered_json& pixels) {
  ordered_json list = pixels;
  for (const char* key : {"description", "default"}) list.erase(key);
  const ordered_json file{{"type", "string"}, {"minLength", 1}, {"format", "path"}};
  pixels = {{"description", pixels["description"]}, {"anyOf", {list, file}}};
}

}  // namespace

std::string config_schema() {
  ordered_json schema;
  schema["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  schema["title"] = "Configuration of splid";
  SchemaWriter writer(schema);
  add_header(writer);
  writer.require("source");
  ordered_json& source = writer.add("source", source_doc);
  source["oneOf"] = ordered_json::array();
  for (const std::string& driver : source_names()) source["oneOf"].push_back(driver_schema(driver));
  Config defaults;
  describe_common_sections(defaults, writer);
  allow_file(schema["properties"]["pixels"]);
  return indented_json_text(schema) + "\n";
}

}  // namespace splid
