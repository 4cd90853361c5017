#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/tag.hpp"

namespace splid::recording {

// Takes out of a stream the single tags whose time is wrong. A recording is sorted by time: after
// one tag far ahead all tags would come too late for it, and would be lost.
//
// A photon, sync, marker or heartbeat that is more than 1 s ahead of all tags before it waits for
// the next tag. If the next tag is as far ahead, to 1 us, the stream has paused, and both tags
// are right. If not, a `missed` tag takes the place of the tag that waited. The framer judges such
// a tag in the same way, so live frames and a replay agree. Other tags are believed.
//
// 16 tags in a row that are more than 1 s behind the newest tag before them mean that the tagger's
// clock was set back. The first 15 of them come too late for the recording; a clock_break goes
// before the 16th.
//
// Threads: one. Errors: none. Allocates only where a tag has to wait or is behind.
class StrayTimes {
 public:
  // Returns the tags to record, in order; valid until the next call.
  std::span<const Tag> sort_out(std::span<const Tag> tags);
  // The stream is over: returns the tag that still waits, if there is one.
  std::span<const Tag> finish();

  // Photons, syncs and markers that were taken out.
  [[nodiscard]] std::uint64_t strays() const { return strays_; }

 private:
  std::size_t steady(std::span<const Tag> tags);
  bool follows(const Tag& tag);
  void take(const Tag& tag);
  void settle(const Tag& next);

  std::optional<std::int64_t> newest_ps_;  // absent: no tag yet, since the clock was set anew
  std::optional<Tag> waiting_;
  std::vector<Tag> kept_;
  int backward_run_ = 0;  // tags in a row that are behind
  std::uint64_t strays_ = 0;
};

}  // namespace splid::recording
