#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

// Joins neighbours, those with the smallest gaps first, until at most max_count (at least 1) losses
// are left. The shorter of two moves to the longer: lengths add up, and points stay points. Counts
// add up too, to -1 where one of them is -1; no loss is forgotten. losses: sorted by begin.
void join_losses(std::vector<Loss>& losses, std::size_t max_count);

// Turns loss_begin, loss_end and missed tags of a stream into a list of losses. A `missed` tag,
// which has no interval, becomes a loss with begin == end. So does a loss that is open when the
// clock breaks, with count -1.
//
// Threads: one. No allocation after construction: where there are more losses than the capacity,
// neighbours are joined.
class LossCollector {
 public:
  // capacity: how many losses are kept apart, at least 1.
  explicit LossCollector(std::size_t capacity = 1024);

  // Takes tags of any kind, and passes over those that tell of no loss.
  void take(const Tag& tag);
  // Takes note of `count` tags missing at time_ps, which the caller found itself.
  void add_missed(std::int64_t time_ps, std::int64_t count);
  void add(const Loss& loss);

  // The losses, at most `capacity`, sorted by begin. A loss that has not ended is in the list up to
  // now_ps, with count -1.
  [[nodiscard]] std::vector<Loss> losses(std::int64_t now_ps) const;

  // The sum of the known counts.
  [[nodiscard]] std::uint64_t lost_tags() const { return lost_tags_; }

 private:
  std::size_t capacity_;
  std::vector<Loss> losses_;
  std::optional<std::int64_t> open_since_ps_;
  std::uint64_t lost_tags_ = 0;
};

}  // namespace splid
