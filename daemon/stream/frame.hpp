#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "estimator/model/frame_view.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "protocol/tag.hpp"

namespace splid {

// An array of fixed capacity, all memory of which is allocated and written when it is made; or one
// that doubles up to `most` items when an item is added and it is full.
template <class T>
class FixedArray {
 public:
  explicit FixedArray(std::size_t capacity, std::size_t most = 0)
      : items_(std::make_unique<T[]>(capacity)), capacity_(capacity), most_(most) {}

  // Adds an item; returns false and adds nothing when the array is full.
  bool push(const T& item) {
    if (size_ == capacity_ && !enlarge()) return false;
    items_[size_++] = item;
    return true;
  }
  // The free room behind the last item, to be written to and then added with grow().
  [[nodiscard]] std::span<T> room() { return {items_.get() + size_, capacity_ - size_}; }
  void grow(std::size_t count) { size_ += count; }
  void resize(std::size_t size) { size_ = size; }
  void clear() { size_ = 0; }
  [[nodiscard]] bool may_grow() const { return capacity_ < most_; }
  // Doubles the room, up to `most`; returns false where it has that already.
  bool enlarge() {
    if (capacity_ >= most_) return false;
    const std::size_t capacity = std::min(2 * capacity_, most_);
    std::unique_ptr<T[]> items = std::make_unique<T[]>(capacity);
    std::copy_n(items_.get(), size_, items.get());
    items_ = std::move(items);
    capacity_ = capacity;
    return true;
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  T& operator[](std::size_t i) { return items_[i]; }
  const T& operator[](std::size_t i) const { return items_[i]; }
  T& back() { return items_[size_ - 1]; }
  T* begin() { return items_.get(); }
  T* end() { return items_.get() + size_; }
  [[nodiscard]] const T* begin() const { return items_.get(); }
  [[nodiscard]] const T* end() const { return items_.get() + size_; }
  [[nodiscard]] std::span<const T> view() const { return {items_.get(), size_}; }

 private:
  std::unique_ptr<T[]> items_;
  std::size_t size_ = 0;
  std::size_t capacity_;
  std::size_t most_;
};

// How many tags of each kind a frame can hold; see frame_capacity() in frame_plan.hpp.
struct FrameCapacity {
  std::size_t photons = 1 << 20;
  std::size_t syncs = 1 << 16;
  std::size_t markers = 1 << 14;
  std::size_t losses = 256;
  std::size_t most_photons = 0;  // that the room grows to where a frame is fuller; 0: it is fixed
  std::size_t pixels = 0;        // that have this room for photons each; 0: there is one
};

// A tag of the encoder's marker channel.
struct MarkerTag {
  std::int64_t time_ps = 0;
  std::int32_t bits = 0;  // all marker bits of the record; the input's number for an input
};

// Which dwell of a scan a frame is. All from 0.
struct ScanPlace {
  std::int64_t picture = 0;
  std::int64_t line = 0;     // of the picture
  std::int64_t column = 0;   // of the line, from left to right also where the line runs back
  std::int64_t columns = 1;  // that the line has
  // The encoder's sample clock at mid-frame: how many ticks after its first. Not a number where it
  // has not ticked twice.
  double tick = std::numeric_limits<double>::quiet_NaN();
  friend bool operator==(const ScanPlace&, const ScanPlace&) = default;
};

// One frame with its tags. All times are in the tagger's clock. The Framer fills it; it may be read
// from FrameSink::close() on, until it is opened again.
struct Frame {
  // 64 photons of the time before suffice: 8 detectors with 3 would-be detections in
  // each dead time make 24.
  static constexpr std::size_t most_before = 64;
  static constexpr std::size_t most_inputs = 64;

  explicit Frame(const FrameCapacity& capacity);

  std::uint64_t sequence = 0;           // counts frames from 0
  std::int64_t start_ps = 0;            // a pattern start, if there are syncs to tell; or a dwell's
  std::int64_t end_ps = 0;              // the next frame's start, unless the clock jumps between
  FixedArray<std::int64_t> photons_ps;  // in [start_ps, end_ps), nearly sorted
  FixedArray<std::int64_t> syncs_ps;    // in [start_ps, end_ps), nearly sorted
  FixedArray<MarkerTag> markers;        // in [start_ps, end_ps), nearly sorted
  FixedArray<Loss> losses;              // clipped to the frame, sorted, not overlapping
  // The last photons before start_ps, nearly sorted, where the clock did not break in between.
  FixedArray<std::int64_t> before_ps{most_before};
  // How many of the photons came on each input, in the order of the configuration; empty where they
  // all come on one, or on more than most_inputs.
  FixedArray<std::uint64_t> photons_of_input{most_inputs};
  std::uint64_t lost_tags = 0;  // tags of losses that ended in this frame, late and surplus tags
  std::uint64_t uncounted_losses = 0;  // losses of unknown count that ended in this frame
  double seen_fraction = 0;            // 0 to 1: 1 less the losses' share of the frame's time
  bool is_cut_off = false;             // the stream ended before end_ps
  SyncFit sync;
  std::optional<ScanPlace> scan;  // absent where frames are cut by time
  std::int64_t arrival_ns = 0;    // of the last tag, as passed to Framer::push()
  // Where there are several pixels, their parts of the frame, in the order of the configuration:
  // photons_ps and before_ps above are then empty. A part has the frame's bounds, sync, losses and
  // lost tags, its own photons, and as a loss of its own the time after they had filled their room.
  std::vector<std::unique_ptr<Frame>> pixels;

  // Of all pixels together.
  [[nodiscard]] std::size_t photon_count() const;
  // Of the pixel that has most.
  [[nodiscard]] std::span<const std::int64_t> densest_photons() const;
  // Gives what all pixels share to the part of one, of whose photons `surplus` had no room.
  // surplus_of_all: of all pixels, which are among lost_tags.
  void share_with(Frame& pixel, std::uint64_t surplus, std::uint64_t surplus_of_all) const;

  // Adds the loss [loss_begin_ps, loss_end_ps), without its part before start_ps; count: as in
  // Loss. If there is no room for another loss, the last loss grows to cover this one and the time
  // between, so that less time counts as seen than was seen.
  void add_loss(std::int64_t loss_begin_ps, std::int64_t loss_end_ps, std::int64_t count);
  // Sorts the losses, clips them to the frame, joins losses that touch, and fills seen_fraction.
  void settle_losses();

  // Valid as long as the frame is.
  [[nodiscard]] FrameView view() const {
    return {start_ps, end_ps,           photons_ps.view(),      losses.view(),
            sync,     before_ps.view(), photons_of_input.view()};
  }
};

// Gives the framer empty frames and takes the full ones: the lanes, or a test's vector.
//
// Threads: the framer's. Errors: none. Timeouts: open() may wait for a free frame.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  // A frame to fill; its old content is overwritten. Never called twice without close() between. A
  // frame that is still open when the stream has ended is empty.
  virtual Frame& open() = 0;
  // The frame of the last open() is complete.
  virtual void close() = 0;
};

}  // namespace splid
