#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/options.hpp"

namespace splid {

// Takes the timing walk of a detector off its photons: a detection soon after another on the same
// input comes late, by the delay that `detector.walk` has for the wait between the two. The delay
// is linear in the wait between two rows, that of the first row for shorter waits, and none for
// waits beyond the last row.
//
// Threads: one. Errors: none. No allocation after construction. Cost: a comparison a photon, and a
// search in at most 16 rows where the wait is in the table.
class TimingWalk {
 public:
  // rows: wait in ns, ascending, and delay in ps; empty: times stay as they are. inputs: from 0 to
  // this.
  TimingWalk(std::span<const NumberPair> rows, std::size_t inputs);

  [[nodiscard]] bool is_none() const { return rows_.empty(); }
  // The time of a photon without its walk. Photons of an input come in the order of time; one that
  // does not is taken as it is.
  std::int64_t without(std::int64_t time_ps, std::size_t input);

 private:
  struct Row {
    std::int64_t wait_ps, delay_ps;
  };
  [[nodiscard]] std::int64_t delay_ps(std::int64_t wait_ps) const;

  std::vector<Row> rows_;
  std::vector<std::optional<std::int64_t>>
      last_ps_;  // of each input: its last photon, without walk
};

}  // namespace splid
