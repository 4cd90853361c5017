#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/usb/tdc2_command.hpp"
#include "drivers/usb/tdc2_decode.hpp"
#include "drivers/usb/usb_instrument.hpp"

namespace splid::usb {

struct Tdc2Settings {
  std::array<double, 4> thresholds_mv{};  // of inputs 1 to 4
  std::uint32_t loss_bits = 0;            // of the status word
};

// Starts, watches and stops an S-Fifteen TDC2, and decodes its records.
//
// Lost tags: the instrument's status word is read every 50 ms. A bit that becomes 1 tells of a
// loss. The loss begins where the stream is at that time, since the tags that the instrument had
// stored before come first, and ends where the stream is when the word is read again. A word of
// which all bits are 1 could not be read, which the maker's library gives as -1: whether tags are
// lost is then unknown. After 1 s this is reported, and each such reading is a loss of unknown
// count. If the word could be read before, the instrument is opened anew after 2 s.
//
// After 0.5 s of records that make no sense the instrument is opened anew, which aligns the
// records.
//
// Heartbeats: the instrument is asked to insert dummy records, which become heartbeats. Where
// nothing has come for 10 ms, the instrument is asked to send what waits in a packet that is not
// full. The heartbeat is then the time that has passed at least: that of the host's clock, less 50
// ms.
class Tdc2Instrument final : public Instrument {
 public:
  // How long the instrument may take to accept a command, and again to answer it.
  static constexpr std::chrono::milliseconds patience{250};

  explicit Tdc2Instrument(const Tdc2Settings& settings) : settings_(settings) {}

  [[nodiscard]] std::uint8_t data_endpoint() const override { return 0x82; }
  [[nodiscard]] int alternate_setting() const override { return 1; }
  void prepare(Device& device) override;
  void start(Device& device) override;
  std::string tend(Device& device, TagSink& sink) override;
  void stop(Device& device) override;
  void decode(std::span<const std::byte> bytes, TagSink& sink) override;
  void cut(TagSink& sink) override;
  void end(TagSink& sink) override;
  // How often it sends dummies is not published. An instrument that hangs does not answer commands
  // either, which poll_status() notices.
  [[nodiscard]] bool owes_data() const override { return false; }

 private:
  using Clock = std::chrono::steady_clock;

  void load_table(Device& device);
  [[nodiscard]] std::uint32_t read_parameters(Device& device);
  std::string poll_status(Device& device, TagSink& sink);
  std::string count_unreadable(const Device& device, TagSink& sink);
  void watch_records(const Device& device) const;
  void beat(TagSink& sink);
  void begin_loss(TagSink& sink);
  void end_loss(TagSink& sink);

  Tdc2Settings settings_;
  Tdc2Decoder decoder_;
  std::array<Tag, 1024> decoded_;  // since a sink's room may be too small for a record's tags
  std::uint32_t status_ = 0;       // the status word when it was last read
  int unanswered_ = 0;             // questions in a row for the status word
  int unreadable_ = 0;             // answers in a row of which all bits are 1
  bool was_readable_ = false;      // since it was opened
  std::uint64_t cut_records_ = 0;
  std::uint64_t told_strays_ = 0;
  bool loss_open_ = false;
  bool loss_seen_by_status_ = false;
  Clock::time_point heard_{};   // when records came last
  Clock::time_point fitted_{};  // when the decoder was not adrift last
  Clock::time_point next_poll_{};
  Clock::time_point next_beat_{};
};

}  // namespace splid::usb
