#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "daemon/stream/device_clock.hpp"
#include "protocol/ptu_encode.hpp"
#include "protocol/ptu_header.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Writes a PTU recording from a stream of tags. Any reader can read the file at any moment, also
// after a kill -9: its header is there from the start and is written over in place when the first
// tag tells the origin of device time, when losses change and at the end; its record count follows
// each block of records, and never counts one that is not there.
//
// Threads: one. Errors: Error(Fault::usage) where the file exists and may not be overwritten, or is
// none; Error(Fault::device) with the file, the bytes written and the errno text when it cannot be
// written; what was written stays readable. A file that was there is as it was where the recording
// cannot be begun for want of room, and is never removed.
class PtuWriter {
 public:
  // facts: instrument, release, pattern and configuration; the rest is filled in here.
  PtuWriter(std::string file, PtuFacts facts, const DeviceClock& clock, bool overwrite);
  // Leaves the file as it was after the last flush where close() was not called.
  ~PtuWriter();
  PtuWriter(const PtuWriter&) = delete;
  PtuWriter& operator=(const PtuWriter&) = delete;

  // Keeps them in memory until there is a block to write, or flush().
  void write(std::span<const Tag> tags);
  // Hands all but the last microsecond of tags to the system. To be called at least twice a second.
  void flush();
  // Writes what is left, and the header with its count and losses. Once, and nothing after it.
  void close();
  // Instead of close() where writing failed: ends the file with what it has, says so in its header
  // if the disk lets it, and returns how many tags given to write() are not in it and not among its
  // losses. Errors: none.
  std::uint64_t give_up();

  // In the file, or to be.
  [[nodiscard]] std::uint64_t bytes() const { return pending_at_ + pending_.size(); }
  [[nodiscard]] std::uint64_t records() const { return encoder_.records(); }
  // As the header has them.
  [[nodiscard]] const std::vector<Loss>& losses() const { return facts_.losses; }
  // In the file by now, overflows included.
  [[nodiscard]] std::uint64_t written_records() const;
  // Tags that no record can hold: see PtuEncoder. Part of lost_tags().
  [[nodiscard]] std::uint64_t rejected() const { return encoder_.rejected(); }
  [[nodiscard]] std::uint64_t lost_tags() const { return encoder_.losses().lost_tags(); }

 private:
  bool open(bool overwrite);
  [[nodiscard]] int open_existing(int how) const;
  void begin_file(bool is_new);
  void begin(std::int64_t first_tag_ps);
  void write_pending();
  void write_header();
  void write_header_part(std::size_t begin, std::size_t end);
  // Of this file, for an error. bytes: written so far.
  [[nodiscard]] std::string what_is_there(std::uint64_t bytes) const;
  void write_at(std::span<const std::byte> bytes, std::uint64_t& offset);

  std::string file_;
  PtuFacts facts_;
  DeviceClock clock_;
  int descriptor_ = -1;
  PtuEncoder encoder_{0};
  bool begun_ = false;
  std::vector<std::byte> pending_;
  std::vector<std::byte> header_;    // as it is in the file
  std::uint64_t pending_at_ = 0;     // place in the file of the first byte in pending_
  std::uint64_t written_bytes_ = 0;  // header included; past pending_at_ after a failed write alone
};

}  // namespace splid
