#include "bench/studies/report_parts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <set>

namespace splid::studies {
namespace {

std::string joined(const std::set<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

}  // namespace

Rows rows_of(const Results& results, Study study) {
  Rows rows;
  for (const Job& job : full_jobs(0)) {
    const auto found = results.find(key(job));
    if (job.cell.study == study && found != results.end()) rows.push_back(&found->second);
  }
  return rows;
}

Rows line_of(const Rows& rows, Mode mode, Estimator estimator) {
  Rows line;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(line), [&](const Result* row) {
    return row->job.cell.mode == mode && row->job.estimator == estimator;
  });
  return line;
}

std::string x_text(const Cell& cell) {
  switch (info(cell.study).axis) {
    case Axis::background:
      return fmt::format("{:g}", cell.background_per_ns);
    case Axis::length:
      return fmt::format("{:g}", cell.length_ms);
    case Axis::velocity:
      return fmt::format("{:g}", cell.velocity_mps.value_or(0));
    case Axis::signal:
      break;
  }
  return fmt::format("{:g}", cell.signal_per_pulse);
}

const char* x_name(Axis axis) {
  switch (axis) {
    case Axis::background:
      return "b, counts/ns";
    case Axis::length:
      return "t_a, ms";
    case Axis::velocity:
      return "v, m/s";
    case Axis::signal:
      break;
  }
  return "S, counts/pulse";
}

std::string percent(double share) {
  return share < 0.1 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

std::string frames_text(const Rows& rows) {
  const auto fewer = [](const Result* a, const Result* b) {
    return a->score.trials < b->score.trials;
  };
  const auto [least, most] = std::minmax_element(rows.begin(), rows.end(), fewer);
  if (least == rows.end()) return "no";
  const std::string low = std::to_string((*least)->score.trials);
  const std::string high = std::to_string((*most)->score.trials);
  return low == high ? low : low + " to " + high;
}

bool in_reach(const Result& row) {
  const Score& s = row.score;
  if (s.right() < 2) return false;
  const Bound& bound = row.expectation.bound;
  const bool has_allowance = row.job.cell.study == Study::fig4;
  const CountFloor floor = has_allowance ? CountFloor{} : count_floor(bound);
  const double allowed = info(row.job.cell.study).ratio_to_reach * (1 + 2 * s.relative_error());
  return s.rmse[delay] / bound.delay_ns <= allowed * floor.delay &&
         s.rmse[velocity] / bound.velocity_mps <= allowed * floor.velocity;
}

double lost(const Result& row) {
  return static_cast<double>(row.score.wrong + row.score.no_value) / row.score.trials;
}

// A line for each machine, as times do not compare between machines.
std::string provenance(const Results& results) {
  struct MachineRun {
    std::set<std::string> dates, estimators;
  };
  std::map<std::string, MachineRun> runs;
  for (const auto& [name, result] : results) {
    runs[result.machine].dates.insert(result.date);
    runs[result.machine].estimators.insert(std::string("`") + to_string(result.job.estimator) +
                                           "`");
  }
  std::string text = "Run";
  for (const auto& [machine, run] : runs) {
    text += (text == "Run" ? " " : ",\n") + joined(run.dates) + " on " + machine;
    if (runs.size() > 1) text += " (" + joined(run.estimators) + ")";
  }
  return text +
         ". Again:\n\n"
         "    scripts/studies --trials 10000 --longest 60\n";
}

}  // namespace splid::studies
