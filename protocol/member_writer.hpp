#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_members.hpp"
#include "protocol/json_writer.hpp"

namespace splid {

// A visitor of describe() (protocol/frame_members.hpp, status_members.hpp, fold_members.hpp) that
// writes each member as JSON.
class MemberWriter {
 public:
  explicit MemberWriter(JsonWriter& json) : json_(json) {}

  void number(const Member& member, std::optional<double> value) {
    json_.number(member.name, value);
  }
  void count(const Member& member, std::optional<std::uint64_t> value) {
    if (value) json_.integer(member.name, *value);
  }
  void count_if_any(const Member& member, std::uint64_t value) {
    if (value > 0) json_.integer(member.name, value);
  }
  void whole(const Member& member, std::int64_t value) {
    json_.text(member.name, std::to_string(value));
  }
  void flag(const Member& member, bool value) { json_.flag(member.name, value); }
  void flag_if_any(const Member& member, bool value) {
    if (value) json_.flag(member.name, value);
  }
  // json: any JSON value; empty where there is none.
  void json(const Member& member, const std::string& json) {
    if (!json.empty()) json_.raw(member.name, json);
  }
  template <class Enum>
  void choice(const Member& member, Enum value) {
    json_.text(member.name, to_string(value));
  }
  void text(const Member& member, const std::optional<std::string>& value) {
    if (value) json_.text(member.name, *value);
  }
  void text_if_any(const Member& member, const std::string& value) {
    if (!value.empty()) json_.text(member.name, value);
  }
  template <class Item, class Members>
  static std::string array(const std::vector<Item>& items, Members members) {
    std::string list;
    for (const Item& item : items) {
      JsonWriter json;
      MemberWriter inner(json);
      members(item, inner);
      if (!list.empty()) list += ',';
      list += json.finish();
    }
    return "[" + list + "]";
  }
  template <class Owner, class Members>
  void group(const Member& member, const Owner& owner, Members members) {
    JsonWriter json;
    MemberWriter inner(json);
    members(owner, inner);
    json_.object(member.name, json);
  }
  template <class Part, class Members>
  void part(const Member& member, const std::optional<Part>& part, Members members) {
    if (part) group(member, *part, members);
  }
  template <class Item, class Members>
  void list(const Member& member, const std::optional<std::vector<Item>>& items, Members members) {
    if (items) json_.raw(member.name, array(*items, members));
  }
  template <class Item, class Members>
  void list_if_any(const Member& member, const std::vector<Item>& items, Members members) {
    if (!items.empty()) json_.raw(member.name, array(items, members));
  }

 private:
  JsonWriter& json_;
};

}  // namespace splid
