#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>

#include "daemon/batch/batch_list.hpp"
#include "daemon/stream/frame.hpp"
#include "protocol/record_decoder.hpp"

namespace splid::batch {

// How the frames of a recording are put together to slices. A slice is measured by one shard and
// kept as one file.
struct Slicing {
  // A thousand frames of 50 ms take a second of one core, and 350 kB.
  std::uint64_t frames = 1000;

  // So many rows, but no fewer than 20 frames.
  static Slicing of_pixels(std::uint64_t pixels) {
    return {std::max<std::uint64_t>(20, Slicing{}.frames / std::max<std::uint64_t>(1, pixels))};
  }

  // All frames in one slice: with estimator.tracked a frame depends on the estimates before it.
  static Slicing whole() { return {std::numeric_limits<std::uint64_t>::max()}; }
};

// Says of each frame of a recording, in their order, whether a shard estimates it: where its slice
// begins in the shard's part of the recording, and was not measured before.
//
// A slice begins where its first frame does: at as many records as there are tags in the
// frames before. (Records without a tag, such as overflows, put the slice a little earlier than
// it stands in the file, which changes no result.)
//
// Threads: wants() one; passed() and position() any. Errors: none. No allocation after
// construction.
class SliceChoice {
 public:
  // bytes: of the recording; measured: the slices that are there already, by number; record_bytes:
  // of each of its records.
  SliceChoice(Slicing slicing, std::uint64_t bytes, Part part, std::set<std::uint64_t> measured,
              std::size_t record_bytes = ptu_record_bytes);

  bool wants(const Frame& frame);

  // The frames have come to a slice behind the part: no later frame is wanted.
  [[nodiscard]] bool passed() const { return passed_.load(std::memory_order_acquire); }
  // How far in the recording the frames have come, bytes.
  [[nodiscard]] std::uint64_t position() const { return position_.load(std::memory_order_relaxed); }

 private:
  void begin_slice(std::uint64_t number);

  Slicing slicing_;
  std::uint64_t bytes_;
  Part part_;
  std::set<std::uint64_t> measured_;
  std::size_t record_bytes_;
  bool wanted_ = false;  // the slice that the last frame was in
  std::atomic<bool> passed_{false};
  std::atomic<std::uint64_t> position_{0};
};

}  // namespace splid::batch
