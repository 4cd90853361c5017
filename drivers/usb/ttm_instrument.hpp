#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/usb/ttm_decode.hpp"
#include "drivers/usb/usb_instrument.hpp"

namespace splid::usb {

// Reads and watches a BrightEyes-TTM, which sends from when it has power and takes no commands.
//
// Lost tags: TtmDecoder's losses; what it counts is reported once a second. Failed transfers are a
// loss until the next record. Where nothing came for 0.25 s, half of what its count lasts, a gap in
// the records ends its clock. After 0.5 s of bytes without a record it is opened anew.
class TtmInstrument final : public Instrument {
 public:
  [[nodiscard]] std::uint8_t data_endpoint() const override { return 0x81; }
  std::string tend(Device& device, TagSink& sink) override;
  void decode(std::span<const std::byte> bytes, TagSink& sink) override;
  void cut(TagSink& sink) override;
  void end(TagSink& sink) override;
  // A record comes every 17 us, and padding besides.
  [[nodiscard]] bool owes_data() const override { return true; }

 private:
  using Clock = std::chrono::steady_clock;

  TtmDecoder decoder_;
  std::array<Tag, 1024> decoded_;  // since a sink's room may be too small for a record's tags
  TtmFaults told_;
  std::uint64_t records_ = 0;                // that the decoder had at fitted_
  std::optional<Clock::time_point> heard_;   // when bytes came last
  std::optional<Clock::time_point> fitted_;  // when bytes came last that had a record, or the first
  Clock::time_point next_news_{};
};

}  // namespace splid::usb
