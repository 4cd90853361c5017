#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bench/studies/report.hpp"
#include "bench/studies/report_parts.hpp"

namespace splid::studies {
namespace {

constexpr const char* figures_preface = R"(# [P]'s figures, cell by cell

[The studies in short](accuracy.md).

Each frame is simulated from first principles: a pulse leaves, meets the moving target and comes back; gaps between
detections are exponential, and the background is uniform. The frame is estimated, and the estimate is compared with the
truth. Every frame is searched whole: all delays, ±150 m/s. All estimators see the same frames: `search` is splid's own;
`paper` is the whole method of [P], with its mixed-integer program as remainder theorem; `wang` has the theorem of Wang
et al. 2015 on periods rounded to whole nanoseconds instead, and a `-start` is what these two refine.

The settings are [P]'s own. Its simulations have pulses of σ = 0.1 ns, a target that is 1077 ns away at the frame's
start and recedes by 30 m/s, and patterns of 2600 ns: one pulse (baseline), 100 ns and then 104 ns (mrr), 50 pulses, one
at random in each of as many slots (random), and the union of 100 and 104 ns (interleaved). Its experiment has patterns
of 3780 ns: one pulse, 40 even ones (ambiguous), 180 and 189 ns in turn or together, and 40 at random, at least 9 ns
apart. Frames of mrr have as many pulses of each period: 2450 in Fig. 2, whose t_a is 0.4998 ms then, 5000 in Fig. 3.
Other simulations have [P]'s own t_a. Other frames are whole numbers of pattern periods, as the daemon cuts them, which
come nearest to [P]'s t_a: 1.0017 ms for 1 ms in Fig. 9. Frames are in the steady state: the light of pulses before the
frame is in it. [P] leaves the frame's edges out of its bounds; the bounds here are splid's.

)";

constexpr const char* legend =
    R"(- The two numbers of a cell are the RMSE of the delay τ and of the velocity over their bounds, of the frames on the
  right peak. τ is at the frame's start, as in [P]; in studies that [P] does not have it is at mid-frame, as splid
  publishes it. Their standard deviation is 1/√(2N): 0.007 with 10,000 frames.
- In brackets: the share of frames on a wrong peak, which is off by more than 5 σ and 8 bounds, and, after `none`, of
  frames in which `search` claims no target; each from 0.05 % on. [P]'s method claims a target in every frame.
- ✗: the **photons do not decide**. In more than 3 % of frames the truth gains less log-likelihood than chance alone
  does in one empty frame of 1000 (Lugannani and Rice 1980), or two rates agree better a turn off: no method can tell.
- The pictures have the RMSE of all frames with a value, wrong peaks included, as [P]'s have, and the bounds, dashed.
  A marker is left out where more than half of the cell's frames have no value: the few that have one are chosen.
- ms: median times of the cells, from the shortest to the longest, by the thread's own clock, each on its machine.
- All four values of each cell, of right frames and of all, are in the CSV of the results.

)";

constexpr const char* beyond_preface = R"(# Accuracy beyond [P]

[The studies in short](accuracy.md).

In the three studies below each trial draws its own delay, uniform over the unambiguous range, and where the table fixes
no velocity, its own within ±150 m/s. [The figures](accuracy-figures.md) say how a frame is made, and what a cell says.

)";

double delay_over_bound(const Result& row) {
  const Bound& bound = row.expectation.bound;
  return info(row.job.cell.study).as_paper ? row.score.rmse[delay_start] / bound.delay_start_ns
                                           : row.score.rmse[delay] / bound.delay_ns;
}

std::string cell_text(const Result& row) {
  constexpr double least_share = 5e-4;  // that is told
  const Score& s = row.score;
  std::string text = photons_decide(row.expectation) ? "" : "✗ ";
  // The frames of half a cell that nearly all fails are chosen, and not like the rest.
  if (2 * s.right() < s.trials) {
    text += "–";
  } else {
    text += fmt::format("{:.2f} {:.2f}", delay_over_bound(row),
                        s.rmse[velocity] / row.expectation.bound.velocity_mps);
  }
  const double wrong = static_cast<double>(s.wrong) / s.trials;
  const double none = static_cast<double>(s.no_value) / s.trials;
  std::string lost = wrong >= least_share ? percent(wrong) : "";
  if (none >= least_share) lost += (lost.empty() ? "none " : ", none ") + percent(none);
  return lost.empty() ? text : text + " (" + lost + ")";
}

// "0.084 to 0.3"
std::string times_text(const Rows& rows) {
  const auto faster = [](const Result* a, const Result* b) {
    return a->score.p50_ms < b->score.p50_ms;
  };
  const auto [least, most] = std::minmax_element(rows.begin(), rows.end(), faster);
  const std::string low = fmt::format("{:.2g}", (*least)->score.p50_ms);
  const std::string high = fmt::format("{:.2g}", (*most)->score.p50_ms);
  return low == high ? low : low + " to " + high;
}

std::string line_text(const Rows& line, const std::vector<std::string>& places) {
  const Job& job = line.front()->job;
  std::string text = fmt::format("| {} | {} | {} |", splid::to_string(job.cell.mode),
                                 to_string(job.estimator), frames_text(line));
  for (const std::string& place : places) {
    const auto at = std::find_if(line.begin(), line.end(),
                                 [&](const Result* row) { return x_text(row->job.cell) == place; });
    text += at == line.end() ? " |" : " " + cell_text(**at) + " |";
  }
  return text + " " + times_text(line) + " |\n";
}

std::string study_section(const Rows& rows, const StudyInfo& study, const std::string& figures) {
  std::string text =
      fmt::format("## {}\n\n![{}]({}/{}.svg)\n\n", study.title, study.title, figures, study.name);
  std::vector<std::string> places;
  for (const Result* row : rows) {
    const std::string place = x_text(row->job.cell);
    if (std::find(places.begin(), places.end(), place) == places.end()) places.push_back(place);
  }
  text += fmt::format("| mode | {} → | frames |", x_name(study.axis));
  std::string rule = "|---|---|---|";
  for (const std::string& place : places) {
    text += " " + place + " |";
    rule += "---|";
  }
  text += " ms |\n" + rule + "---|\n";
  for (const Mode mode :
       {Mode::baseline, Mode::ambiguous, Mode::mrr, Mode::random, Mode::interleaved}) {
    for (const Estimator estimator : all_estimators()) {
      const Rows line = line_of(rows, mode, estimator);
      if (!line.empty()) text += line_text(line, places);
    }
  }
  return text + "\n";
}

// A study and estimator in one line.
struct Summary {
  int cells = 0, wrong_ok = 0, ok = 0, ambiguous = 0;  // over all cells
  int decided = 0, in_reach = 0, frames = 0, wrong = 0, none = 0;
  double worst_delay = 0, worst_velocity = 0;
  int with_deviation = 0;
  std::array<double, 2> inside_one{}, inside_two{};  // frames, of delay and velocity

  void add(const Result& row) {
    const Score& s = row.score;
    ++cells;
    wrong_ok += s.wrong_ok;
    ok += s.ok();
    ambiguous += s.ambiguous;
    if (!photons_decide(row.expectation)) return;
    ++decided;
    frames += s.trials;
    wrong += s.wrong;
    none += s.no_value;
    with_deviation += s.with_deviation;
    for (const Value value : {delay, velocity}) {
      inside_one[value] += s.inside_one[value] * s.with_deviation;
      inside_two[value] += s.inside_two[value] * s.with_deviation;
    }
    if (s.right() < 2) return;
    const Bound& bound = row.expectation.bound;
    const double on_delay = s.rmse[delay] / bound.delay_ns;
    const double on_velocity = s.rmse[velocity] / bound.velocity_mps;
    worst_delay = std::max(worst_delay, on_delay);
    worst_velocity = std::max(worst_velocity, on_velocity);
    in_reach += studies::in_reach(row) ? 1 : 0;
  }

  [[nodiscard]] std::string inside_text(Value value) const {
    if (with_deviation == 0) return "–";
    return fmt::format("{:.1f}, {:.1f}", 100 * inside_one[value] / with_deviation,
                       100 * inside_two[value] / with_deviation);
  }
};

std::string summary(const Results& results) {
  std::string text = R"(## All studies in short

- within reach: cells whose RMSE over the bound, of delay (at mid-frame) and of velocity, is at most 1.05 times what the
  number of photons leaves, give or take two standard deviations; in Fig. 4, with 19 photons, at most 1.15 in all. With
  few photons their number and their places differ much from frame to frame, and not even somebody who knows which of
  them are signal reaches the bound of the mean frame
- wrong of `ok`: over all cells, those too whose photons do not decide: frames that are not `ambiguous` by their range
  odds, at the default risk of 1e-3, and whose delay is off by more than a wrong peak's limit and five of their own
  deviations
- inside: share of the errors within one and within two published deviations, %; 68 and 95 for a normal error

| study | estimator | cells | photons decide in | of these within reach | largest τ | largest v | wrong peaks | none | wrong of `ok` | ambiguous | inside τ | inside v |
|---|---|---|---|---|---|---|---|---|---|---|---|---|
)";
  for (const StudyInfo& study : all_studies()) {
    for (const Estimator estimator : all_estimators()) {
      Summary sum;
      for (const Result* row : rows_of(results, study.study)) {
        if (row->job.estimator == estimator) sum.add(*row);
      }
      if (sum.cells == 0) continue;
      const auto worst = [&](double ratio) {
        return sum.decided > 0 ? fmt::format("{:.3g}", ratio) : std::string("–");
      };
      text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} of {} | {} |", study.name,
                          to_string(estimator), sum.cells, sum.decided, sum.in_reach,
                          worst(sum.worst_delay), worst(sum.worst_velocity), sum.wrong, sum.frames,
                          sum.none);
      text += estimator == Estimator::search
                  ? fmt::format(" {} of {} | {} | {} | {} |\n", sum.wrong_ok, sum.ok, sum.ambiguous,
                                sum.inside_text(delay), sum.inside_text(velocity))
                  : " – | – | – | – |\n";
    }
  }
  return text + "\n";
}

// The sections of the studies that [P] has, or of the others.
std::string sections(const Results& results, bool as_paper, const std::string& figures) {
  std::string text;
  for (const StudyInfo& study : all_studies()) {
    const Rows rows = rows_of(results, study.study);
    if (study.as_paper == as_paper && !rows.empty()) text += study_section(rows, study, figures);
  }
  return text;
}

}  // namespace

std::string figures_page(const Results& results, const std::string& figures) {
  return figures_preface + std::string(legend) + sections(results, true, figures) +
         provenance(results);
}

std::string beyond_page(const Results& results, const std::string& figures) {
  return beyond_preface + sections(results, false, figures) + summary(results) +
         provenance(results);
}

}  // namespace splid::studies
