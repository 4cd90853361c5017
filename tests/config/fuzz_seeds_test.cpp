#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"
#include "tests/fuzz/fuzz_pattern.hpp"

// libFuzzer changes what the corpora hold, and hardly ever makes up a key. So each key, and each
// word that a key may have for its value, has to stand in a seed that is read to its end.

namespace splid {
namespace {

using nlohmann::json;

std::string file_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Why a configuration is refused; empty where it is read.
std::string refusal_of(const std::string& text) {
  const ReadText read = [](const std::string&, const std::string&) {
    return test::fuzz_pattern_json();
  };
  try {
    (void)config_from_json(text, "/f/c.json", read);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

// The paths of all keys, and behind a path and '=' the words it has for values.
struct Seen {
  std::set<std::string> all;

  void add(const json& object, const std::string& path) {
    for (const auto& [key, value] : object.items()) {
      const std::string place = path + "/" + key;
      all.insert(place);
      if (value.is_string()) all.insert(place + "=" + value.get<std::string>());
      if (value.is_object()) add(value, place);
      if (!value.is_array()) continue;
      for (const json& each : value) {
        if (each.is_object()) add(each, place + "/N");
      }
    }
  }
  // The keys of a source are those of its driver.
  void add_config(json config) {
    json source = config["source"];
    config.erase("source");
    add(config, "");
    add(source, "/source/" + source["driver"].get<std::string>());
  }
};

void add_unseen(const json& schema, const std::string& path, const Seen& seen,
                std::vector<std::string>& unseen) {
  const auto look_for = [&](const std::string& place) {
    if (!seen.all.contains(place)) unseen.push_back(place);
  };
  for (const auto& [key, member] : schema["properties"].items()) {
    const std::string place = path + "/" + key;
    if (member.contains("oneOf")) {
      for (const json& kind : member["oneOf"]) {
        const std::string driver = kind["properties"]["driver"]["const"];
        add_unseen(kind, place + "/" + driver, seen, unseen);
      }
      continue;
    }
    look_for(place);
    if (member.contains("enum") && member["enum"].front().is_string()) {
      for (const json& word : member["enum"]) look_for(place + "=" + word.get<std::string>());
    }
    if (member.contains("properties")) add_unseen(member, place, seen, unseen);
    if (member.contains("items") && member["items"].contains("properties")) {
      add_unseen(member["items"], place + "/N", seen, unseen);
    }
  }
}

TEST(FuzzSeeds, AConfigurationHasEveryKeyAndEveryWord) {
  Seen seen;
  for (const auto& entry :
       std::filesystem::directory_iterator(SPLID_SOURCE_DIR "/tests/fuzz/corpus/config")) {
    const std::string text = file_text(entry.path());
    if (refusal_of(text).empty()) seen.add_config(json_value(text));
  }
  std::vector<std::string> unseen;
  add_unseen(json_value(config_schema()), "", seen, unseen);
  EXPECT_THAT(unseen, testing::IsEmpty()) << "add them to a seed of tests/fuzz/corpus/config";
}

TEST(FuzzSeeds, TheLongestConfigurationsAreRead) {
  for (const char* name : {"every-section.json", "several-targets.json", "fitted-width.json",
                           "auto.json", "paper.json"}) {
    EXPECT_EQ(
        refusal_of(file_text(SPLID_SOURCE_DIR "/tests/fuzz/corpus/config/" + std::string(name))),
        "");
  }
}

}  // namespace
}  // namespace splid
