// The tables and figures of [P] by one command: see --help and docs/evidence/accuracy.md.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/studies/report.hpp"
#include "bench/studies/runner.hpp"
#include "daemon/batch/batch_list.hpp"
#include "daemon/service/stop_signals.hpp"
#include "protocol/error.hpp"

namespace splid::studies {
namespace {

struct Options {
  bool quick = false;
  std::string shard = "1/1";
  std::vector<std::string> only;
  int trials = 0;  // 0: as many as fit, 1000 or for --quick 300
  std::string output = "bench/studies/results";
  std::string method = "both";
  int threads = 1;
  double longest_min = 60;
  std::string report;
  std::string table;
};

bool wanted(const Job& job, const Options& options) {
  const bool search = job.estimator == Estimator::search;
  if (options.method == "search" && !search) return false;
  if (options.method == "paper" && search) return false;
  if (options.only.empty()) return true;
  const std::string_view name = info(job.cell.study).name;
  return std::find(options.only.begin(), options.only.end(), name) != options.only.end();
}

// Every n-th of the jobs wanted, less those that are there with as many trials, or with as many as
// the time for a cell gave.
std::vector<Job> jobs_to_run(const Options& options, const Results& there) {
  const batch::Shard shard = batch::shard_of(options.shard);
  const int trials = options.trials > 0 ? options.trials : options.quick ? 300 : 1000;
  std::vector<Job> jobs;
  std::size_t n = 0;
  for (const Job& job : options.quick ? quick_jobs(trials) : full_jobs(trials)) {
    if (!wanted(job, options) || n++ % shard.count != shard.index - 1) continue;
    const auto found = there.find(key(job));
    const bool is_there =
        found != there.end() && (found->second.score.trials >= job.trials ||
                                 found->second.score.took_s >= 60 * options.longest_min);
    if (!is_there) jobs.push_back(job);
  }
  return jobs;
}

std::filesystem::path result_file(const Options& options) {
  const batch::Shard shard = batch::shard_of(options.shard);
  const std::string part =
      shard.count == 1 ? ""
                       : "-" + std::to_string(shard.index) + "of" + std::to_string(shard.count);
  return std::filesystem::path(options.output) / ("results" + part + ".csv");
}

int run(const Options& options) {
  for (const std::string& name : options.only) {
    if (!study_from_name(name)) throw Error(Fault::usage, "--only: no study " + name);
  }
  const std::filesystem::path file = result_file(options);
  std::filesystem::create_directories(options.output);
  // A quick run judges this build, not what an earlier one found.
  if (options.quick) std::filesystem::remove(file);
  StopSignals stop;
  Results results = read_results(options.output);
  const std::vector<Job> jobs = jobs_to_run(options, results);
  std::fprintf(stderr, "%zu cells to run, results in %s\n", jobs.size(), file.c_str());
  run_jobs(jobs, options.threads, 60 * options.longest_min, stop.token(), ResultFile(file),
           results);
  if (stop.token().stop_requested()) {
    std::fputs("stopped; the same command goes on from here\n", stderr);
    return 130;
  }
  if (!options.quick) return 0;
  write_report(options.output, std::filesystem::path(options.output) / "accuracy.md");
  const std::vector<std::string> faults = faults_of_search(results);
  for (const std::string& fault : faults) std::fprintf(stderr, "FAILED %s\n", fault.c_str());
  return faults.empty() ? 0 : 1;
}

int report(const Options& options) {
  const std::filesystem::path folder = options.report;
  const std::filesystem::path table =
      options.table.empty() ? folder / "accuracy.md" : std::filesystem::path(options.table);
  write_report(folder, table);
  std::fprintf(stderr, "%s written; python3 -m splid.plots study draws its figures\n",
               table.c_str());
  return 0;
}

void add_options(CLI::App& app, Options& options) {
  app.add_flag("--quick", options.quick,
               "A few cells, seconds; exit code 1 where the search misses its bound");
  app.add_option("--shard", options.shard, "i/n: every n-th cell, for several machines");
  app.add_option("--only", options.only,
                 "Studies: fig2, fig3, fig4, fig5, fig5-whole, fig9, any, velocities, experiment")
      ->delimiter(',');
  app.add_option("--trials", options.trials, "Frames a cell (1000; --quick: 300)")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--output", options.output, "Folder of the results, one CSV a shard")
      ->capture_default_str();
  app.add_option("--method", options.method, "Estimators to run")
      ->check(CLI::IsMember({"search", "paper", "both"}))
      ->capture_default_str();
  app.add_option("--threads", options.threads, "Cells at the same time")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--longest", options.longest_min,
                 "Minutes of processor time for a cell, which ends with the frames it has by then")
      ->check(CLI::Range(0.01, 1e4))
      ->capture_default_str();
  app.add_option("--report", options.report, "Run nothing: make the pages of this folder");
  app.add_option("--table", options.table,
                 "With --report: where the page goes (in the folder); two more beside it");
}

}  // namespace
}  // namespace splid::studies

int main(int argc, char** argv) {
  using namespace splid;
  CLI::App app{
      "Measures splid's estimators against the bound, figure by figure of [P]. Runs what "
      "is not yet in the output folder.",
      "studies"};
  studies::Options options;
  studies::add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(Fault::usage);
  }
  try {
    return options.report.empty() ? studies::run(options) : studies::report(options);
  } catch (const Error& error) {
    std::fprintf(stderr, "studies: error: %s\n", error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "studies: error: %s\n", error.what());
    return 1;
  }
}
