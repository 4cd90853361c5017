#include "bench/studies/runner.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <mutex>
#include <thread>

#include "bench/studies/trial.hpp"

namespace splid::studies {
namespace {

using Seconds = std::chrono::duration<double>;

// How much work a job is, in photons. A frame without photons still costs the look at all delays.
double work_of(const Job& job) {
  const Expectation e = expect(job.cell);
  return job.trials * (e.signal_photons + e.background_photons + 500);
}

std::string in_words(const Cell& cell) {
  return std::string(info(cell.study).name) + " " + splid::to_string(cell.mode) +
         fmt::format(
             " {:g} ms, S {:g}, b {:g}/ns, v {}", cell.length_ms, cell.signal_per_pulse,
             cell.background_per_ns,
             cell.velocity_mps ? fmt::format("{:g} m/s", *cell.velocity_mps).c_str() : "any");
}

std::string in_words(const Result& result) {
  const Score& s = result.score;
  const Bound& bound = result.expectation.bound;
  return fmt::format(
      "delay {:.2f}, velocity {:.2f} of the bound, {} wrong, {} of them ok, {} ambiguous, "
      "{} none, of {}; {:.2f} ms a frame",
      s.rmse[delay] / bound.delay_ns, s.rmse[velocity] / bound.velocity_mps, s.wrong, s.wrong_ok,
      s.ambiguous, s.no_value, s.trials, s.p50_ms);
}

// Guesses the time left from what each estimator took for its work so far.
class TimeLeft {
 public:
  explicit TimeLeft(const std::vector<Job>& jobs) {
    for (const Job& job : jobs) left_[index(job)] += work_of(job);
  }
  void finished(const Job& job, double took_s) {
    const double work = work_of(job);
    left_[index(job)] -= work;
    done_[index(job)] += work;
    took_s_[index(job)] += took_s;
  }
  [[nodiscard]] std::string text(int threads) const {
    double rate = 0;  // seconds per photon, of whichever estimator ran
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (done_[i] > 0) rate = std::max(rate, took_s_[i] / done_[i]);
    }
    double seconds = 0;
    for (std::size_t i = 0; i < left_.size(); ++i) {
      seconds += left_[i] * (done_[i] > 0 ? took_s_[i] / done_[i] : rate);
    }
    seconds = std::max(0.0, seconds) / threads;  // rounding may leave less than nothing
    return seconds < 90 ? fmt::format("{:.0f} s left", seconds)
                        : fmt::format("{:.0f} min left", seconds / 60);
  }

 private:
  static std::size_t index(const Job& job) { return static_cast<std::size_t>(job.estimator); }
  std::array<double, 5> left_{}, done_{}, took_s_{};
};

// The state that the threads share.
struct Run {
  const std::vector<Job>& jobs;
  int threads;
  double longest_s;
  const ResultFile& file;
  std::atomic<std::size_t> next{0};
  std::mutex mutex;  // guards the members below
  TimeLeft left;
  Results& results;
  std::size_t finished = 0;
  std::exception_ptr error;

  void take(const Result& result, double took_s) {
    const std::scoped_lock lock(mutex);
    file.append(result);
    results[key(result.job)] = result;
    left.finished(result.job, took_s);
    std::fprintf(stderr, "[%zu of %zu] %s, %s: %s; %s\n", ++finished, jobs.size(),
                 in_words(result.job.cell).c_str(), to_string(result.job.estimator),
                 in_words(result).c_str(), left.text(threads).c_str());
  }
  void fail(std::exception_ptr what) {
    const std::scoped_lock lock(mutex);
    if (!error) error = std::move(what);
    next = jobs.size();
  }
};

void work(Run& run, const std::stop_token& stop) {
  const std::string machine = machine_name();
  while (!stop.stop_requested()) {
    const std::size_t at = run.next++;
    if (at >= run.jobs.size()) return;
    const Job& job = run.jobs[at];
    const auto begin = std::chrono::steady_clock::now();
    const Expectation expectation = expect(job.cell);
    const std::optional<Score> found = run_job(job, expectation, stop, run.longest_s);
    if (!found) return;
    const Seconds took = std::chrono::steady_clock::now() - begin;
    run.take({job, expectation, *found, machine, today_utc()}, took.count());
  }
}

void check_ratio(const Result& result, const char* what, double ratio,
                 std::vector<std::string>& faults) {
  const double limit = info(result.job.cell.study).ratio_to_reach;
  const double allowed = limit * (1 + 4 * result.score.relative_error());
  if (ratio <= allowed) return;
  faults.push_back(in_words(result.job.cell) +
                   fmt::format(": RMSE of {} is {:.3f} of the bound; {} frames allow {:.3f}", what,
                               ratio, result.score.right(), allowed));
}

}  // namespace

void run_jobs(const std::vector<Job>& jobs, int threads, double longest_s,
              const std::stop_token& stop, const ResultFile& file, Results& results) {
  Run run{.jobs = jobs,
          .threads = threads,
          .longest_s = longest_s,
          .file = file,
          .mutex = {},
          .left = TimeLeft(jobs),
          .results = results,
          .error = {}};
  {
    std::vector<std::jthread> workers;
    workers.reserve(static_cast<std::size_t>(threads));
    for (int n = 0; n < threads; ++n) {
      workers.emplace_back([&run, &stop] {
        try {
          work(run, stop);
        } catch (...) {
          run.fail(std::current_exception());
        }
      });
    }
  }
  if (run.error) std::rethrow_exception(run.error);
}

// More wrong peaks among frames that are ok than the risk allows, by more than chance; and frames
// lost to the odds where there is nothing to doubt.
void check_odds(const Result& result, std::vector<std::string>& faults) {
  const Score& s = result.score;
  if (s.ok() > 0 && wilson_95(s.wrong_ok, s.ok()).low > EstimatorOptions().range_risk) {
    faults.push_back(
        in_words(result.job.cell) +
        fmt::format(": {} wrong peaks among {} frames that are ok", s.wrong_ok, s.ok()));
  }
  if (is_easy(result.expectation) && s.ambiguous > 0) {
    faults.push_back(
        in_words(result.job.cell) +
        fmt::format(": {} frames ambiguous where the photons leave no doubt", s.ambiguous));
  }
}

std::vector<std::string> faults_of_search(const Results& results) {
  std::vector<std::string> faults;
  for (const auto& [name, result] : results) {
    const Score& s = result.score;
    if (result.job.estimator != Estimator::search) continue;
    check_odds(result, faults);
    if (is_easy(result.expectation) && s.right() < s.trials) {
      faults.push_back(in_words(result.job.cell) +
                       fmt::format(": {} wrong peaks and {} without a value", s.wrong, s.no_value) +
                       " where the photons leave no doubt");
    }
    if (!photons_decide(result.expectation) || s.right() == 0) continue;
    const Bound& bound = result.expectation.bound;
    check_ratio(result, "delay", s.rmse[delay] / bound.delay_ns, faults);
    check_ratio(result, "velocity", s.rmse[velocity] / bound.velocity_mps, faults);
  }
  return faults;
}

}  // namespace splid::studies
