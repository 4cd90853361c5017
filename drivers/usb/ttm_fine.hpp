#pragma once

#include <array>
#include <cstdint>

namespace splid::usb {

// One input's time within a clock period of the BrightEyes-TTM, from the code of its delay line.
// The taps of such a line have unequal lengths that change with temperature, so that the codes are
// calibrated by their own density: photons come at any time within a clock period, so that a code's
// share of all hits is its share of the period, and a hit lies in the middle of its code's share.
// Source: the calibration of the maker's libttp.
//
// Until 4,096 hits came, a tap counts as 48 ps. From then on the table is made anew as often as the
// number of hits doubles, and from 1,048,576 on each 524,288 hits, where older hits count half.
// What N hits leave is 2.1 ns / sqrt(N), at most: 33 ps at first, 2 ps in the end.
//
// Threads: one. Errors: none. No allocation.
class TtmFine {
 public:
  static constexpr std::uint32_t first_hits = 4096;

  TtmFine();

  // Counts a hit and returns how long before the clock's edge it came, 0 to 4167 ps.
  std::int32_t before_edge_ps(std::uint8_t code) {
    const std::int32_t before_ps = table_ps_[code];
    ++hits_[code];
    if (++count_ >= next_) calibrate();
    return before_ps;
  }

 private:
  void calibrate();

  std::array<std::int32_t, 256> table_ps_{};
  std::array<std::uint32_t, 256> hits_{};
  std::uint32_t count_ = 0;  // the sum of hits_
  std::uint32_t next_ = first_hits;
};

}  // namespace splid::usb
