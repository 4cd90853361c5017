#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/usb/ttm_fine.hpp"
#include "protocol/tag.hpp"

namespace splid::usb {

// What a TtmDecoder saw go wrong so far.
struct TtmFaults {
  std::uint64_t full = 0;    // times that the instrument said that its memory is nearly full
  std::uint64_t gaps = 0;    // times that records are missing by their clock
  std::uint64_t broken = 0;  // records that are none that can be

  friend bool operator==(const TtmFaults&, const TtmFaults&) = default;
};

// Turns the records of a BrightEyes-TTM, of its second protocol, into tags. Words of 16 bits,
// little endian: bit 15 valid, 14-8 what it is, 7-0 data. A record is what happened in one period
// of the clock of 240 MHz (4.17 ns):
//
//   0-48      an input: a photon, if valid; data: its delay line's code. Inputs without one may be
//             left out
//   122       of later firmware, passed over
//   123       bit 7: photons are being dropped, since the memory is nearly full; bits 5-0: bits
//             26-21 of the clock's count
//   124       the laser's input, if valid; data: its code
//   125, 126, 127   always valid. Bit 7: the pixel input rose, the frame input is high, the line
//             input is high; bits 6-0: bits 6-0, 13-7, 20-14 of the count
//
// 0x7FFF is padding, anywhere. The count wraps every 0.56 s. A record comes at least every 4,096
// periods, the laser's input only with a record for another reason or after a photon.
// Sources: FPGA/ttm/hdl of VicidominiLab/BrightEyes-TTM, and libttp.
//
//  - an input's word is a photon tag; value: the input. The code is the time from the photon to the
//    clock's edge (TtmFine), so that the time is the count's less the code's;
//  - the laser's is a sync tag; pixel, line and frame are markers of bits 1, 2 and 4, at rising
//    edges, to 4.17 ns; a record with nothing is a heartbeat;
//  - dropped photons, missing records (a count that is ahead by more than 4,352) and broken records
//    are a loss of unknown count from the last good record to the next;
//  - a count that steps back is a clock_break, and so are missing records where the count may have
//    wrapped meanwhile (doubt_count). Each 53 days there is one too, and times go on from 0.
//
// A device that loses between 0.28 and 0.56 s of records looks as one whose count stepped back.
//
// Threads: one. Errors: none, whatever the bytes. No allocation.
class TtmDecoder {
 public:
  static constexpr int inputs = 49;
  static constexpr std::size_t word_bytes = 2;
  // Photons, sync, marker, and what a loss or a clock_break takes.
  static constexpr std::size_t most_tags_a_word = inputs + 7;

  struct Progress {
    std::size_t bytes = 0;  // used, a whole number of words
    std::size_t tags = 0;   // written
  };

  // Decodes until fewer than word_bytes are left, or less room than most_tags_a_word. A record may
  // go on in the next call.
  Progress decode(std::span<const std::byte> bytes, std::span<Tag> out);

  // Words may be missing here: the record that was begun is dropped. The loss begins, if none is
  // open: returns its tag.
  std::optional<Tag> cut();
  // The count may have wrapped unseen before the next record: if records are missing before it, its
  // time does not follow from those before.
  void doubt_count() { doubts_count_ = true; }

  // Time of the latest record; absent before the first.
  [[nodiscard]] std::optional<std::int64_t> reached_ps() const { return reached_ps_; }
  [[nodiscard]] std::uint64_t records() const { return records_; }
  [[nodiscard]] const TtmFaults& faults() const { return faults_; }

 private:
  static constexpr unsigned lost = 1;  // expected_ until a record ends

  struct Hit {
    std::uint8_t input = 0, code = 0;
  };

  void begin_record();
  Tag* take(unsigned word, Tag* out);
  bool take_part(unsigned what, unsigned word);
  Tag* break_off(Tag* out);
  Tag* finish(Tag* out);
  Tag* go_to(std::uint32_t count, Tag* out);
  Tag* begin_loss(Tag* out);
  [[nodiscard]] int risen_markers();

  // The record that is being read.
  std::array<Hit, inputs> hits_{};
  std::size_t hit_count_ = 0;
  int next_input_ = 0;        // the least that may come
  unsigned expected_ = lost;  // 0: inputs or 123; 124 to 127: that
  std::uint32_t count_ = 0;
  std::array<bool, 3> levels_{};  // pixel rose, frame, line
  bool is_dropping_ = false;
  std::optional<std::uint8_t> laser_;

  std::array<TtmFine, inputs> fine_;
  TtmFine fine_laser_;
  std::optional<std::int64_t> reached_ps_;
  std::uint32_t latest_count_ = 0;
  std::int64_t since_origin_ = 0;  // the same, in periods since the tags' time 0
  std::array<bool, 3> before_{};   // levels_ of the record before
  bool was_dropping_ = false;
  bool doubts_count_ = false;
  bool loss_open_ = false;
  std::uint64_t records_ = 0;
  TtmFaults faults_;
};

}  // namespace splid::usb
