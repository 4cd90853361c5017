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

namespace splid::recording {

// Writes a PTU recording from a stream of tags. Any reader can read the file at any moment, also
// after a kill -9. The header is there from the start and is written over in place when the first
// tag tells the origin of device time, when losses change and at the end. The header's record count
// is updated after each block of records and never counts a record that is not there.
//
// Threads: one. Errors: Error(Fault::usage) where the file exists and may not be overwritten, or is
// a folder, a disk, a pipe or a socket; Error(Fault::device) with the file, the bytes written and
// the errno text when writing fails, after which the part already written stays readable. Where the
// disk has no room to begin the recording, a file that was there before stays unchanged; such a
// file is never removed.
class PtuWriter {
 public:
  // facts: instrument, release, pattern and configuration; the writer fills in the rest.
  PtuWriter(std::string file, PtuFacts facts, const DeviceClock& clock, bool overwrite);
  // Where close() was not called, leaves the file as the last flush() left it.
  ~PtuWriter();
  PtuWriter(const PtuWriter&) = delete;
  PtuWriter& operator=(const PtuWriter&) = delete;

  // Keeps the tags in memory until they fill a block or flush() is called.
  void write(std::span<const Tag> tags);
  // Hands all tags but those of the last microsecond to the operating system. To be called at least
  // twice a second.
  void flush();
  // Writes the tags that are left, and the header with the final count and the losses. To be called
  // once, and nothing after it.
  void close();
  // To be called instead of close() after writing failed: ends the file after the records that it
  // has and updates its header, if the disk allows that. Returns how many of the tags given to
  // write() are neither in the file nor among its losses: all, where the file was removed. Errors:
  // none.
  std::uint64_t give_up();

  // Whether somebody removed the file; flush() and close() then throw.
  [[nodiscard]] bool removed() const;
  // Size of the file once everything pending is written.
  [[nodiscard]] std::uint64_t bytes() const { return pending_at_ + pending_.size(); }
  [[nodiscard]] std::uint64_t records() const { return encoder_.records(); }
  // The losses that the header lists.
  [[nodiscard]] const std::vector<Loss>& losses() const { return facts_.losses; }
  // Records that are in the file by now, overflow records included.
  [[nodiscard]] std::uint64_t written_records() const;
  // Tags that no record can hold (see PtuEncoder); lost_tags() includes them.
  [[nodiscard]] std::uint64_t rejected() const { return encoder_.rejected(); }
  [[nodiscard]] std::uint64_t lost_tags() const { return encoder_.losses().lost_tags(); }

 private:
  bool make_at_once();
  void make(bool overwrite);
  bool open(bool overwrite);
  [[nodiscard]] int open_existing(int how) const;
  void begin_file(bool is_new);
  void begin(std::int64_t first_tag_ps);
  void check_there() const;
  void write_pending();
  void write_header();
  void write_header_part(std::size_t begin, std::size_t end);
  // How much of the file is there, for an error's sentence. bytes: written so far.
  [[nodiscard]] std::string what_is_there(std::uint64_t bytes) const;
  void write_at(std::span<const std::byte> bytes, std::uint64_t& offset);

  std::string file_;
  PtuFacts facts_;
  DeviceClock clock_;
  int descriptor_ = -1;
  PtuEncoder encoder_{0};
  bool begun_ = false;
  std::vector<std::byte> pending_;
  std::vector<std::byte> header_;  // the header's bytes as they are in the file
  std::uint64_t pending_at_ = 0;   // offset in the file of the first byte in pending_
  std::uint64_t written_bytes_ =
      0;  // header included; beyond pending_at_ only after a failed write
};

}  // namespace splid::recording
