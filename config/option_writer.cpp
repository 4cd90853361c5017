#include "config/option_writer.hpp"

#include "config/channel_name.hpp"
#include "config/json_text.hpp"

namespace splid {
namespace {

using nlohmann::ordered_json;

// An input is written as a number, as people write it.
ordered_json channel_json(const std::string& name) {
  const std::optional<ChannelName> channel = parse_channel(name);
  if (channel && channel->kind == TagKind::photon) return channel->value;
  return name;
}

}  // namespace

void OptionWriter::number(const char* key, double& value, Bounds, const char*) {
  object_[key] = plain_number(value);
}

void OptionWriter::number(const char* key, std::optional<double>& value, Bounds, const char*) {
  if (value) object_[key] = plain_number(*value);
}

void OptionWriter::integer(const char* key, std::int64_t& value, std::int64_t, std::int64_t,
                           const char*) {
  object_[key] = value;
}

void OptionWriter::flag(const char* key, bool& value, const char*) { object_[key] = value; }

void OptionWriter::text(const char* key, std::string& value, const char*) { object_[key] = value; }

void OptionWriter::path(const char* key, std::string& value, const char*) {
  if (!value.empty()) object_[key] = value;
}

void OptionWriter::choice(const char* key, std::size_t& index, std::span<const char* const> names,
                          const char*) {
  object_[key] = names[index];
}

void OptionWriter::numbers(const char* key, std::vector<double>& values, Bounds, const char*) {
  object_[key] = ordered_json::array();
  for (const double value : values) object_[key].push_back(plain_number(value));
}

void OptionWriter::pairs(const char* key, std::vector<NumberPair>& values,
                         const std::array<Bounds, 2>&, const char*) {
  object_[key] = ordered_json::array();
  for (const NumberPair& pair : values) {
    object_[key].push_back({plain_number(pair[0]), plain_number(pair[1])});
  }
}

void OptionWriter::channel(const char* key, std::string& value, const char*) {
  object_[key] = value.empty() ? ordered_json(value) : channel_json(value);
}

void OptionWriter::channels(const char* key, std::vector<std::string>& values, const char*) {
  object_[key] = ordered_json::array();
  for (const std::string& value : values) object_[key].push_back(channel_json(value));
}

void OptionWriter::object(const char* key, const std::function<void(OptionVisitor&)>& members,
                          const char*) {
  object_[key] = ordered_json::object();
  OptionWriter writer(object_[key]);
  members(writer);
}

void OptionWriter::objects(const char* key, const std::function<void(std::size_t)>&,
                           const std::function<void(OptionVisitor&, std::size_t)>& member,
                           std::size_t count, const char*) {
  object_[key] = ordered_json::array();
  for (std::size_t i = 0; i < count; ++i) {
    object_[key].push_back(ordered_json::object());
    OptionWriter writer(object_[key].back());
    member(writer, i);
  }
}

void OptionWriter::require(const char*) {}

}  // namespace splid
