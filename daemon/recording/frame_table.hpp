#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "daemon/recording/table_head.hpp"
#include "protocol/frame_json.hpp"

namespace splid::recording {

// Writes frames into a table, as HDF5 or as comma-separated text. The file can be read at any
// moment, also after a kill -9, with all frames up to the last flush(). No reader is locked out.
// Beside a table of text its facts stand in a file FILE.facts.json, since text has no room for
// them.
//
// Threads: one. Errors: Error(Fault::usage) where the file exists and may not be overwritten, or is
// no regular file; Error(Fault::device) with the file and the errno text when writing fails, after
// which the rows already written stay readable and the rest is still to be written.
class FrameTable {
 public:
  // Makes the table, without rows yet. The format is that of the file's name.
  FrameTable(std::string file, TableFacts facts, bool overwrite);
  // Leaves the file as the last flush() left it.
  ~FrameTable();
  FrameTable(const FrameTable&) = delete;
  FrameTable& operator=(const FrameTable&) = delete;

  // Keeps the frame in memory until flush().
  void add(const FrameMessage& frame);
  // Keeps rows in memory, as append_frame_row() writes them. Only for a table in HDF5.
  void add_rows(std::string_view rows);
  // Hands all frames to the operating system. To be called at least twice a second.
  void flush();
  // Drops the frames that were not written yet; returns how many these are. Errors: none.
  std::uint64_t give_up();
  // The SHA-256 of the recording, in hexadecimal digits.
  void write_checksum(const std::string& sha256);

  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] std::uint64_t rows() const { return rows_; }  // written so far

 private:
  void check_place(bool overwrite) const;
  void say_rows(std::uint64_t rows) const;
  void reserve(std::uint64_t bytes);
  void write_facts(const std::string& sha256) const;
  void write_at(const std::string& bytes, std::uint64_t offset) const;

  std::string file_;
  TableFormat format_;
  TableFacts facts_;
  TableHead head_;
  int descriptor_ = -1;
  std::string pending_;  // rows that are not written yet
  std::uint64_t pending_rows_ = 0;
  std::uint64_t end_ = 0;       // where the next row is written
  std::uint64_t reserved_ = 0;  // size of the file, zeros at its end included
  std::uint64_t rows_ = 0;
};

}  // namespace splid::recording
