// The studies of [P] in short: a small table for each figure of [P].

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "bench/studies/report.hpp"
#include "bench/studies/report_parts.hpp"

namespace splid::studies {
namespace {

constexpr const char* reader_preface = R"(# The studies of [P] in short

The simulations and the experiment of [P] at its own settings, {} frames a cell, estimated by splid's method, `search`,
and by the whole method of [P], `paper`. [Every cell, with pictures laid out as [P]'s](accuracy-figures.md), and
[what goes beyond [P]](accuracy-beyond.md).

Each cell says up to which b (counts/ns) or v (m/s), or in Fig. 9 from which t_a (ms) on, a method holds: τ and v are at
the bound as far as the number of photons lets them, and at most one frame in 1000 more is lost than any method must
lose. Then the largest RMSE over the bound there; in brackets the share of lost frames, or that ratio, of the first
cell in which the method does not hold.

)";

bool holds(const Result& row) {
  const double least = row.expectation.chance_lost;
  const double noise = 2 * std::sqrt(least / row.score.trials);
  return photons_decide(row.expectation) && in_reach(row) && lost(row) <= least + 0.001 + noise;
}

double ratio(const Result& row) {
  return std::max(row.score.rmse[delay] / row.expectation.bound.delay_ns,
                  row.score.rmse[velocity] / row.expectation.bound.velocity_mps);
}

// Why a cell does not hold.
std::string failure(const Result& row) {
  if (!photons_decide(row.expectation)) return "✗";
  const double share = lost(row);
  return share > 0.001 ? percent(share) : fmt::format("{:.2f}", ratio(row));
}

// "≤ 0.00316: 1.06 (5.2 %)"
std::string holding(Rows line, Axis axis) {
  if (line.empty()) return "";
  const bool longer_is_easier = axis == Axis::length;
  if (longer_is_easier) std::reverse(line.begin(), line.end());
  const auto end = std::find_if(line.begin(), line.end(), [](auto* row) { return !holds(*row); });
  const std::string next = end == line.end() ? "" : failure(**end);
  if (end == line.begin()) return next == "✗" ? next : "none (" + next + ")";
  double worst = 0;
  for (auto at = line.begin(); at != end; ++at) worst = std::max(worst, ratio(**at));
  if (end == line.end()) return fmt::format("all: {:.2f}", worst);
  return fmt::format("{} {}: {:.2f} ({})", longer_is_easier ? "≥" : "≤",
                     x_text((*(end - 1))->job.cell), worst, next);
}

std::string head_line(const std::vector<std::string>& names) {
  std::string text = "|", rule = "|";
  for (const std::string& name : names) {
    text += " " + name + " |";
    rule += "---|";
  }
  return text + "\n" + rule + "\n";
}

// The cells of a row that say where both methods hold in a study.
std::string both(const Rows& rows, Mode mode) {
  std::string text;
  for (const Estimator estimator : {Estimator::search, Estimator::paper}) {
    const Axis axis = rows.empty() ? Axis::background : info(rows.front()->job.cell.study).axis;
    text += " " + holding(line_of(rows, mode, estimator), axis) + " |";
  }
  return text;
}

std::string simulations(const Results& results) {
  const std::array figures = {Study::fig2, Study::fig3, Study::fig4};
  std::string text = head_line({"mode", "Fig. 2, b: `search`", "`paper`", "Fig. 3, b: `search`",
                                "`paper`", "Fig. 4, v: `search`", "`paper`"});
  for (const Mode mode : {Mode::baseline, Mode::mrr, Mode::random, Mode::interleaved}) {
    text += fmt::format("| {} |", splid::to_string(mode));
    for (const Study study : figures) text += both(rows_of(results, study), mode);
    text += "\n";
  }
  return text + "\n";
}

// The RMSE of all frames over the bound.
double over_bound(const Result& row, Value value) {
  const Bound& bound = row.expectation.bound;
  const AllValues bounds = {bound.delay_ns, bound.velocity_mps, bound.signal_per_pulse,
                            bound.background_per_ns, bound.delay_start_ns};
  return row.score.rmse_all[value] / bounds[value];
}

std::string lost_of(const Rows& line) {
  double trials = 0, gone = 0;
  for (const Result* row : line) {
    trials += row->score.trials;
    gone += row->score.wrong;
  }
  return trials > 0 ? percent(gone / trials) : "";
}

std::string remainders(const Results& results) {
  constexpr double background_per_ns = 1e-3;
  std::string text = head_line({"Fig. 5, b = 0.001", "S", "b", "τ", "v", "wrong, modulo 2600 ns",
                                "wrong, up to 34,665.3 ns"});
  const Rows modulo = rows_of(results, Study::fig5), whole = rows_of(results, Study::fig5_whole);
  for (const Estimator estimator : all_estimators()) {
    const Rows line = line_of(modulo, Mode::interleaved, estimator);
    const auto at = std::find_if(line.begin(), line.end(), [](const Result* row) {
      return row->job.cell.background_per_ns == background_per_ns;
    });
    if (at == line.end()) continue;
    text += fmt::format("| `{}` |", to_string(estimator));
    for (const Value value : {signal, background, delay_start, velocity}) {
      const double times = over_bound(**at, value);
      text += times < 1000 ? fmt::format(" {:.3g} |", times) : fmt::format(" {:.0f} |", times);
    }
    text += fmt::format(" {} | {} |\n", lost_of(line),
                        lost_of(line_of(whole, Mode::interleaved, estimator)));
  }
  return text + "\n";
}

constexpr std::array experiment_modes = {Mode::baseline, Mode::ambiguous, Mode::mrr, Mode::random,
                                         Mode::interleaved};

std::string experiment_at_rest(const Results& results) {
  const Rows rows = rows_of(results, Study::fig9);
  std::string text = head_line({"mode", "Fig. 9, t_a: `search`", "`paper`"});
  for (const Mode mode : experiment_modes) {
    text += fmt::format("| {} |", splid::to_string(mode)) + both(rows, mode) + "\n";
  }
  return text + "\n";
}

}  // namespace

std::string reader_page(const Results& results) {
  Rows rows;
  for (const auto& [name, result] : results) rows.push_back(&result);
  return fmt::format(fmt::runtime(reader_preface), frames_text(rows)) + simulations(results) +
         "Fig. 5, RMSE of all frames over the bound, before (`-start`) and after refinement; and "
         "shares on a wrong peak.\n\n" +
         remainders(results) + "The experiment at rest.\n\n" + experiment_at_rest(results) +
         provenance(results);
}

}  // namespace splid::studies
