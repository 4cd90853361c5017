#pragma once

#include <cstddef>
#include <vector>

namespace splid {

// Reckons how long a work of several parts, done one after the other, still takes. A trial of each
// part tells beforehand how long that part is expected to take; the times that the finished parts
// really took correct the expectation of the parts to come.
//
// Threads: one. Errors: none.
class TimeLeft {
 public:
  // Adds a part that is expected to take so long. To be called for all parts, in the order in which
  // they will be done, before the first part begins.
  void expect(double seconds) {
    expected_s_.push_back(seconds);
    all_expected_s_ += seconds;
  }

  // Seconds left, when the current part has taken took_s so far. part: how much of the current part
  // is done, 0 to 1.
  [[nodiscard]] double left_s(double part, double took_s) const;
  // The current part is finished and took took_s; 0: the part was left out.
  void finish(double took_s);

 private:
  // The time that the finished parts took over the time expected of them; held near 1 while little
  // is finished.
  [[nodiscard]] double factor() const;

  std::vector<double> expected_s_;
  double all_expected_s_ = 0;
  std::size_t current_ = 0;
  double done_took_s_ = 0;
  double done_expected_s_ = 0;
};

}  // namespace splid
