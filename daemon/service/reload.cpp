#include "daemon/service/reload.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "protocol/json_value.hpp"

namespace splid {
namespace {

constexpr std::array<std::string_view, 5> live_pointers = {"/scene", "/estimator", "/pulse",
                                                           "/detector", "/frame/min_seen_fraction"};

bool has_both(const std::string& one, const std::string& other) {
  return !one.empty() && !other.empty();
}

// A socket either asks a list or does not: with a new list, or a list that is taken away, it would
// be a socket of another kind.
bool is_live(std::string_view pointer, const Config& after, const Config& started) {
  if (pointer == "/security/allow_list") {
    return has_both(started.security.allow_list, after.security.allow_list);
  }
  if (pointer == "/control/allow_list") {
    return has_both(started.control.allow_list, after.control.allow_list);
  }
  if (pointer.starts_with("/detector/walk")) return false;  // the framer has it
  return std::any_of(live_pointers.begin(), live_pointers.end(),
                     [&](std::string_view live) { return pointer.starts_with(live); });
}

}  // namespace

ConfigChanges changes_between(const Config& before, const Config& after, const Config& started) {
  const auto patch =
      nlohmann::json::diff(json_value(config_to_json(before)), json_value(config_to_json(after)));
  std::set<std::string> pointers;
  for (const auto& step : patch) pointers.insert(step["path"].get<std::string>());
  // The file may hold other pulses under the same name.
  if (before.pattern != after.pattern) pointers.insert("/pattern");
  ConfigChanges changes;
  for (const std::string& pointer : pointers) {
    (is_live(pointer, after, started) ? changes.live : changes.restart).push_back(pointer);
  }
  return changes;
}

Config with_live(const Config& started, const Config& next) {
  Config live = started;
  live.scene = next.scene;
  live.estimator = next.estimator;
  live.pulse = next.pulse;
  live.detector = next.detector;
  live.detector.walk = started.detector.walk;
  live.frame.min_seen_fraction = next.frame.min_seen_fraction;
  return live;
}

}  // namespace splid
