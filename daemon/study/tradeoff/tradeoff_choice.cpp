#include "daemon/study/tradeoff/tradeoff_choice.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "config/option_writer.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"

namespace splid::tradeoff {
namespace {

// RMSEs within this factor count as equal: settings that find the same peaks have the same RMSE,
// and two percent more RMSE are only two percent more error of range.
constexpr double alike_rmse = 1.02;
// Losses that differ by less than this share of the frames count as equal: of 200 frames, two are
// chance.
constexpr double alike_lost = 0.01;
// Times within this factor count as equal: a median of 200 times repeats only to 15 % on a machine
// that does other work too.
constexpr double alike_time = 1.25;

constexpr double none = std::numeric_limits<double>::infinity();

double lost_share(const Row& row) {
  const auto lost = static_cast<double>(row.no_value + row.wrong_peaks);
  return row.frames > 0 ? lost / static_cast<double>(row.frames) : 1;
}

double distance(const Row& row) { return row.distance_rmse_m.value_or(none); }

// In a scene at rest no row has a velocity's RMSE, and all rows get the same value.
double velocity(const Row& row) { return row.velocity_rmse_mps.value_or(1); }

// The smallest `value` of the rows in `among`.
template <class Value>
double least(std::span<const Row> rows, const std::vector<std::size_t>& among, const Value& value) {
  double smallest = none;
  for (const std::size_t i : among) smallest = std::min(smallest, value(rows[i]));
  return smallest;
}

// Removes from `among` the rows whose `value` is more than `factor` times the smallest.
template <class Value>
void keep_least(std::span<const Row> rows, std::vector<std::size_t>& among, double factor,
                const Value& value) {
  const double limit = least(rows, among, value) * factor;
  std::erase_if(among, [&](std::size_t i) { return value(rows[i]) > limit; });
}

bool can_be_chosen(const Row& row, const EstimatorOptions& configured) {
  return row.setting.estimator.method != Method::paper &&
         row.setting.estimator.findings == configured.findings &&
         frames_of_rmse(row) >= fewest_frames_to_choose && row.distance_rmse_m.value_or(0) > 0 &&
         (row.velocity_rmse_mps || !row.velocity_bound_mps);
}

// The rows that pass the test and lose as few frames as any other of them.
template <class Test>
std::vector<std::size_t> those(std::span<const Row> rows, const EstimatorOptions& configured,
                               const Test& test) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (can_be_chosen(rows[i], configured) && test(rows[i])) found.push_back(i);
  }
  const double most_lost = least(rows, found, lost_share) + alike_lost;
  std::erase_if(found, [&](std::size_t i) { return lost_share(rows[i]) > most_lost; });
  return found;
}

nlohmann::ordered_json json_of(EstimatorOptions options) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  OptionWriter writer(json);
  options.describe(writer);
  return json;
}

}  // namespace

std::size_t frames_of_rmse(const Row& row) { return row.compared - row.wrong_peaks; }

std::optional<std::size_t> find_knee(std::span<const Row> rows, double length_ms,
                                     const EstimatorOptions& configured, KneeOf of) {
  std::vector<std::size_t> left = those(rows, configured, [&](const Row& row) {
    return row.setting.length_ms == length_ms &&
           (of == KneeOf::all || !row.setting.estimator.tracked);
  });
  const double best_distance = least(rows, left, distance) * alike_rmse;
  const double best_velocity = least(rows, left, velocity) * alike_rmse;
  std::erase_if(left, [&](std::size_t i) {
    return distance(rows[i]) > best_distance || velocity(rows[i]) > best_velocity;
  });
  const auto time = [](const Row& row) { return row.p50_ms; };
  keep_least(rows, left, alike_time, time);
  if (left.empty()) return std::nullopt;
  const auto same = std::find_if(left.begin(), left.end(), [&](std::size_t i) {
    return json_of(rows[i].setting.estimator) == json_of(configured);
  });
  if (same != left.end()) return *same;
  // Else a setting with the configured effort, if there is one.
  keep_least(rows, left, 1, [&](const Row& row) {
    return row.setting.estimator.effort == configured.effort ? 1.0 : 2.0;
  });
  keep_least(rows, left, 1, time);
  return left.front();
}

std::optional<std::size_t> find_within_budget(std::span<const Row> rows, double budget_ms,
                                              const EstimatorOptions& configured) {
  std::vector<std::size_t> left = those(rows, configured, [&](const Row& row) {
    return row.p99_ms <= std::min(budget_ms, row.setting.length_ms);
  });
  keep_least(rows, left, alike_rmse, [](const Row& row) { return distance(row) * velocity(row); });
  keep_least(rows, left, 1, [](const Row& row) { return row.p99_ms; });
  return left.empty() ? std::nullopt : std::optional(left.front());
}

std::string configuration_lines(const Setting& setting) {
  return "\"frame\": {\"length_ms\": " + number_text(setting.length_ms) +
         "},\n\"estimator\": " + json_text(json_of(setting.estimator));
}

}  // namespace splid::tradeoff
