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

// Follows a parse from event to event, to find keys that an object has twice. The parser itself
// keeps the last of the two and does not tell.
class DuplicateKeys {
 public:
  void see(json::parse_event_t event, const json& parsed) {
    switch (event) {
      case json::parse_event_t::key:
        see_key(parsed.get_ref<const std::string&>());
        break;
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        next_element();
        levels_.push_back({event == json::parse_event_t::array_start, 0, {}, {}});
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end:
        levels_.pop_back();
        break;
      case json::parse_event_t::value:
        next_element();
        break;
    }
  }

  // The JSON pointer of the first such key; empty: none.
  [[nodiscard]] const std::string& found() const { return found_; }

 private:
  struct Level {
    bool is_array;
    std::size_t elements;  // begun so far
    std::string key;       // last seen
    std::set<std::string> keys;
  };

  void next_element() {
    if (!levels_.empty() && levels_.back().is_array) ++levels_.back().elements;
  }

  void see_key(const std::string& key) {
    levels_.back().key = key;
    const bool is_new = levels_.back().keys.insert(key).second;
    if (is_new || !found_.empty()) return;
    for (const Level& level : levels_) {
      found_ = pointer_to(found_, level.is_array ? std::to_string(level.elements - 1) : level.key);
    }
  }

  std::vector<Level> levels_;
  std::string found_;
};

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
  // A value in an error is printed by recursion, so that its depth must have a bound.
  constexpr int max_depth = 32;
  DuplicateKeys duplicates;
  json value;
  try {
    value = json_value(text, [&](int depth, json::parse_event_t event, const json& parsed) {
      if (depth > max_depth) throw Error(Fault::usage, file + ": is nested too deeply");
      duplicates.see(event, parsed);
      return true;
    });
  } catch (const json::parse_error& error) {
    throw Error(Fault::usage, file + ": " + place(text, error.byte) +
                                  ": is not JSON: " + hide_keys(quoted_reason(error)));
  } catch (const json::exception& error) {  // a number that no double holds
    throw Error(Fault::usage, file + ": " + quoted_reason(error));
  }
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
