#include "config/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "config/hidden_keys.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

using nlohmann::json;

constexpr std::size_t max_depth = 32;

// Follows a text from event to event, to find keys that an object has twice, of which the parser
// keeps the last. (A callback of the parser costs the square of an array's length.)
class DuplicateKeys final : public nlohmann::json_sax<json> {
 public:
  // The JSON pointer of the first such key; empty: none.
  [[nodiscard]] const std::string& found() const { return found_; }

  bool null() override { return next_element(); }
  bool boolean(bool /*value*/) override { return next_element(); }
  bool number_integer(std::int64_t /*value*/) override { return next_element(); }
  bool number_unsigned(std::uint64_t /*value*/) override { return next_element(); }
  bool number_float(double /*value*/, const std::string& /*text*/) override {
    return next_element();
  }
  bool string(std::string& /*value*/) override { return next_element(); }
  bool binary(json::binary_t& /*value*/) override { return next_element(); }
  bool start_object(std::size_t /*elements*/) override { return begin(false); }
  bool start_array(std::size_t /*elements*/) override { return begin(true); }
  bool end_object() override { return end(); }
  bool end_array() override { return end(); }
  bool key(std::string& key) override;
  bool parse_error(std::size_t /*byte*/, const std::string& /*token*/,
                   const json::exception& /*error*/) override {
    return false;
  }

 private:
  struct Level {
    bool is_array = false;
    std::size_t elements = 0;  // begun so far
    std::string key;           // last seen
    std::set<std::string> keys;
  };

  bool next_element() {
    if (!levels_.empty() && levels_.back().is_array) ++levels_.back().elements;
    return true;
  }
  bool begin(bool is_array) {
    next_element();
    levels_.emplace_back().is_array = is_array;
    return true;
  }
  bool end() {
    levels_.pop_back();
    return true;
  }

  std::vector<Level> levels_;
  std::string found_;
};

bool DuplicateKeys::key(std::string& key) {
  levels_.back().key = key;
  if (levels_.back().keys.insert(key).second) return true;
  for (const Level& level : levels_) {
    found_ = pointer_to(found_, level.is_array ? std::to_string(level.elements - 1) : level.key);
  }
  return false;
}

// byte: the place of the last byte that was read. Bytes, lines and columns count from 1.
std::string place(const std::string& text, std::size_t byte) {
  const std::string_view before = std::string_view(text).substr(0, byte == 0 ? 0 : byte - 1);
  const auto lines = std::count(before.begin(), before.end(), '\n');
  const std::size_t feed = before.rfind('\n');
  const std::size_t column = before.size() - (feed == std::string_view::npos ? 0 : feed + 1) + 1;
  return "line " + std::to_string(lines + 1) + ", column " + std::to_string(column);
}

// The library's message without its own number and place.
std::string reason(const std::string& message) {
  constexpr std::string_view marks[] = {"syntax error ", "[json.exception."};
  const std::size_t syntax = message.find(marks[0]);
  if (syntax != std::string::npos) return message.substr(syntax);
  const std::size_t bracket =
      message.starts_with(marks[1]) ? message.find("] ") : std::string::npos;
  return bracket == std::string::npos ? message : message.substr(bracket + 2);
}

// It ends in the text that was read last, which may be long.
std::string quoted_reason(const json::exception& error) {
  return shown_text(reason(error.what()), 2 * most_quoted);
}

}  // namespace

nlohmann::json parse_json_text(const std::string& text, const std::string& file) {
  if (json_depth(text) > max_depth) throw Error(Fault::usage, file + ": is nested too deeply");
  json value;
  try {
    value = json_value(text);
  } catch (const json::parse_error& error) {
    throw Error(Fault::usage, file + ": " + place(text, error.byte) +
                                  ": is not JSON: " + hide_keys(quoted_reason(error)));
  } catch (const json::exception& error) {  // a number that no double holds
    throw Error(Fault::usage, file + ": " + quoted_reason(error));
  }
  DuplicateKeys duplicates;
  read_json_events(text, duplicates);
  if (!duplicates.found().empty()) {
    throw Error(Fault::usage, file + ": " + shown_text(duplicates.found(), most_quoted) +
                                  ": is given twice in the same object; remove one of the two");
  }
  return value;
}

std::string pointer_to(const std::string& object_pointer, const std::string& key) {
  std::string pointer = object_pointer + "/";
  for (const char c : key) {
    if (c == '~') {
      pointer += "~0";
    } else if (c == '/') {
      pointer += "~1";
    } else {
      pointer += c;
    }
  }
  return pointer;
}

std::string shown(const nlohmann::json& value) {
  constexpr std::size_t max_bytes = 60;
  std::string text = hide_keys(value.dump(-1, ' ', true));
  if (text.size() > max_bytes) text = text.substr(0, max_bytes - 3) + "...";
  return text;
}

nlohmann::ordered_json plain_number(double value) {
  constexpr double exact_integers = 9007199254740992.0;  // 2^53
  const bool is_whole = std::trunc(value) == value && std::abs(value) < exact_integers;
  if (is_whole) return static_cast<std::int64_t>(value);
  return value;
}

}  // namespace splid
