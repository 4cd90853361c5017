#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace splid::test {

// An event at a BrightEyes-TTM of 25 inputs.
struct TtmEvent {
  static constexpr int laser = 124, pixel = 125, frame = 126, line = 127;

  std::int64_t time_ps = 0;
  int what = 0;  // an input from 0 to 24, or one of the above
};

// The records that the instrument's public firmware, version 2, makes of events: a record for each
// period of its clock in which something came, 4,096 periods after the last in any case; words of
// pairs of inputs that were not hit are left out. The taps of its delay lines are 32 and 64 ps long
// in turn. The line and the frame input stay high for 1,000 periods.
//
// Threads: one.
class TtmEncoder {
 public:
  static constexpr int inputs = 25;
  static constexpr std::int64_t most_silence = 4096;
  static constexpr std::uint32_t count_mask = (1U << 27U) - 1;

  // The laser's input comes only after a photon.
  bool filters_laser = true;
  // The memory is nearly full: photons and laser are dropped.
  bool drops = false;

  // events: sorted, before until_ps and not before what was encoded.
  void append(const std::vector<TtmEvent>& events, std::int64_t until_ps,
              std::vector<std::byte>& bytes) {
    for (const TtmEvent& event : events) {
      const std::int64_t period = period_of(event.time_ps);
      if (period != record_.period) flush(bytes);
      append_silence(period, bytes);
      add(event, period);
    }
    if (period_of(until_ps) > record_.period) flush(bytes);
    append_silence(period_of(until_ps), bytes);
  }
  // Nothing is sent of the time before.
  void skip_to(std::int64_t time_ps) { sent_ = record_.period = period_of(time_ps); }

  // Its taps are 32 ps long in the first half of the period, and 64 ps in the second.
  bool is_bent = false;

  static std::int64_t period_of(std::int64_t time_ps) { return (time_ps * 3 + 12'499) / 12'500; }

  // The code that the delay line gives a hit that long before the clock's edge, in thirds of a ps:
  // a period has 12,500.
  [[nodiscard]] int code_of(std::int64_t before_edge) const {
    if (is_bent) {
      constexpr std::int64_t half = 65 * 96;
      return static_cast<int>(before_edge < half ? before_edge / 96
                                                 : 65 + (before_edge - half) / 192);
    }
    const std::int64_t pairs = before_edge / 288;
    return static_cast<int>(2 * pairs + (before_edge - 288 * pairs < 96 ? 0 : 1));
  }

 private:
  struct Record {
    std::int64_t period = -1;
    std::array<int, inputs + 1> codes = none();  // by input, then of the laser; -1: no hit
    bool is_wanted = false;
    bool pixel = false;
  };

  static std::array<int, inputs + 1> none() {
    std::array<int, inputs + 1> codes{};
    codes.fill(-1);
    return codes;
  }
  static std::size_t place_of(int what) {
    return static_cast<std::size_t>(what == TtmEvent::laser ? inputs : what);
  }

  void add(const TtmEvent& event, std::int64_t period) {
    record_.period = period;
    if (event.what == TtmEvent::pixel) {
      record_.pixel = record_.is_wanted = true;
    } else if (event.what > TtmEvent::pixel) {
      high_until_.at(event.what == TtmEvent::frame ? 0 : 1) = period + 1000;
      record_.is_wanted = true;
    } else {
      record_.codes.at(place_of(event.what)) = code_of(period * 12'500 - event.time_ps * 3);
      record_.is_wanted |= !drops && (event.what < inputs || photon_since_laser_ || !filters_laser);
      photon_since_laser_ = event.what < inputs;
    }
  }

  void flush(std::vector<std::byte>& bytes) {
    if (record_.is_wanted) write(record_, bytes);
    record_.codes.fill(-1);
    record_.is_wanted = record_.pixel = false;
  }

  void append_silence(std::int64_t until, std::vector<std::byte>& bytes) {
    while (until - sent_ > most_silence) write({sent_ + most_silence, none(), true, false}, bytes);
  }

  void write(const Record& record, std::vector<std::byte>& bytes) {
    sent_ = record.period;
    const auto count = static_cast<std::uint32_t>(record.period) & count_mask;
    const auto code = [&](int what) { return drops ? -1 : record.codes.at(place_of(what)); };
    const auto word = [&](bool valid, int what, unsigned data) {
      bytes.push_back(static_cast<std::byte>(data));
      bytes.push_back(static_cast<std::byte>((valid ? 0x80U : 0U) | static_cast<unsigned>(what)));
    };
    const auto hit = [&](int what) {
      const int value = code(what);
      word(value >= 0, what, static_cast<unsigned>(value >= 0 ? value : 77));
    };
    for (int input = 0; input + 1 < inputs; input += 2) {
      if (code(input) < 0 && code(input + 1) < 0) continue;
      hit(input);
      hit(input + 1);
    }
    hit(inputs - 1);
    word(true, 123, (drops ? 0x80U : 0U) | count >> 21U);
    hit(TtmEvent::laser);
    const auto flag = [](bool high) { return high ? 0x80U : 0U; };
    word(true, TtmEvent::pixel, flag(record.pixel) | (count & 0x7FU));
    word(true, TtmEvent::frame, flag(record.period < high_until_[0]) | (count >> 7U & 0x7FU));
    word(true, TtmEvent::line, flag(record.period < high_until_[1]) | (count >> 14U & 0x7FU));
  }

  Record record_;
  std::int64_t sent_ = 0;  // period of the record that was sent last
  bool photon_since_laser_ = false;
  std::array<std::int64_t, 2> high_until_{};  // frame, line
};

}  // namespace splid::test
