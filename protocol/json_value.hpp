#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

// JSON as text, and as a value whose members can be asked for. Whoever reads or writes JSON calls
// these, so that nlohmann's parser and serializer are compiled once: each further file that has its
// own takes half a second to a second and a half longer to compile.

namespace splid {

// Errors: nlohmann::json::parse_error where the text is no JSON, nlohmann::json::out_of_range where
// a number is too large for a double.
nlohmann::json json_value(std::string_view text);

// How deeply the brackets of a text are nested, which need not be JSON. A value in an error is
// printed by recursion, so that whoever reads a file bounds its depth first.
std::size_t json_depth(std::string_view text);

// Tells `events` of each value, key and bracket of a text, in its order, until a handler returns
// false. An error of the text is told, too, not thrown.
void read_json_events(std::string_view text, nlohmann::json_sax<nlohmann::json>& events);

// For text from elsewhere that need not be JSON: then the value's is_discarded() is true.
nlohmann::json json_value_if_any(std::string_view text);

// The same, with an object's members in the order of the text.
nlohmann::ordered_json ordered_json_value_if_any(std::string_view text);

// On one line. Bytes that are no UTF-8 become U+FFFD.
std::string json_text(const nlohmann::json& value);
std::string json_text(const nlohmann::ordered_json& value);

// Written for people: a member a line, indented by two blanks a level.
std::string indented_json_text(const nlohmann::ordered_json& value);

}  // namespace splid
