#include "config/option_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <utility>

#include "config/channel_name.hpp"
#include "config/hidden_keys.hpp"
#include "config/json_text.hpp"
#include "config/key_unit.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"
#include "protocol/nearest_name.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

using nlohmann::json;

// As many as a path has on Linux.
constexpr std::size_t most_text_bytes = 4096;

std::string listed(std::span<const char* const> names) {
  std::string list;
  for (const char* name : names) list += (list.empty() ? "" : ", ") + std::string(name);
  return list;
}

// Design note: people write 4e6, which JSON reads as a double. Up to 2^53 such a double is an exact
// whole number.
bool is_whole(const json& value) {
  constexpr double max_exact = 9007199254740992.0;
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= INT64_MAX;
  if (value.is_number_integer()) return true;
  if (!value.is_number_float()) return false;
  const auto number = value.get<double>();
  return std::abs(number) <= max_exact && std::trunc(number) == number;
}

// "0.1 is below 1 ps, the least allowed". pointer: of the value, whose unit its key's name has.
std::string out_of_bounds(const json& value, const char* side, const std::string& bound,
                          std::string_view pointer) {
  // The elements of an array have the unit of the array's key.
  const std::size_t end = pointer.find_last_not_of("/0123456789");
  const std::string_view unit = unit_of_key(pointer.substr(0, end + 1));
  return shown(value) + " is " + side + " " + bound + (unit.empty() ? "" : " ") +
         std::string(unit) + ", the " + (side == std::string_view("below") ? "least" : "most") +
         " allowed";
}

std::string number_text(double value) { return json_text(plain_number(value)); }

}  // namespace

OptionReader::OptionReader(const json& object, std::string file, std::string pointer)
    : object_(object), file_(std::move(file)), pointer_(std::move(pointer)) {
  if (!object_.is_object()) fail(pointer_, shown(object_) + " is no object; write { ... }");
}

void OptionReader::number(const char* key, double& value, Bounds bounds, const char*) {
  if (const json* given = take(key)) value = read_number(*given, pointer_to(pointer_, key), bounds);
}

void OptionReader::number(const char* key, std::optional<double>& value, Bounds bounds,
                          const char*) {
  if (const json* given = take(key)) value = read_number(*given, pointer_to(pointer_, key), bounds);
}

void OptionReader::integer(const char* key, std::int64_t& value, std::int64_t min, std::int64_t max,
                           const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  const std::string pointer = pointer_to(pointer_, key);
  if (!is_whole(*given)) fail(pointer, shown(*given) + " is no whole number of at most 63 bits");
  const auto whole = given->get<std::int64_t>();
  if (whole < min) fail(pointer, out_of_bounds(*given, "below", std::to_string(min), pointer));
  if (whole > max) fail(pointer, out_of_bounds(*given, "above", std::to_string(max), pointer));
  value = whole;
}

void OptionReader::flag(const char* key, bool& value, const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  if (!given->is_boolean()) {
    fail(pointer_to(pointer_, key), shown(*given) + " is neither true nor false");
  }
  value = given->get<bool>();
}

void OptionReader::text(const char* key, std::string& value, const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  if (!given->is_string()) {
    fail(pointer_to(pointer_, key), shown(*given) + " is no text; put it in quotes");
  }
  value = given->get<std::string>();
  if (value.size() <= most_text_bytes) return;
  fail(pointer_to(pointer_, key), shown(*given) + " has " + std::to_string(value.size()) +
                                      " bytes; a text has at most " +
                                      std::to_string(most_text_bytes));
}

void OptionReader::path(const char* key, std::string& value, const char* doc) {
  if (!object_.contains(key)) {
    take(key);
    return;
  }
  text(key, value, doc);
  const std::filesystem::path given = value;
  if (given.empty()) fail(pointer_to(pointer_, key), "\"\" names no file");
  const std::filesystem::path folder = std::filesystem::path(file_).parent_path();
  value = (folder / given).lexically_normal().string();
}

void OptionReader::choice(const char* key, std::size_t& index, std::span<const char* const> names,
                          const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  const std::string name = given->is_string() ? given->get<std::string>() : "";
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    const char* nearest = nearest_name(name, names);
    fail(pointer_to(pointer_, key), shown(*given) + " is none of " + listed(names) +
                                        (nearest == nullptr ? "" : "; did you mean ") +
                                        (nearest == nullptr ? "" : nearest + std::string("?")));
  }
  index = static_cast<std::size_t>(found - names.begin());
}

void OptionReader::numbers(const char* key, std::vector<double>& values, Bounds bounds,
                           const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  const std::string pointer = pointer_to(pointer_, key);
  if (!given->is_array()) fail(pointer, shown(*given) + " is no array of numbers");
  values.clear();
  for (std::size_t i = 0; i < given->size(); ++i) {
    values.push_back(read_number((*given)[i], pointer_to(pointer, std::to_string(i)), bounds));
  }
}

void OptionReader::pairs(const char* key, std::vector<NumberPair>& values,
                         const std::array<Bounds, 2>& bounds, const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  const std::string pointer = pointer_to(pointer_, key);
  if (!given->is_array()) fail(pointer, shown(*given) + " is no array of pairs of numbers");
  values.assign(given->size(), {});
  for (std::size_t i = 0; i < given->size(); ++i) {
    const json& pair = (*given)[i];
    const std::string place = pointer_to(pointer, std::to_string(i));
    if (!pair.is_array() || pair.size() != 2) fail(place, shown(pair) + " is no pair of numbers");
    for (std::size_t k = 0; k < 2; ++k) {
      values[i].at(k) = read_number(pair[k], pointer_to(place, std::to_string(k)), bounds.at(k));
    }
  }
}

void OptionReader::channel(const char* key, std::string& value, const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  const bool is_none = given->is_string() && given->get_ref<const std::string&>().empty();
  value = is_none ? "" : read_channel(*given, pointer_to(pointer_, key));
}

void OptionReader::channels(const char* key, std::vector<std::string>& values, const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  const std::string pointer = pointer_to(pointer_, key);
  values.clear();
  if (!given->is_array()) {
    values.push_back(read_channel(*given, pointer));
    return;
  }
  for (std::size_t i = 0; i < given->size(); ++i) {
    values.push_back(read_channel((*given)[i], pointer_to(pointer, std::to_string(i))));
  }
}

void OptionReader::object(const char* key, const std::function<void(OptionVisitor&)>& members,
                          const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  OptionReader reader(*given, file_, pointer_to(pointer_, key));
  members(reader);
  reader.finish();
}

void OptionReader::objects(const char* key, const std::function<void(std::size_t)>& resize,
                           const std::function<void(OptionVisitor&, std::size_t)>& member,
                           std::size_t, const char*) {
  const json* given = take(key);
  if (given == nullptr) return;
  const std::string pointer = pointer_to(pointer_, key);
  if (!given->is_array()) fail(pointer, shown(*given) + " is no array; write [ { ... }, ... ]");
  resize(given->size());
  for (std::size_t i = 0; i < given->size(); ++i) {
    OptionReader reader((*given)[i], file_, pointer_to(pointer, std::to_string(i)));
    member(reader, i);
    reader.finish();
  }
}

// The keys that are described later may be given: only finish() knows which are slips of typing.
void OptionReader::require(const char* key) { need(key, "add it"); }

void OptionReader::need(const char* key, const char* advice) {
  if (!object_.contains(key)) missing_.emplace_back(key, advice);
}

const json* OptionReader::take(const char* key) {
  known_.push_back(key);
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

std::vector<std::string> OptionReader::unknown_keys() const {
  std::vector<std::string> unknown;
  for (const auto& member : object_.items()) {
    const std::string& key = member.key();
    const auto is_this = [&](const char* name) { return key == name; };
    if (std::none_of(known_.begin(), known_.end(), is_this)) unknown.push_back(key);
  }
  return unknown;
}

void OptionReader::finish() const {
  const std::vector<std::string> unknown = unknown_keys();
  for (const auto& [key, advice] : missing_) {
    std::vector<const char*> names;
    names.reserve(unknown.size());
    for (const std::string& name : unknown) names.push_back(name.c_str());
    const char* nearest = nearest_name(key, names);
    fail(pointer_to(pointer_, key),
         "is missing and has no default; " +
             (nearest == nullptr ? std::string(advice)
                                 : "\"" + shown_text(nearest, most_quoted) +
                                       "\" is an unknown key: did you mean " + key + "?"));
  }
  if (unknown.empty()) return;
  fail(pointer_to(pointer_, unknown.front()),
       "is an unknown key" + suggest_name(unknown.front(), known_));
}

double OptionReader::read_number(const json& value, const std::string& pointer,
                                 Bounds bounds) const {
  if (!value.is_number()) fail(pointer, shown(value) + " is no number");
  const auto number = value.get<double>();
  if (!(number >= bounds.min)) {  // NaN too
    fail(pointer, out_of_bounds(value, "below", number_text(bounds.min), pointer));
  }
  if (number > bounds.max) {
    fail(pointer, out_of_bounds(value, "above", number_text(bounds.max), pointer));
  }
  return number;
}

std::string OptionReader::read_channel(const json& value, const std::string& pointer) const {
  std::string name = value.is_string() ? value.get<std::string>() : json_text(value);
  if (!parse_channel(name) || !(value.is_string() || value.is_number_integer())) {
    fail(pointer, shown(value) +
                      " is no channel; it is \"sync\", \"marker:1\" to \"marker:15\", or an input, "
                      "-128 to 126");
  }
  return name;
}

void OptionReader::fail(const std::string& pointer, const std::string& what) const {
  throw Error(Fault::usage,
              file_ + ": " +
                  (pointer.empty() ? "" : shown_text(hide_keys(pointer), most_quoted) + ": ") +
                  what);
}

void read_header(OptionReader& reader, const std::string& file, const std::string& schema,
                 int major_version) {
  const auto refuse = [&file](const std::string& what) {
    throw Error(Fault::usage, file + ": " + what);
  };
  const json* name = reader.take("schema");
  if (name != nullptr && *name != schema) {
    refuse("/schema: " + shown(*name) + " is not \"" + schema + "\"; is this a configuration?");
  }
  const json* version = reader.take("v");
  if (version == nullptr) return;
  const bool is_pair = version->is_array() && version->size() == 2 &&
                       (*version)[0].is_number_unsigned() && (*version)[1].is_number_unsigned();
  if (!is_pair || (*version)[0] != major_version) {
    refuse("/v: " + shown(*version) + " is not [" + std::to_string(major_version) +
           ", x], the version that this splid reads");
  }
}

}  // namespace splid
