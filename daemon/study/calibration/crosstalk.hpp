#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/stream/frame.hpp"

namespace splid::calibration {

// How often a detection of one pixel makes one of another.
struct Crosstalk {
  std::size_t from = 0, to = 0;  // pixels in the order of the configuration
  double share = 0;              // of the detections of `from`
  double std_share = 0;          // one standard deviation
  double delay_ns = 0;           // the mean time from the one to the other
  double std_delay_ns = 0;       // one standard deviation
};

// Counts pairs of detections of two pixels within 20 ns. Light that both see makes pairs as well:
// as many lie whole pattern periods apart, and these are counted too and taken off.
//
// Threads: one. Errors: none.
class CrosstalkCount {
 public:
  // period_ps: of the pattern, in the tagger's clock. late_ps: how much later than the first's each
  // pixel's photons come, beyond the configured delay.
  CrosstalkCount(double period_ps, std::vector<double> late_ps);

  // A frame with a part for each pixel. A frame shorter than five periods adds nothing.
  void add(const Frame& frame);
  // The pairs that stand out by five standard deviations, the largest share first.
  [[nodiscard]] std::vector<Crosstalk> significant() const;

 private:
  struct Detection {
    std::int64_t time_ps;
    std::size_t pixel;
  };
  struct Lags {
    double count = 0, sum_ps = 0, sum_ps2 = 0;
    // Of the squares of the lags' distances from a time.
    [[nodiscard]] double spread_ps2(double from_ps) const;
  };

  void collect(const Frame& frame);
  void count(std::int64_t apart_ps, double weight, std::vector<Lags>& pairs) const;

  double period_ps_;
  std::vector<double> late_ps_;
  std::vector<Detection> detections_;  // of a frame, sorted
  std::vector<double> detected_;       // of each pixel, in all frames
  std::vector<Lags> near_, far_;       // of each pair: within 20 ns, and periods apart on average
};

// Lines for people; empty without crosstalk. names: of the pixels.
std::string describe_crosstalk(const std::vector<Crosstalk>& pairs,
                               const std::vector<std::string>& names);

}  // namespace splid::calibration
