#include "bench/studies/trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <string_view>

#include "bench/studies/crt_wang.hpp"
#include "bench/thread_clock.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "estimator/paper/paper_method.hpp"
#include "estimator/search/range_odds.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::studies {
namespace {

// The FNV-1a hash, which is the same on every machine, as std::hash is not.
std::uint64_t hash(std::string_view text) {
  std::uint64_t value = 14695981039346656037U;
  for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return value;
}

// The values of a frame, in the order of Value, and what a study counts beside them.
TrialOutcome outcome_of(const Estimate& found) {
  TrialOutcome outcome;
  outcome.has_values = found.has_values;
  outcome.ambiguous = found.range_odds_nats < odds_at_risk_nats(EstimatorOptions().range_risk);
  outcome.error = {found.delay_ns, found.velocity_mps, found.signal_per_pulse,
                   found.background_per_ns, found.delay_start_ns};
  outcome.deviation = {found.std_delay_ns, found.std_velocity_mps, found.std_signal_per_pulse,
                       found.std_background_per_ns, 0};
  return outcome;
}

// [P]'s method claims a target in every frame, also where the refinement has gained nothing.
bool has_values(const paper::PaperResult& found) { return found.stop != Stop::not_run; }

TrialOutcome outcome_of(const paper::PaperResult& found) {
  TrialOutcome outcome;
  outcome.has_values = has_values(found);
  outcome.error = {found.delay_ns, found.velocity_mps, found.signal_per_pulse,
                   found.background_per_ns, found.delay_start_ns};
  return outcome;
}

TrialOutcome outcome_of(const paper::PaperParameters& start, double length_ns) {
  TrialOutcome outcome;
  outcome.has_values = true;
  const double moved_ns = start.velocity_mps / speed_of_light_mps * length_ns;
  outcome.error = {start.delay_ns + moved_ns, start.velocity_mps, start.signal_per_pulse,
                   start.background_per_ns, start.delay_ns};
  return outcome;
}

// [P] rounds the periods to whole nanoseconds for the theorem of Wang et al.
paper::CrtSolution wang_by_ns(std::span<const paper::Remainder> remainders, double /*limit_ns*/) {
  return crt_wang(remainders, 1);
}

// Ends a frame before its last pattern period does.
void cut(test::FrameMaker::Frame& frame, double length_ns) {
  const std::int64_t end_ps = frame.start_ps + std::llround(length_ns / ns_per_ps);
  frame.end_ps = std::min(frame.end_ps, end_ps);
  std::vector<std::int64_t>& photons = frame.photons_ps;
  photons.erase(std::lower_bound(photons.begin(), photons.end(), frame.end_ps), photons.end());
}

// The estimator of a job, and the scene that the estimator is tried on.
class Bench {
 public:
  Bench(const Job& job, const Expectation& expectation)
      : cell_(job.cell),
        estimator_(job.estimator),
        length_ns_(expectation.length_ns),
        scene_hash_(hash(scene_key(job.cell))),
        made_(maker(job.cell, length_ns_)),
        unambiguous_ns_(made_.pattern.unambiguous_delay_ps * ns_per_ps),
        shape_(make_gaussian(pulse_sigma_ns)),
        paper_(made_.pattern, *shape_, scene(), theorem(job.estimator)) {
    if (estimator_ != Estimator::search) return;
    EstimatorOptions options;
    options.effort = job.cell.effort;
    search_.emplace(made_.pattern, PulseOptions{.sigma_ps = pulse_sigma_ns * 1e3}, scene(), options,
                    job.cell.length_ms, most_photons(expectation));
  }

  TrialOutcome run(int trial) {
    std::seed_seq seeds{static_cast<std::uint32_t>(scene_hash_),
                        static_cast<std::uint32_t>(scene_hash_ >> 32U),
                        static_cast<std::uint32_t>(trial)};
    std::mt19937_64 random(seeds);
    const double drawn_ns = std::uniform_real_distribution<>(0, unambiguous_ns_)(random);
    const double drawn_mps =
        std::uniform_real_distribution<>(-max_speed_mps, max_speed_mps)(random);
    made_.velocity_mps = cell_.velocity_mps.value_or(drawn_mps);
    const double start_ns = delay_start_ns(cell_.study).value_or(drawn_ns);
    const auto delay_in_ns = [&](double length_ns) {  // at mid-frame
      return start_ns + made_.velocity_mps / speed_of_light_mps * length_ns;
    };
    made_.distance_m = delay_in_ns(1e6 * made_.length_ms) * 1e-9 * speed_of_light_mps / 2;
    auto frame = made_.make(random());
    cut(frame, length_ns_);
    const double begin_ms = bench::thread_ms();
    TrialOutcome outcome = estimate(frame.view());
    outcome.compute_ms = bench::thread_ms() - begin_ms;
    const AllValues truth = {delay_in_ns(length_ns_), made_.velocity_mps, made_.signal_per_pulse,
                             made_.background_per_ns, start_ns};
    for (std::size_t i = 0; i < values; ++i) outcome.error[i] -= truth[i];
    for (const Value i : {delay, delay_start}) {
      outcome.error[i] = std::remainder(outcome.error[i], unambiguous_ns_);
    }
    return outcome;
  }

 private:
  static SceneOptions scene() { return {.max_speed_mps = max_speed_mps}; }

  // Makes whole pattern periods, in which the frame is.
  static test::FrameMaker maker(const Cell& cell, double length_ns) {
    test::FrameMaker made;
    made.pattern = pattern_of(cell);
    const double period_ns = pattern_period_ps(made.pattern) * ns_per_ps;
    made.length_ms = std::ceil(length_ns / period_ns - 1e-6) * period_ns * 1e-6;
    made.signal_per_pulse = cell.signal_per_pulse;
    made.background_per_ns = cell.background_per_ns;
    made.sigma_ns = pulse_sigma_ns;
    return made;
  }

  static paper::RemainderTheorem theorem(Estimator estimator) {
    const bool wang = estimator == Estimator::wang || estimator == Estimator::wang_start;
    return wang ? wang_by_ns : paper::crt_mixed_integer;
  }

  // Room for ten deviations above the mean number of photons, which no frame of a study reaches.
  static std::size_t most_photons(const Expectation& expectation) {
    const double mean = expectation.signal_photons + expectation.background_photons;
    return static_cast<std::size_t>(mean + 10 * std::sqrt(mean) + 20);
  }

  TrialOutcome estimate(const FrameView& frame) {
    if (search_) return outcome_of(search_->estimate(frame));
    const paper::PaperResult found = paper_.estimate(frame);
    const bool start = estimator_ == Estimator::paper_start || estimator_ == Estimator::wang_start;
    return start && has_values(found) ? outcome_of(found.start, length_ns_) : outcome_of(found);
  }

  Cell cell_;
  Estimator estimator_;
  double length_ns_;
  std::uint64_t scene_hash_;
  test::FrameMaker made_;
  double unambiguous_ns_;
  std::unique_ptr<PulseShape> shape_;
  paper::PaperMethod paper_;
  std::optional<FrameEstimator> search_;
};

}  // namespace

double wrong_peak_limit_ns(const Expectation& expectation) {
  return std::max(5 * pulse_sigma_ns, 8 * expectation.bound.delay_ns);
}

std::optional<Score> run_job(const Job& job, const Expectation& expectation,
                             const std::stop_token& stop, double longest_s) {
  Bench bench(job, expectation);
  std::vector<TrialOutcome> outcomes;
  const double begin_ms = bench::thread_ms();
  for (int trial = 0; trial < job.trials; ++trial) {
    if (stop.stop_requested()) return std::nullopt;
    if (trial > 0 && bench::thread_ms() - begin_ms > 1e3 * longest_s) break;
    outcomes.push_back(bench.run(trial));
  }
  Score found = score(outcomes, wrong_peak_limit_ns(expectation));
  found.took_s = (bench::thread_ms() - begin_ms) * 1e-3;
  return found;
}

}  // namespace splid::studies
