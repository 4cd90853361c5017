#pragma once

#include <stop_token>
#include <vector>

#include "bench/studies/results.hpp"

namespace splid::studies {

// Runs jobs on so many threads, each for longest_s of its thread's time at most, appends each
// result to `file` when it is there and adds it to `results`; a line a job on standard error, with
// the time left. A stop request ends it at once: jobs under way are given up, those in the file are
// whole.
//
// Errors: the first of any thread, after all have ended.
void run_jobs(const std::vector<Job>& jobs, int threads, double longest_s,
              const std::stop_token& stop, const ResultFile& file, Results& results);

// What the search must not do, a sentence each; empty where all is well. In cells whose photons
// decide: RMSE of delay or velocity above the ratio to reach by more than four standard errors. In
// easy cells: any wrong peak, frame without a value or ambiguous by its odds. In any cell: more
// wrong peaks among frames that are ok than the risk allows.
std::vector<std::string> faults_of_search(const Results& results);

}  // namespace splid::studies
