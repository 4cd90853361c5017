#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "protocol/frame_columns.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/json_value.hpp"
#include "protocol/truth.hpp"
#include "tests/support/manual_members.hpp"

// libFuzzer changes what the corpora hold, and hardly ever makes up the name of a member. So each
// member of a message has to stand in a seed, and one that is new is missed here.

namespace splid {
namespace {

std::string text_of(const std::string& file) {
  std::ifstream in(SPLID_SOURCE_DIR "/" + file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string seed(const std::string& name) { return text_of("tests/fuzz/corpus/" + name); }

const std::string& messages_page() {
  static const std::string page = text_of("docs/reference/messages.md");
  return page;
}

// Adds the paths of all members, with `between` from an object's name to those of its members.
void add_paths(const nlohmann::json& object, const std::string& before, char between,
               std::set<std::string>& paths) {
  for (const auto& [name, value] : object.items()) {
    paths.insert(before + name);
    if (value.is_object()) add_paths(value, before + name + between, between, paths);
  }
}

std::set<std::string> paths_of(const std::string& json, char between = '.') {
  std::set<std::string> paths;
  add_paths(json_value(json), "", between, paths);
  return paths;
}

// `heading`: of the manual's section about the message.
void expect_members_of_manual(const std::string& json, const std::string& heading) {
  const std::set<std::string> paths = paths_of(json);
  const auto members = test::manual_members(messages_page(), heading);
  EXPECT_FALSE(members.empty()) << heading;
  for (const std::string& member : members) {
    EXPECT_TRUE(paths.contains(member)) << member << " of " << heading << " is in no seed";
  }
}

TEST(FuzzSeeds, AFrameHasEveryMember) {
  const std::string full = seed("frame_message/full.json");
  expect_members_of_manual(full, "## frame");
  const std::set<std::string> paths = paths_of(full, '_');
  std::istringstream columns(frame_csv_head());
  for (std::string name; std::getline(columns >> std::ws, name, ',');) {
    if (name.ends_with('\n')) name.pop_back();
    EXPECT_TRUE(paths.contains(name)) << name << " is not in frame_message/full.json";
  }
  EXPECT_EQ(paths_of(to_json(frame_from_json(full))), paths_of(full)) << "a member is not read";
}

TEST(FuzzSeeds, ATargetHasEveryMember) {
  const auto full = json_value(seed("frame_message/full.json"));
  const nlohmann::json& target = full["targets"][0];
  const std::set<std::string> no_members = {"scene.targets", "targets", "ok", "ambiguous"};
  for (const std::string& name :
       test::manual_names(test::manual_section(messages_page(), "### Several targets"))) {
    EXPECT_TRUE(no_members.contains(name) || target.contains(name)) << name;
  }
  EXPECT_EQ(json_value(to_json(frame_from_json(seed("frame_message/full.json"))))["targets"],
            full["targets"]);
}

TEST(FuzzSeeds, TheLivePageIsSentEveryMember) {
  const auto message = [](const std::string& name) {
    const std::string text = seed("view/" + name);
    return text.substr(text.find('\n') + 1);
  };
  EXPECT_EQ(message("frame"), seed("frame_message/full.json"));
  for (const std::string topic : {"status", "version", "fold"}) {
    expect_members_of_manual(message(topic), "## " + topic);
  }
}

TEST(FuzzSeeds, ATruthHasEveryMember) {
  const std::string text = seed("truth/two-targets.json");
  SceneTruth truth;
  truth.distance_m = truth.velocity_mps = {1};
  truth.more_targets.emplace_back();
  EXPECT_EQ(paths_of(text), paths_of(to_json(truth)));
  const SceneTruth read = truth_from_json(text);
  EXPECT_EQ(read.more_targets.size(), 2U);
  EXPECT_NE(read.drift_ramp_ppm_per_s, 0);
}

}  // namespace
}  // namespace splid
