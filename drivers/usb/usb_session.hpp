#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "drivers/usb/bulk_stream.hpp"
#include "drivers/usb/usb_instrument.hpp"

namespace splid::usb {

// One stretch of streaming: from the start of an open device to its loss, or to the stop. Its loop
// takes each block from the queue, has the instrument decode it into the sink, tends the
// instrument, and recovers from stalls and failed transfers.
//
// Threads: the source's. Errors: usb::DeviceError when the device is gone, fails for good or is
// silent.
class Session {
 public:
  // An instrument that owes data and has been silent for this time is opened anew, which frees an
  // endpoint that hangs.
  static constexpr std::chrono::milliseconds silence_ended{2000};
  // What an instrument sent before it was asked to is thrown away until the instrument is quiet,
  // and for this time at most: an instrument that streams by itself is never quiet.
  static constexpr std::chrono::milliseconds longest_drain{20};

  using Report = std::function<void(DeviceState, const std::string&)>;
  // Called once a second while it streams.
  using LookAround = std::function<void()>;

  // All references outlive this object.
  Session(Device& device, Instrument& instrument, BulkStream& stream, BlockQueue& queue, Wake& wake,
          Report report, LookAround look_around);

  void run(std::size_t transfers, TagSink& sink, const std::stop_token& stop);

 private:
  using Clock = std::chrono::steady_clock;

  void start(std::size_t transfers);
  void stream_until(const std::stop_token& stop, TagSink& sink);
  bool decode_queued(TagSink& sink);
  void take_cuts(std::uint32_t cuts, TagSink& sink);
  void report_failures();
  void look_around();
  void watch_silence();
  void recover();
  void restart(std::size_t transfers, const std::string& why);

  Device& device_;
  Instrument& instrument_;
  BulkStream& stream_;
  BlockQueue& queue_;
  Wake& wake_;
  Report report_;
  LookAround look_around_;
  std::size_t transfers_ = 0;  // in flight
  std::uint32_t cuts_ = 0;     // the queue's cuts that the instrument was told of
  std::uint32_t reported_cuts_ = 0;
  std::uint32_t reported_drops_ = 0;
  std::uint32_t reported_stalls_ = 0;
  Clock::time_point next_report_;  // when failed transfers may be reported again
  Clock::time_point next_look_;    // when look_around_ is due
  Clock::time_point heard_;        // when bytes came last
  bool silent_ = false;
};

}  // namespace splid::usb
