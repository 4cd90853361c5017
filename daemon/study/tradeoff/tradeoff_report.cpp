#include "daemon/study/tradeoff/tradeoff_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "daemon/study/tradeoff/tradeoff_choice.hpp"
#include "protocol/json_writer.hpp"

namespace splid::tradeoff {
namespace {

std::string number_or_nothing(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? number_text(*value) : std::string();
}

std::optional<double> low_end(const std::optional<Interval>& interval) {
  return interval ? std::optional(interval->low) : std::nullopt;
}

std::optional<double> high_end(const std::optional<Interval>& interval) {
  return interval ? std::optional(interval->high) : std::nullopt;
}

struct Marks {
  bool knee = false;
  bool budget = false;
};

Marks marks_of(const Report& report, std::size_t row) {
  const auto knee = knee_of(report, report.rows[row].setting.length_ms);
  const auto budget = report.budget_ms
                          ? find_within_budget(report.rows, *report.budget_ms, report.configured)
                          : std::nullopt;
  return {knee == row, budget == row};
}

std::string column(fmt::format_string<double> pattern, const std::optional<double>& value,
                   double factor, int width) {
  return value ? fmt::format(pattern, *value * factor) : fmt::format("{:>{}}", "-", width);
}

constexpr const char* headings =
    "  frame  setting                  one core, ms         distance RMSE           velocity RMSE  "
    "  "
    "wrong    no\n"
    "     ms                           p50      p99       mm    95 %  /bound     cm/s    95 %  "
    "/bound "
    " peaks  value  frames";

// By how much the true RMSE may be above the measured one; nothing beyond four times.
std::string percent_column(const std::optional<Interval>& interval,
                           const std::optional<double>& rmse) {
  constexpr double most = 4;
  const double factor = interval && rmse ? interval->high / *rmse : most;
  return factor < most ? fmt::format("{:>7}", fmt::format("+{:.0f} %", 100 * (factor - 1)))
                       : fmt::format("{:>7}", "-");
}

std::string describe_target(const simulator::TargetOptions& target) {
  switch (target.motion) {
    case simulator::MotionKind::linear:
      return fmt::format("{:g} m, {:+g} m/s", target.distance_m, target.velocity_mps);
    case simulator::MotionKind::sinusoid:
      return fmt::format("{:g} m \u00b1 {:g} m in {:g} s", target.distance_m, target.amplitude_m,
                         target.period_s);
    case simulator::MotionKind::points:
      break;
  }
  return "a target between points";
}

// The measured length that is nearest to the configured length; 0 where nothing is measured.
double nearest_length_ms(const Report& report) {
  double nearest_ms = 0;
  double apart = std::numeric_limits<double>::infinity();
  for (const Row& row : report.rows) {
    const double length_ms = row.setting.length_ms;
    const double decades = std::abs(std::log10(length_ms / report.configured_length_ms));
    if (decades < apart) nearest_ms = length_ms;
    apart = std::min(apart, decades);
  }
  return nearest_ms;
}

// How many frames to ask for, if the same share of them can be compared as of `frames`.
std::size_t frames_needed(ErrorsAgainst reference, std::size_t frames, std::size_t compared) {
  // The two frames at either end have too few neighbours. One of these four is the first frame,
  // which is not judged anyway.
  const std::size_t edges = reference == ErrorsAgainst::neighbours ? 3 : 0;
  const bool tells = frames > edges && compared > 0;
  const double share =
      tells ? static_cast<double>(compared) / static_cast<double>(frames - edges) : 1;
  return edges +
         static_cast<std::size_t>(std::ceil(static_cast<double>(fewest_frames_to_choose) / share));
}

// Why there are too few frames of a length to choose a setting by; absent where there are enough.
std::optional<std::string> shortage(const Report& report, double length_ms) {
  std::size_t frames = 0;
  std::size_t most = 0;
  for (const Row& row : report.rows) {
    if (row.setting.length_ms != length_ms) continue;
    frames = std::max(frames, row.frames);
    most = std::max(most, frames_of_rmse(row));
  }
  if (most >= fewest_frames_to_choose) return std::nullopt;
  const std::string has =
      fmt::format("at {:g} ms {} of {} frames could be compared and {} are needed; ", length_ms,
                  most, frames, fewest_frames_to_choose);
  const std::size_t needed = frames_needed(report.reference, frames, most);
  if (report.reference == ErrorsAgainst::scene)
    return has + fmt::format("--frames {} has them", needed);
  // Two frames more: the first frame, and the parts of frames that the start and the end cut off.
  const double needed_s = static_cast<double>(needed + 2) * length_ms / 1e3;
  return has + fmt::format("a recording of {:.2g} s with --frames {} has them", needed_s, needed);
}

}  // namespace

ErrorsAgainst errors_against(const FrameOrigin& origin) {
  if (origin.scene) return ErrorsAgainst::scene;
  return origin.truth ? ErrorsAgainst::truth_file : ErrorsAgainst::neighbours;
}

const char* name_of(ErrorsAgainst reference) {
  switch (reference) {
    case ErrorsAgainst::scene:
      return "scene";
    case ErrorsAgainst::truth_file:
      return "truth";
    case ErrorsAgainst::neighbours:
      break;
  }
  return "neighbours";
}

std::string in_words(ErrorsAgainst reference) {
  switch (reference) {
    case ErrorsAgainst::scene:
      return "errors against the simulated target";
    case ErrorsAgainst::truth_file:
      return "errors against the recording's truth file";
    case ErrorsAgainst::neighbours:
      break;
  }
  return "no truth: errors are each frame's difference from the cubic through its four neighbours "
         "(effort balanced), freed of their own noise; a constant error does not show";
}

std::optional<std::size_t> knee_of(const Report& report, double length_ms, KneeOf of) {
  if (report.stopped_in_ms == length_ms) return std::nullopt;
  return find_knee(report.rows, length_ms, report.configured, of);
}

std::optional<std::size_t> chosen_row(const Report& report) {
  if (report.budget_ms) {
    return find_within_budget(report.rows, *report.budget_ms, report.configured);
  }
  const double length_ms = nearest_length_ms(report);
  if (report.configured.tracked) return knee_of(report, length_ms);
  return knee_of(report, length_ms, KneeOf::frames_on_their_own);
}

std::string table_head(ErrorsAgainst reference) { return in_words(reference) + "\n" + headings; }

std::string table_line(const Row& row) {
  return fmt::format("{:>7g}  {:21}", row.setting.length_ms, setting_name(row.setting.estimator)) +
         fmt::format("{:>7.3g}  {:>7.3g}", row.p50_ms, row.p99_ms) + "  " +
         column("{:>7.3g}", row.distance_rmse_m, 1e3, 7) + " " +
         percent_column(row.distance_interval_m, row.distance_rmse_m) +
         column("{:>8.3f}", row.distance_ratio(), 1, 8) + "  " +
         column("{:>7.3g}", row.velocity_rmse_mps, 1e2, 7) + " " +
         percent_column(row.velocity_interval_mps, row.velocity_rmse_mps) +
         column("{:>8.3f}", row.velocity_ratio(), 1, 8) +
         fmt::format("{:7}{:7}{:8}", row.wrong_peaks, row.no_value, row.frames);
}

std::string knee_line(const Report& report, double length_ms) {
  const auto knee = knee_of(report, length_ms);
  const auto alone = knee_of(report, length_ms, KneeOf::frames_on_their_own);
  const auto name = [&](std::size_t row) {
    return setting_name(report.rows[row].setting.estimator);
  };
  std::string said =
      knee ? "knee: " + name(*knee)
           : "no knee: " + shortage(report, length_ms).value_or("no setting has all of its values");
  if (knee && alone && alone != knee) said += "; of frames on their own: " + name(*alone);
  return fmt::format("{:>7g}  ", length_ms) + said;
}

std::string Member::plain() const {
  return json.size() > 1 && json.front() == '"' ? json.substr(1, json.size() - 2) : json;
}

std::vector<Member> row_members(const Report& report, std::size_t index) {
  const Row& row = report.rows[index];
  const Marks marks = marks_of(report, index);
  const EstimatorOptions& estimator = row.setting.estimator;
  return {{"method", estimator.method == Method::paper ? "\"paper\"" : "\"search\""},
          {"tracked", estimator.tracked ? "true" : "false"},
          {"effort", json_string(to_string(estimator.effort))},
          {"findings", estimator.findings == FindingsWanted::on ? "\"on\"" : "\"off\""},
          {"length_ms", number_text(row.setting.length_ms)},
          {"frames", std::to_string(row.frames)},
          {"photons", number_text(row.photons)},
          {"compute_ms_p50", number_text(row.p50_ms)},
          {"compute_ms_p99", number_text(row.p99_ms)},
          {"reference", json_string(name_of(report.reference))},
          {"compared", std::to_string(row.compared)},
          {"distance_rmse_m", number_or_nothing(row.distance_rmse_m)},
          {"distance_rmse_low_m", number_or_nothing(low_end(row.distance_interval_m))},
          {"distance_rmse_high_m", number_or_nothing(high_end(row.distance_interval_m))},
          {"distance_bound_m", number_or_nothing(row.distance_bound_m)},
          {"distance_rmse_over_bound", number_or_nothing(row.distance_ratio())},
          {"velocity_rmse_mps", number_or_nothing(row.velocity_rmse_mps)},
          {"velocity_rmse_low_mps", number_or_nothing(low_end(row.velocity_interval_mps))},
          {"velocity_rmse_high_mps", number_or_nothing(high_end(row.velocity_interval_mps))},
          {"velocity_bound_mps", number_or_nothing(row.velocity_bound_mps)},
          {"velocity_rmse_over_bound", number_or_nothing(row.velocity_ratio())},
          {"wrong_peaks", std::to_string(row.wrong_peaks)},
          {"no_value", std::to_string(row.no_value)},
          {"knee", marks.knee ? "true" : "false"},
          {"within_budget", report.budget_ms ? (marks.budget ? "true" : "false") : ""}};
}

std::string row_json(const Report& report, std::size_t row) {
  JsonWriter line;
  line.text("schema", "splid.tradeoff").raw("v", "[1,1]");
  for (const Member& member : row_members(report, row)) {
    if (!member.json.empty()) line.raw(member.name, member.json);
  }
  return line.finish();
}

std::string no_choice_reason(const Report& report) {
  const double length_ms = nearest_length_ms(report);
  if (report.stopped_in_ms == length_ms && !report.budget_ms) {
    return fmt::format("not all settings of {:g} ms are measured", length_ms);
  }
  if (const auto lacking = shortage(report, length_ms)) return *lacking;
  if (!report.budget_ms) return "the errors are no larger than the noise of their reference";
  return fmt::format("no setting is done within {:g} ms in 99 of 100 frames", *report.budget_ms);
}

namespace {

// Why the knee at the length of the recommended row is not that row; empty where it is.
std::string passed_over(const Report& report, std::size_t chosen) {
  const auto knee = knee_of(report, report.rows[chosen].setting.length_ms);
  if (report.budget_ms || !knee || knee == chosen) return "";
  const Row& row = report.rows[*knee];
  return fmt::format(
      "the knee there, {}, takes {:.3g} ms. It is not recommended, since the last digits of a "
      "tracked frame depend on the frames before it; where that does not matter, set "
      "estimator.tracked\n",
      setting_name(row.setting.estimator), row.p50_ms);
}

}  // namespace

std::string advice(const Report& report) {
  const auto chosen = chosen_row(report);
  if (!chosen) return "no setting is recommended: " + no_choice_reason(report) + "\n";
  const Row& row = report.rows[*chosen];
  const std::string name = setting_name(row.setting.estimator);
  const std::string head =
      report.budget_ms
          ? fmt::format("within {:g} ms a frame: {}, frames of {:g} ms, p99 {:.3g} ms\n",
                        *report.budget_ms, name, row.setting.length_ms, row.p99_ms)
          : fmt::format("recommended at {:g} ms: {}, {:.3g} ms a frame\n", row.setting.length_ms,
                        name, row.p50_ms);
  return head + passed_over(report, *chosen) + configuration_lines(row.setting) + "\n";
}

std::string title_of(const Config& config, const FrameOrigin& origin) {
  const std::string pattern =
      fmt::format("{}, {} pulses in {:g} ns", to_string(config.pattern.mode),
                  pulses_per_period(config.pattern), pattern_period_ps(config.pattern) / 1000);
  if (!origin.scene) return origin.recording + ": " + pattern;
  return pattern +
         fmt::format("; S {:g}, b {:g} /s; ", origin.truth->signal_per_pulse,
                     origin.truth->background_per_s) +
         describe_target(origin.scene->target);
}

}  // namespace splid::tradeoff
