#include "bench/studies/trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string_view>

#include "bench/studies/wang.hpp"
#include "bench/thread_clock.hpp"
#include "estimator/fit/range_odds.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::studies {
namespace {

// The FNV-1a hash, which is the same on every machine, as std::hash is not.
std::uint64_t hash(std::string_view text) {
  std::uint64_t value = 14695981039346656037U;
  for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return value;
}

// The estimator of a job, and the scene that the estimator is tried on.
class Bench {
 public:
  Bench(const Job& job, const Expectation& expectation)
      : cell_(job.cell),
        by_wang_(job.estimator == Estimator::wang),
        scene_hash_(hash(scene_key(job.cell))),
        made_(maker(job.cell)),
        unambiguous_ns_(made_.pattern.unambiguous_delay_ps * ns_per_ps),
        shape_(make_gaussian(pulse_sigma_ns)),
        estimator_(made_.pattern, {.sigma_ps = pulse_sigma_ns * 1e3},
                   {.max_speed_mps = max_speed_mps}, options(job), job.cell.length_ms,
                   most_photons(expectation)) {}

  TrialOutcome run(int trial) {
    std::seed_seq seeds{static_cast<std::uint32_t>(scene_hash_),
                        static_cast<std::uint32_t>(scene_hash_ >> 32U),
                        static_cast<std::uint32_t>(trial)};
    std::mt19937_64 random(seeds);
    const double delay_ns = std::uniform_real_distribution<>(0, unambiguous_ns_)(random);
    const double drawn_mps =
        std::uniform_real_distribution<>(-max_speed_mps, max_speed_mps)(random);
    made_.distance_m = delay_ns * 1e-9 * speed_of_light_mps / 2;
    made_.velocity_mps = cell_.velocity_mps.value_or(drawn_mps);
    const auto frame = made_.make(random());
    const double begin_ms = bench::thread_ms();
    const Estimate found = estimate(frame.view());
    const double compute_ms = bench::thread_ms() - begin_ms;
    return compare(found, delay_ns, compute_ms);
  }

 private:
  static test::FrameMaker maker(const Cell& cell) {
    test::FrameMaker made;
    made.pattern = pattern_of(cell);
    made.length_ms = cell.length_ms;
    made.signal_per_pulse = cell.signal_per_pulse;
    made.background_per_ns = cell.background_per_ns;
    made.sigma_ns = pulse_sigma_ns;
    return made;
  }

  Estimate estimate(const FrameView& frame) {
    if (!by_wang_) return estimator_.estimate(frame);
    return estimate_by_wang(made_.pattern, *shape_, frame, max_speed_mps);
  }

  static EstimatorOptions options(const Job& job) {
    EstimatorOptions options;
    options.effort = job.cell.effort;
    options.method = job.estimator == Estimator::search ? Method::search : Method::paper;
    return options;
  }

  // Room for ten deviations above the mean number of photons, which no frame of a study reaches.
  static std::size_t most_photons(const Expectation& expectation) {
    const double mean = expectation.signal_photons + expectation.background_photons;
    return static_cast<std::size_t>(mean + 10 * std::sqrt(mean) + 20);
  }

  [[nodiscard]] TrialOutcome compare(const Estimate& found, double delay_ns,
                                     double compute_ms) const {
    TrialOutcome outcome;
    outcome.compute_ms = compute_ms;
    outcome.has_values = found.has_values;
    // Wang's method has no range odds.
    outcome.ambiguous =
        !by_wang_ && found.range_odds_nats < odds_at_risk_nats(EstimatorOptions().range_risk);
    outcome.error = {std::remainder(found.delay_ns - delay_ns, unambiguous_ns_),
                     found.velocity_mps - made_.velocity_mps,
                     found.signal_per_pulse - made_.signal_per_pulse,
                     found.background_per_ns - made_.background_per_ns};
    outcome.deviation = {found.std_delay_ns, found.std_velocity_mps, found.std_signal_per_pulse,
                         found.std_background_per_ns};
    return outcome;
  }

  Cell cell_;
  bool by_wang_;
  std::uint64_t scene_hash_;
  test::FrameMaker made_;
  double unambiguous_ns_;
  std::unique_ptr<PulseShape> shape_;
  FrameEstimator estimator_;
};

}  // namespace

double wrong_peak_limit_ns(const Expectation& expectation) {
  return std::max(5 * pulse_sigma_ns, 8 * expectation.bound.delay_ns);
}

std::optional<Score> run_job(const Job& job, const Expectation& expectation,
                             const std::stop_token& stop) {
  Bench bench(job, expectation);
  std::vector<TrialOutcome> outcomes;
  for (int trial = 0; trial < job.trials; ++trial) {
    if (stop.stop_requested()) return std::nullopt;
    outcomes.push_back(bench.run(trial));
  }
  return score(outcomes, wrong_peak_limit_ns(expectation));
}

}  // namespace splid::studies
