#include "bench/studies/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "protocol/error.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::studies {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Every cell of Fig. 2 with errors as large as the bound.
Results made_results() {
  Results results;
  for (const Job& job : full_jobs(1000)) {
    if (job.cell.study != Study::fig2) continue;
    Result result;
    result.job = job;
    result.expectation = expect(job.cell);
    result.score.trials = 1000;
    const Bound& bound = result.expectation.bound;
    result.score.rmse = {bound.delay_ns, bound.velocity_mps, bound.signal_per_pulse,
                         bound.background_per_ns, bound.delay_start_ns};
    result.machine = "Some Processor";
    result.date = "2026-11-21";
    results[key(job)] = result;
  }
  return results;
}

TEST(Report, TablesSayWhatWasRunAndWhatWasFound) {
  Results results = made_results();
  const std::string name = "fig2,interleaved,balanced,0.5,0.01,0.001,30,search";
  results.at(name).score.wrong = 3;
  results.at(name).score.trials = 900;
  const std::string text = figures_page(results, "studies");
  EXPECT_THAT(text, HasSubstr("Run 2026-11-21 on Some Processor. Again:\n"));
  EXPECT_THAT(text, HasSubstr("studies/fig2.svg"));
  EXPECT_THAT(text, HasSubstr("| interleaved | search | 900 to 1000 | 1.00 1.00 |"));
  EXPECT_THAT(text, HasSubstr("| 1.00 1.00 (0.33 %) |"));
  EXPECT_THAT(text, Not(HasSubstr("Fig. 4: few photons")));
  EXPECT_THAT(beyond_page(results, "studies"),
              HasSubstr("| fig2 | search | 28 | 21 | 21 | 1 | 1 | 3 of 20900 | 0 |"));
  results.at(name).machine = "Another Processor";
  results.at(name).date = "2026-11-22";
  EXPECT_THAT(figures_page(results, "studies"),
              HasSubstr("Run 2026-11-22 on Another Processor (`search`),\n"
                        "2026-11-21 on Some Processor (`paper`, `search`). Again:\n"));
}

TEST(Report, CellsThatTellNothingAreMarked) {
  Results results = made_results();
  std::erase_if(results,
                [](const auto& one) { return one.second.job.cell.mode != Mode::baseline; });
  for (auto& [name, result] : results) result.score.no_value = 600;
  EXPECT_THAT(figures_page(results, "."), HasSubstr("| ✗ – (none 60 %) |"));
  EXPECT_THAT(beyond_page(results, "."),
              HasSubstr("| fig2 | search | 7 | 0 | 0 | – | – | 0 of 0 | 0 |"));
  EXPECT_THAT(reader_page(results), HasSubstr("| baseline | ✗ | ✗ |"));
}

// A method holds up to the last background before the first that it fails in.
TEST(Report, TheReadersPageSaysWhereAMethodBreaks) {
  Results results = made_results();
  const auto cell = [&](const std::string& background, const std::string& method) -> Score& {
    return results.at("fig2,interleaved,balanced,0.5,0.01," + background + ",30," + method).score;
  };
  cell("0.001", "search").rmse[velocity] *= 1.03;
  cell("0.00316", "paper").wrong = 50;
  cell("0.01", "paper").wrong = 500;
  EXPECT_THAT(reader_page(results), HasSubstr("| interleaved | all: 1.03 | ≤ 0.001: 1.00 (5 %) |"));
  cell("1e-05", "paper").rmse[delay] *= 3;
  EXPECT_THAT(reader_page(results), HasSubstr("| interleaved | all: 1.03 | none (3.00) |"));
  EXPECT_THAT(reader_page(results), HasSubstr("own settings, 1000 frames a cell"));
}

TEST(Report, ThePagesAreWrittenAndAnEmptyFolderIsAnError) {
  const test::TempFolder folder;
  const std::filesystem::path results = folder.path("results");
  std::filesystem::create_directory(results);
  EXPECT_THROW(write_report(results, folder.path("accuracy.md")), Error);
  const ResultFile file(results / "results.csv");
  for (const auto& [name, result] : made_results()) file.append(result);
  write_report(results, folder.path("accuracy.md"));
  const auto text_of = [&](const char* name) {
    std::ifstream in(folder.path(name));
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  EXPECT_THAT(text_of("accuracy.md"), HasSubstr("(accuracy-figures.md)"));
  EXPECT_THAT(text_of("accuracy-figures.md"), HasSubstr("(studies/fig2.svg)"));
  EXPECT_THAT(text_of("accuracy-beyond.md"), HasSubstr("| fig2 | search |"));
}

}  // namespace
}  // namespace splid::studies
