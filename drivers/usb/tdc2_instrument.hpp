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

namespace splid {

struct Tdc2Settings {
  std::array<double, 4> thresholds_mv{};  // of inputs 1 to 4
  std::uint32_t loss_bits = 0;            // of the status word
};

// Starts, watches and stops an S-Fifteen TDC2, and decodes its records.
//
// Lost tags: its status word is read every 50 ms. A bit that comes up tells of a loss, from where
// the stream is, since what the instrument had stored before comes first, to where it is when the
// word is read again. While the word cannot be read, which its maker's library tells by -1 too,
// nobody knows: after 1 s that is said, and each reading is a loss of unknown count. Where the word
// could be read before, the instrument is opened anew after 2 s.
//
// Records that make no sense for 0.5 s have the instrument opened anew, which aligns them.
//
// Heartbeats: the instrument is asked to insert dummy records, which are ones. Where nothing has
// come for 10 ms, what waits in a packet that is not full is asked for, and the time then surely
// passed, by the host's clock and 50 ms late, is the heartbeat.
class Tdc2Instrument final : public UsbInstrument {
 public:
  // For one command to be taken, and for its answer.
  static constexpr std::chrono::milliseconds patience{250};

  explicit Tdc2Instrument(const Tdc2Settings& settings) : settings_(settings) {}

  [[nodiscard]] std::uint8_t data_endpoint() const override { return 0x82; }
  [[nodiscard]] int alternate_setting() const override { return 1; }
  void prepare(UsbDevice& device) override;
  void start(UsbDevice& device) override;
  std::string tend(UsbDevice& device, TagSink& sink) override;
  void stop(UsbDevice& device) override;
  void decode(std::span<const std::byte> bytes, TagSink& sink) override;
  void cut(TagSink& sink) override;
  void end(TagSink& sink) override;
  // How often it sends dummies is not published; what hangs does not answer commands either.
  [[nodiscard]] bool owes_data() const override { return false; }

 private:
  using Clock = std::chrono::steady_clock;

  void load_table(UsbDevice& device);
  [[nodiscard]] std::uint32_t read_parameters(UsbDevice& device);
  std::string poll_status(UsbDevice& device, TagSink& sink);
  std::string count_unreadable(const UsbDevice& device, TagSink& sink);
  void watch_records(const UsbDevice& device) const;
  void beat(TagSink& sink);
  void begin_loss(TagSink& sink);
  void end_loss(TagSink& sink);
  void put(const Tag& tag, TagSink& sink);
  void put(std::span<const Tag> tags, TagSink& sink);

  Tdc2Settings settings_;
  Tdc2Decoder decoder_;
  std::array<Tag, 1024> decoded_;  // a sink's room may be too small for a record's tags
  std::uint32_t status_ = 0;       // word, when last read
  int unanswered_ = 0;             // questions for it, in a row
  int unreadable_ = 0;             // answers in a row that say nothing
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

}  // namespace splid
