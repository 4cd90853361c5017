#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"

namespace splid::view {

// What the live page draws over time. The page has the same list, in the same order
// (daemon/view/page/view.js).
enum class Series : std::uint8_t {
  distance,            // m
  velocity,            // m/s
  reference_distance,  // m
  reference_velocity,  // m/s
  signal,              // counts a pulse
  background,          // counts/s
  sbr,
  drift,        // ppm
  jitter,       // ps
  latency,      // ms
  ring,         // 0 to 1
  count_rate,   // photons/s
  signal_rate,  // counts/s
};
inline constexpr std::size_t series_count = 13;

// The last seconds of all series, thinned: time is cut into 1,000 bins, and each bin keeps the mean
// of its values and how far they reach. So whoever draws the bins misses no outlier, however many
// frames a bin holds.
//
// Values of frames that are not valid are left out; each bin counts those frames. The reach of a
// value with a known deviation is from one deviation below the lowest to one above the highest.
//
// Threads: one. Errors: none.
class History {
 public:
  static constexpr std::int64_t most_bins = 1000;

  struct Reach {
    double sum = 0, low = 0, high = 0;
    std::uint32_t count = 0;
  };
  struct Bin {
    std::int64_t number = 0;  // its begin, in bins since 1970
    std::uint64_t change = 0;
    std::uint32_t frames = 0;
    std::uint32_t valid = 0;
    FrameStatus worst = FrameStatus::not_run;  // the last status in it that is not valid, if any
    std::array<Reach, series_count> series;
  };

  // window_s: how many seconds are kept, in whole bins.
  explicit History(double window_s)
      : window_s_(window_s), width_s_(window_s / static_cast<double>(most_bins)) {}

  // ring_fill_ratio: of the last status. A frame more than a second before the last frame begins
  // the history anew, as another replay does.
  void add(const FrameMessage& frame, double ring_fill_ratio);

  [[nodiscard]] double window_s() const { return window_s_; }
  [[nodiscard]] double width_s() const { return width_s_; }
  // In the order of time; only those that hold a frame.
  [[nodiscard]] const std::deque<Bin>& bins() const { return bins_; }
  // Counts changes; a bin's `change` is the number of its last change.
  [[nodiscard]] std::uint64_t change() const { return change_; }
  // Counts how often the history began anew.
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  // The highest value of a series in the window; absent where it has none.
  [[nodiscard]] std::optional<double> best(Series series) const;

  // The bins that changed after `change`, as JSON for the page: an array with a row for each bin,
  // [number, frames, valid frames, status, series...]. A series is 0 without a value, [mean], or
  // [low, mean, high].
  [[nodiscard]] std::string rows_after(std::uint64_t change) const;

 private:
  Bin& bin_at(double timestamp_s);

  double window_s_;
  double width_s_;
  std::deque<Bin> bins_;
  std::uint64_t change_ = 0;
  std::uint64_t epoch_ = 0;
};

}  // namespace splid::view
