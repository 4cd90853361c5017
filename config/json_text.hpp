#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace splid {

// Parses JSON that people wrote by hand. file: its name, for errors only.
// Errors: Error(Fault::usage) with file, line and column where the text is no JSON, with the JSON
// pointer where an object has a key twice, since one of the two would be ignored, and where values
// are nested more than 32 levels deep.
nlohmann::json parse_json_text(const std::string& text, const std::string& file);

// The JSON pointer (RFC 6901) of an object's member.
std::string pointer_to(const std::string& object_pointer, const std::string& key);

// A value as an error's sentence shows it: its JSON, cut to 60 bytes, with keys hidden.
std::string shown(const nlohmann::json& value);

// A whole number prints without its ".0": 50, not 50.0.
nlohmann::ordered_json plain_number(double value);

}  // namespace splid
