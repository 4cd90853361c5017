#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace splid {

// The fewest digits that read back as the same double; whole numbers below 2^53 without exponent
// or decimal point. Not for infinities and NaN, which JSON has no word for.
std::string number_text(double value);

// As a JSON string, quotes included. Bytes that are no UTF-8 become U+FFFD.
std::string json_string(std::string_view text);

// One line: [1,2.5].
std::string json_numbers(std::span<const double> values);

// Writes one JSON object on one line, its members in the order of the calls.
//
// Design note: nlohmann's own output writes 50.0 for 50 and now and then a digit more than needed
// (Grisu2); a line that people read and tests pin should have one way of writing a number.
class JsonWriter {
 public:
  JsonWriter& text(std::string_view key, std::string_view value) {
    return raw(key, json_string(value));
  }
  JsonWriter& flag(std::string_view key, bool value) { return raw(key, value ? "true" : "false"); }
  template <std::integral Integer>
  JsonWriter& integer(std::string_view key, Integer value) {
    return raw(key, std::to_string(value));
  }
  // Left out if absent or not finite.
  JsonWriter& number(std::string_view key, std::optional<double> value);
  // Left out if it has no members.
  JsonWriter& object(std::string_view key, const JsonWriter& members);
  // json: any JSON value.
  JsonWriter& raw(std::string_view key, std::string_view json);

  [[nodiscard]] std::string finish() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

// Begins a message with its schema and version (docs/reference/messages.md).
JsonWriter message_schema(std::string_view schema);
// The same with the other members that all messages have.
// timestamp_s: UTC.
JsonWriter message_head(std::string_view schema, double timestamp_s, std::uint64_t sequence);

// Writes a message's losses of an unknown number of tags, where there are any: most have none.
void write_uncounted_losses(JsonWriter& json, std::uint64_t losses);

}  // namespace splid
