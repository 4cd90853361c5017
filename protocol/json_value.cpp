#include "protocol/json_value.hpp"

#include <algorithm>

namespace splid {
namespace {

template <typename Json>
std::string text_of(const Json& value, int indent = -1) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

nlohmann::json json_value(std::string_view text) { return nlohmann::json::parse(text); }

std::size_t json_depth(std::string_view text) {
  std::size_t depth = 0, deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') {
      in_string = !in_string;
    } else if (in_string) {
      i += c == '\\' ? 1 : 0;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return deepest;
}

void read_json_events(std::string_view text, nlohmann::json_sax<nlohmann::json>& events) {
  nlohmann::json::sax_parse(text, &events);
}

nlohmann::json json_value_if_any(std::string_view text) {
  return nlohmann::json::parse(text, nullptr, false);
}

nlohmann::ordered_json ordered_json_value_if_any(std::string_view text) {
  return nlohmann::ordered_json::parse(text, nullptr, false);
}

std::string json_text(const nlohmann::json& value) { return text_of(value); }

std::string json_text(const nlohmann::ordered_json& value) { return text_of(value); }

std::string indented_json_text(const nlohmann::ordered_json& value) { return text_of(value, 2); }

}  // namespace splid
