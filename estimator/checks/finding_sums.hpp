#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "estimator/checks/findings.hpp"

namespace splid::checks {

// The findings of many frames of a target together, each of which may show nothing. What keeps its
// sign from frame to frame (pulse shape, amplitudes, other light) is the same test on sums over the
// frames; of what changes its sign (paths, fading) the gains add up.
class FindingSums {
 public:
  // findings: judges the frames, and outlives this.
  explicit FindingSums(const Findings& findings);
  void clear();
  [[nodiscard]] double frames() const { return frames_; }
  // The frame that was judged last.
  void add(const FoldedFrame& frame);
  // What is sure by all frames since clear(), in the order of the table.
  [[nodiscard]] FoundList found() const;

 private:
  void add_sum(FoundList& all, std::size_t row) const;
  void say(FoundList& all, const FindingRow& row, double amount, double gain_nats) const;

  const Findings& findings_;
  std::array<RowScore, rows_with_directions> rows_;
  std::vector<double> by_pulse_, expected_, light_, by_phase_, seen_phase_;
  double frames_ = 0, length_ns_ = 0, seen_ns_ = 0;
};

}  // namespace splid::checks
