#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "bench/studies/cells.hpp"
#include "bench/studies/expectation.hpp"
#include "bench/studies/score.hpp"

namespace splid::studies {

// A finished job, with the machine that it ran on and the date.
struct Result {
  Job job;
  Expectation expectation;
  Score score;
  std::string machine;  // processor, as /proc/cpuinfo names it
  std::string date;     // UTC, 2026-11-21
};

// Results by key(job). Of several runs of a job the run with the most trials is kept.
using Results = std::map<std::string, Result>;

// A result as one line of CSV, without a line end, and back; absent where the line is no result.
std::string to_csv(const Result& result);
std::optional<Result> from_csv(const std::string& line);

// All *.csv in the folder; empty where there is no folder.
// Errors: Error(Fault::data), which names the file and the line that is no result of this program.
Results read_results(const std::filesystem::path& folder);

// Appends results to a file, each whole as soon as it is there; a line that was cut off by the end
// of an earlier run is taken away first. Threads: one at a time.
// Errors: Error(Fault::device) with the file and why it cannot be written.
class ResultFile {
 public:
  explicit ResultFile(std::filesystem::path file);
  void append(const Result& result) const;

 private:
  std::filesystem::path file_;
};

// The processor's name, "unknown processor" where /proc/cpuinfo has none.
std::string machine_name();
std::string today_utc();

}  // namespace splid::studies
