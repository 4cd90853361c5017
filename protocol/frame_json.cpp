#include "protocol/frame_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/frame_members.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/member_writer.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

bool read_name(const std::string& name, FrameStatus& status) {
  const auto* found = std::find(frame_status_names.begin(), frame_status_names.end(), name);
  if (found == frame_status_names.end()) return false;
  status = static_cast<FrameStatus>(found - frame_status_names.begin());
  return true;
}

bool read_name(const std::string& name, Mode& mode) {
  const auto found = mode_from_string(name);
  if (found) mode = *found;
  return found.has_value();
}

// Reads each member that is shown to it. where: the object's JSON pointer.
class FrameReader {
 public:
  FrameReader(const nlohmann::json& json, std::string where)
      : json_(json), where_(std::move(where)) {
    if (!json.is_object()) fail("", "is not an object");
  }

  void number(const Member& member, std::optional<double>& value) const {
    const nlohmann::json* found = find(member.name);
    if (found == nullptr) return;
    if (!found->is_number()) fail(member.name, "is not a number");
    value = found->get<double>();
  }
  void count(const Member& member, std::optional<std::uint64_t>& value) const {
    const nlohmann::json* found = find(member.name);
    if (found == nullptr) return;
    if (!found->is_number_unsigned()) fail(member.name, "is not a count");
    value = found->get<std::uint64_t>();
  }
  void text(const Member& member, std::optional<std::string>& value) const {
    const nlohmann::json* found = find(member.name);
    if (found == nullptr) return;
    if (!found->is_string()) fail(member.name, "is not a string");
    value = found->get<std::string>();
  }
  // Those that are always there.
  void number(const Member& member, double& value) const {
    std::optional<double> found;
    number(member, found);
    value = required(member.name, found);
  }
  void count(const Member& member, std::uint64_t& value) const {
    std::optional<std::uint64_t> found;
    count(member, found);
    value = required(member.name, found);
  }
  void whole(const Member& member, std::int64_t& value) const {
    value = required(member.name, whole_number(required_text(member)));
  }
  template <class Enum>
  void choice(const Member& member, Enum& value) const {
    const std::string name = required_text(member);
    if (!read_name(name, value)) fail(member.name, "has the unknown value " + name);
  }

  void text(const Member& member, std::string& value) const { value = required_text(member); }

  void text_if_any(const Member& member, std::string& value) const {
    if (find(member.name) != nullptr) text(member, value);
  }
  void count_if_any(const Member& member, std::uint64_t& value) const {
    if (find(member.name) != nullptr) count(member, value);
  }
  void flag(const Member& /*member*/, bool /*value*/) const {}  // follows from others
  template <class Owner, class Members>
  void group(const Member& member, Owner& owner, Members members) const {
    const nlohmann::json* found = find(member.name);
    if (found == nullptr) return;
    FrameReader inner(*found, where_ + "/" + member.name);
    members(owner, inner);
  }
  template <class Part, class Members>
  void part(const Member& member, std::optional<Part>& part, Members members) const {
    if (find(member.name) != nullptr) group(member, part.emplace(Part{}), members);
  }
  template <class Item, class Members>
  void list(const Member& member, std::optional<std::vector<Item>>& items, Members members) const {
    if (find(member.name) != nullptr) list_if_any(member, items.emplace(), members);
  }
  template <class Item, class Members>
  void list_if_any(const Member& member, std::vector<Item>& items, Members members) const {
    const nlohmann::json* found = find(member.name);
    if (found == nullptr) return;
    if (!found->is_array()) fail(member.name, "is not an array");
    for (const nlohmann::json& item : *found) {
      FrameReader inner(item, where_ + "/" + member.name + "/" + std::to_string(items.size()));
      members(items.emplace_back(), inner);
    }
  }
  void check_schema() const {
    const std::string schema = required_text({"schema", "", ""});
    if (schema != "splid.frame") fail("schema", "is " + schema + ", not splid.frame");
    const nlohmann::json* version = find("v");
    if (version == nullptr) fail("v", "is missing");
    if (!version->is_array() || version->empty() || version->front() != 1) {
      fail("v", "is not [1,minor]; this program reads version 1");
    }
  }

 private:
  [[nodiscard]] const nlohmann::json* find(const char* key) const {
    const auto found = json_.find(key);
    return found == json_.end() ? nullptr : &*found;
  }
  template <class Value>
  [[nodiscard]] Value required(const char* key, const std::optional<Value>& value) const {
    if (!value) fail(key, "is missing");
    return *value;
  }
  [[nodiscard]] std::string required_text(const Member& member) const {
    std::optional<std::string> found;
    text(member, found);
    return required(member.name, found);
  }
  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    throw Error(Fault::data, "frame message: " + where_ + "/" + key + " " + what);
  }

  const nlohmann::json& json_;
  std::string where_;
};

}  // namespace

std::string to_json(const FrameMessage& message) {
  JsonWriter json = message_schema("splid.frame");
  MemberWriter writer(json);
  describe(message, writer);
  return json.finish();
}

std::string to_json(const std::vector<FrameMessage::Finding>& findings) {
  return MemberWriter::array(findings,
                             [](auto& finding, auto& inner) { describe_finding(finding, inner); });
}

std::vector<FrameMessage::Finding> findings_from_json(const std::string& json) {
  try {
    const auto parsed = json_value_if_any(json);
    std::vector<FrameMessage::Finding> findings;
    FrameReader(parsed, "")
        .list_if_any({"findings", "", ""}, findings,
                     [](auto& finding, auto& inner) { describe_finding(finding, inner); });
    return findings;
  } catch (const Error&) {
    return {};
  }
}

FrameMessage frame_from_json(const std::string& json) {
  const auto parsed = json_value_if_any(json);
  if (parsed.is_discarded()) throw Error(Fault::data, "frame message: not JSON");
  const FrameReader reader(parsed, "");
  reader.check_schema();
  FrameMessage message;
  describe(message, reader);
  return message;
}

}  // namespace splid
