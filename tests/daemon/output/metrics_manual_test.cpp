#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/output/metrics.hpp"
#include "drivers/bridge/bridge.hpp"
#include "drivers/source.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/held_clock.hpp"

namespace splid {
namespace {

struct MetricFamily {
  std::string help, type;
  std::set<std::string> labels;
};

// A family in Prometheus' text format: `# HELP`, `# TYPE`, and lines of series.
std::map<std::string, MetricFamily> metric_families(const std::string& text) {
  std::map<std::string, MetricFamily> families;
  std::istringstream lines(text);
  std::string now;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string hash, kind, name;
    words >> hash >> kind >> name >> std::ws;
    if (hash == "#") {
      now = name;
      std::getline(words, kind == "HELP" ? families[name].help : families[name].type);
      continue;
    }
    const std::size_t open = line.find('{');
    if (open == std::string::npos) continue;
    std::istringstream labels(line.substr(open + 1));
    for (std::string label; std::getline(labels, label, ',');) {
      const std::string label_name = label.substr(0, label.find('='));
      if (label_name != "le") families[now].labels.insert(label_name);
    }
  }
  return families;
}

std::string manual_row(const std::string& name, const MetricFamily& family) {
  std::string labels;
  for (const std::string& label : family.labels) labels += (labels.empty() ? "" : ",") + label;
  if (!labels.empty()) labels = "{" + labels + "}";
  std::string help = family.help;
  if (help.ends_with('.')) help.pop_back();
  return "| `" + name + labels + "` | " + family.type + " | " + help + " |\n";
}

// What all drivers count, though no instrument is there.
std::vector<SourceCounter> counters_of_drivers() {
  BridgeOptions bridge;
  bridge.address = "unix:nobody";
  std::vector<SourceCounter> all = bridge.open({})->counters();
  for (SourceCounter& counter : make_source_options("tdc2")->open({})->counters()) {
    all.push_back(std::move(counter));
  }
  return all;
}

TEST(MetricsManual, HasEveryMetric) {
  const Config config = scene_config(0.5);
  const HeldClock clock;
  const Metrics metrics(config.metrics, status_options(config), counters_of_drivers(), clock, {});
  std::string table = "\n| metric | type | what it is |\n|---|---|---|\n";
  for (const auto& [name, family] : metric_families(metrics.text()))
    table += manual_row(name, family);
  test::expect_generated_part(
      "docs/reference/metrics.md",
      "<!-- Generated: all metrics; see tests/daemon/output/metrics_manual_test.cpp -->\n",
      "<!-- Generated up to here -->\n", table + "\n", "daemon.MetricsManual");
}

}  // namespace
}  // namespace splid
