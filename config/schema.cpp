#include "config/schema.hpp"

#include <cmath>

#include "config/channel_name.hpp"
#include "config/json_text.hpp"
#include "config/option_writer.hpp"

namespace splid {
namespace {

using nlohmann::ordered_json;

void add_bounds(ordered_json& schema, Bounds bounds) {
  schema["type"] = "number";
  if (std::isfinite(bounds.min)) schema["minimum"] = plain_number(bounds.min);
  if (std::isfinite(bounds.max)) schema["maximum"] = plain_number(bounds.max);
}

ordered_json channel_schema(bool may_be_empty) {
  const char* names = "^(sync|marker:([1-9]|1[0-5])|-?[0-9]+)$";
  const char* names_or_none = "^(sync|marker:([1-9]|1[0-5])|-?[0-9]+)?$";
  return {{{"type", "integer"}, {"minimum", min_input}, {"maximum", max_input}},
          {{"type", "string"}, {"pattern", may_be_empty ? names_or_none : names}}};
}

// The value that a key has when it is not given, in the form that OptionWriter writes.
template <class Visit>
void add_default(ordered_json& schema, const char* key, const Visit& visit) {
  ordered_json defaults = ordered_json::object();
  OptionWriter writer(defaults);
  visit(writer);
  if (defaults.contains(key)) schema["default"] = defaults[key];
}

}  // namespace

SchemaWriter::SchemaWriter(ordered_json& schema) : schema_(schema) {
  schema_["type"] = "object";
  schema_["additionalProperties"] = false;
  schema_["required"] = ordered_json::array();
  schema_["properties"] = ordered_json::object();
}

ordered_json& SchemaWriter::add(const char* key, const char* doc) {
  ordered_json& member = schema_["properties"][key];
  member = ordered_json::object();
  member["description"] = doc;
  return member;
}

void SchemaWriter::number(const char* key, double& value, Bounds bounds, const char* doc) {
  ordered_json& member = add(key, doc);
  add_bounds(member, bounds);
  member["default"] = plain_number(value);
}

void SchemaWriter::number(const char* key, std::optional<double>& value, Bounds bounds,
                          const char* doc) {
  ordered_json& member = add(key, doc);
  add_bounds(member, bounds);
  if (value) member["default"] = plain_number(*value);
}

void SchemaWriter::integer(const char* key, std::int64_t& value, std::int64_t min, std::int64_t max,
                           const char* doc) {
  ordered_json& member = add(key, doc);
  member["type"] = "integer";
  member["minimum"] = min;
  member["maximum"] = max;
  member["default"] = value;
}

void SchemaWriter::flag(const char* key, bool& value, const char* doc) {
  ordered_json& member = add(key, doc);
  member["type"] = "boolean";
  member["default"] = value;
}

void SchemaWriter::text(const char* key, std::string& value, const char* doc) {
  ordered_json& member = add(key, doc);
  member["type"] = "string";
  if (!value.empty()) member["default"] = value;
}

void SchemaWriter::path(const char* key, std::string& value, const char* doc) {
  ordered_json& member = add(key, doc);
  member["type"] = "string";
  member["minLength"] = 1;
  member["format"] = "path";
  if (!value.empty()) member["default"] = value;
}

void SchemaWriter::choice(const char* key, std::size_t& index, std::span<const char* const> names,
                          const char* doc) {
  ordered_json& member = add(key, doc);
  member["enum"] = std::vector<std::string>(names.begin(), names.end());
  member["default"] = names[index];
}

void SchemaWriter::numbers(const char* key, std::vector<double>& values, Bounds bounds,
                           const char* doc) {
  ordered_json& member = add(key, doc);
  member["type"] = "array";
  add_bounds(member["items"], bounds);
  add_default(member, key, [&](OptionWriter& writer) { writer.numbers(key, values, bounds, doc); });
}

void SchemaWriter::pairs(const char* key, std::vector<NumberPair>& values,
                         const std::array<Bounds, 2>& bounds, const char* doc) {
  ordered_json& member = add(key, doc);
  member["type"] = "array";
  ordered_json& pair = member["items"];
  pair["type"] = "array";
  pair["minItems"] = pair["maxItems"] = 2;
  for (const Bounds& column : bounds) add_bounds(pair["prefixItems"].emplace_back(), column);
  add_default(member, key, [&](OptionWriter& writer) { writer.pairs(key, values, bounds, doc); });
}

void SchemaWriter::channel(const char* key, std::string& value, const char* doc) {
  ordered_json& member = add(key, doc);
  member["anyOf"] = channel_schema(true);
  add_default(member, key, [&](OptionWriter& writer) { writer.channel(key, value, doc); });
}

void SchemaWriter::channels(const char* key, std::vector<std::string>& values, const char* doc) {
  ordered_json& member = add(key, doc);
  member["anyOf"] = channel_schema(false);
  member["anyOf"].push_back({{"type", "array"}, {"items", {{"anyOf", channel_schema(false)}}}});
  add_default(member, key, [&](OptionWriter& writer) { writer.channels(key, values, doc); });
}

void SchemaWriter::object(const char* key, const std::function<void(OptionVisitor&)>& members,
                          const char* doc) {
  SchemaWriter writer(add(key, doc));
  members(writer);
}

void SchemaWriter::objects(const char* key, const std::function<void(std::size_t)>& resize,
                           const std::function<void(OptionVisitor&, std::size_t)>& member,
                           std::size_t count, const char* doc) {
  ordered_json& array = add(key, doc);
  array["type"] = "array";
  add_default(array, key,
              [&](OptionWriter& writer) { writer.objects(key, resize, member, count, doc); });
  resize(1);  // one element, to be described
  SchemaWriter writer(array["items"]);
  member(writer, 0);
  resize(count);
}

void SchemaWriter::require(const char* key) { schema_["required"].push_back(key); }

}  // namespace splid
