#include "daemon/service/reload.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

namespace splid {
namespace {

constexpr std::array<std::string_view, 7> live_pointers = {"/scene",
                                                           "/estimator",
                                                           "/pulse",
                                                           "/detector",
                                                           "/frame/min_seen_fraction",
                                                           "/security/allow_list",
                                                           "/control/allow_list"};

bool is_live(std::string_view pointer) {
  return std::any_of(live_pointers.begin(), live_pointers.end(),
                     [&](std::string_view live) { return pointer.starts_with(live); });
}

}  // namespace

ConfigChanges changes_between(const Config& before, const Config& after) {
  const auto patch = nlohmann::json::diff(nlohmann::json::parse(config_to_json(before)),
                                          nlohmann::json::parse(config_to_json(after)));
  std::set<std::string> pointers;
  for (const auto& step : patch) pointers.insert(step["path"].get<std::string>());
  // The file may hold other pulses under the same name.
  if (before.pattern != after.pattern) pointers.insert("/pattern");
  ConfigChanges changes;
  for (const std::string& pointer : pointers) {
    (is_live(pointer) ? changes.live : changes.restart).push_back(pointer);
  }
  return changes;
}

}  // namespace splid
