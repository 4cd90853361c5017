#include "protocol/json_value.hpp"

namespace splid {
namespace {

template <typename Json>
std::string text_of(const Json& value, int indent = -1) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

nlohmann::json json_value(std::string_view text,
                          const nlohmann::json::parser_callback_t& observer) {
  return nlohmann::json::parse(text, observer);
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
