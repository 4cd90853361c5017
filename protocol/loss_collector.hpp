#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

// Joins neighbours, those with the smallest gaps first, until at most max_count (at least 1) are
// left: intervals grow, counts add up (-1 if one is), nothing is forgotten. `losses`: sorted by
// begin.
void join_losses(std::vector<Loss>& losses, std::size_t max_count);

// Turns loss_begin, loss_end and missed tags of a stream into a list of losses. A `missed` tag,
// which has no interval, becomes a loss with begin == end, as does one that is open when the clock
// breaks, with count -1.
//
// Threads: one. No allocation after construction: past its capacity neighbours are joined.
class LossCollector {
 public:
  // capacity: losses kept apart, at least 1.
  explicit LossCollector(std::size_t capacity = 1024);

  // Tags of any kind; those that tell of no loss are passed over.
  void take(const Tag& tag);
  // count tags missing at time_ps, found by the caller itself.
  void add_missed(std::int64_t time_ps, std::int64_t count);
  void add(const Loss& loss);

  // Sorted by begin, at most `capacity`. A loss not yet ended is in it up to now_ps, with count -1.
  [[nodiscard]] std::vector<Loss> losses(std::int64_t now_ps) const;

  // Sum of the known counts.
  [[nodiscard]] std::uint64_t lost_tags() const { return lost_tags_; }

 private:
  std::size_t capacity_;
  std::vector<Loss> losses_;
  std::optional<std::int64_t> open_since_ps_;
  std::uint64_t lost_tags_ = 0;
};

}  // namespace splid
