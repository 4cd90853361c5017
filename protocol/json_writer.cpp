#include "protocol/json_writer.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "protocol/json_value.hpp"

namespace splid {

std::string number_text(double value) {
  constexpr double exact_below = 9007199254740992;  // 2^53
  if (value == std::trunc(value) && std::abs(value) < exact_below) {
    return std::to_string(static_cast<std::int64_t>(value));
  }
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

std::string json_string(std::string_view text) { return json_text(nlohmann::json(text)); }

std::string json_numbers(std::span<const double> values) {
  std::string json = "[";
  for (const double value : values) {
    if (json.size() > 1) json += ',';
    json += number_text(value);
  }
  return json + "]";
}

JsonWriter& JsonWriter::number(std::string_view key, std::optional<double> value) {
  if (!value || !std::isfinite(*value)) return *this;
  return raw(key, number_text(*value));
}

JsonWriter& JsonWriter::object(std::string_view key, const JsonWriter& members) {
  return members.members_.empty() ? *this : raw(key, members.finish());
}

JsonWriter& JsonWriter::raw(std::string_view key, std::string_view json) {
  if (!members_.empty()) members_ += ',';
  members_ += json_string(key);
  members_ += ':';
  members_ += json;
  return *this;
}

JsonWriter message_schema(std::string_view schema) {
  JsonWriter json;
  json.text("schema", schema).raw("v", "[1,0]");
  return json;
}

JsonWriter message_head(std::string_view schema, double timestamp_s, std::uint64_t sequence) {
  JsonWriter json = message_schema(schema);
  json.number("timestamp", timestamp_s).integer("sequence", sequence);
  return json;
}

void write_uncounted_losses(JsonWriter& json, std::uint64_t losses) {
  if (losses > 0) json.integer("uncounted_losses", losses);
}

}  // namespace splid
