#include "protocol/frame_members.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "protocol/fold_members.hpp"
#include "protocol/status_members.hpp"
#include "tests/support/generated.hpp"

namespace splid {
namespace {

// Visits what describe() lists, each member once, and those of an empty target again.
class MemberTable {
 public:
  template <class Value>
  void number(const Member& member, const Value& /*value*/) {
    row(member);
  }
  template <class Value>
  void count(const Member& member, const Value& /*value*/) {
    row(member);
  }
  void count_if_any(const Member& member, std::uint64_t /*value*/) { row(member); }
  void whole(const Member& member, std::int64_t /*value*/) { row(member); }
  void flag(const Member& member, bool /*value*/) { row(member); }
  void flag_if_any(const Member& member, bool /*value*/) { row(member); }
  void json(const Member& member, const std::string& /*json*/) { row(member); }
  template <class Value>
  void choice(const Member& member, const Value& /*value*/) {
    row(member);
  }
  template <class Value>
  void text(const Member& member, const Value& /*value*/) {
    row(member);
  }
  void text_if_any(const Member& member, const std::string& /*value*/) { row(member); }
  template <class Owner, class Members>
  void group(const Member& member, const Owner& owner, Members members) {
    prefix = std::string(member.name) + ".";
    members(owner, *this);
    prefix.clear();
  }
  template <class Part, class Members>
  void part(const Member& member, const std::optional<Part>& /*part*/, Members members) {
    row(member);
    group(member, Part{}, members);
  }
  template <class Item, class Members>
  void list(const Member& member, const std::optional<std::vector<Item>>& /*items*/,
            Members /*members*/) {
    row(member);
  }

  template <class Item, class Members>
  void list_if_any(const Member& member, const std::vector<Item>& /*items*/, Members /*members*/) {
    row(member);
  }

  // As Markdown.
  [[nodiscard]] std::string table() const {
    return "\n| member | unit | what it is |\n|---|---|---|\n" + rows + "\n";
  }
  std::string rows;
  int members = 0;

 private:
  void row(const Member& member) {
    ++members;
    rows += "| `" + prefix + member.name + "` | " + unit(member.unit) + " | " + member.doc + " |\n";
  }
  static std::string unit(std::string_view unit) {
    if (unit.starts_with("m/s") && unit.size() == 4) {
      return std::string("m/s") + (unit.back() == '2' ? "²" : "³");
    }
    return std::string(unit);
  }

  std::string prefix;
};

void expect_in_manual(const std::string& what, const MemberTable& table) {
  const std::string mark = "; see tests/protocol/frame_members_test.cpp -->\n";
  test::expect_generated_part("docs/reference/messages.md", "<!-- Generated: " + what + mark,
                              "<!-- Generated up to here -->\n", table.table(),
                              "protocol.FrameMembers");
}

template <class Message>
MemberTable of(const Message& message) {
  MemberTable table;
  describe(message, table);
  return table;
}

TEST(FrameMembers, AreWhatTheManualSays) {
  const MemberTable frame = of(FrameMessage{});
  expect_in_manual("a frame", frame);
  MemberTable finding;
  const FrameMessage::Finding one;
  describe_finding(one, finding);
  expect_in_manual("a finding", finding);
  expect_in_manual("a status", of(StatusMessage{}));
  expect_in_manual("a version", of(VersionMessage{}));
  expect_in_manual("a fold", of(FoldMessage{}));
  EXPECT_LE(frame.members + finding.members + 2, 60) << "schema and v are two more";
}

}  // namespace
}  // namespace splid
