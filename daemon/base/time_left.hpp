#pragma once

#include <cstddef>
#include <vector>

namespace splid {

// How long a work of several parts, done one after the other, still takes: what each was expected
// to take from a trial of it, corrected by what those that are done took.
//
// Threads: one. Errors: none.
class TimeLeft {
 public:
  // Before the first part begins, in the order in which they are done.
  void expect(double seconds) {
    expected_s_.push_back(seconds);
    all_expected_s_ += seconds;
  }

  // The part that is being done took this long so far, and is this much done, 0 to 1; s.
  [[nodiscard]] double left_s(double part, double took_s) const;
  // It is done; or, with took_s 0, left out.
  void finish(double took_s);

 private:
  // What is done took over what it was expected to take; hardly that before much is done.
  [[nodiscard]] double factor() const;

  std::vector<double> expected_s_;
  double all_expected_s_ = 0;
  std::size_t current_ = 0;
  double done_took_s_ = 0;
  double done_expected_s_ = 0;
};

}  // namespace splid
