#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "config/daemon_options.hpp"

namespace splid::recording {

// What stands beside the frames in a table.
struct TableFacts {
  std::string program;       // name and version
  std::string config_json;   // as config_to_json() writes it
  std::string pattern_json;  // as to_json() writes it
  std::string recording;     // the recording's path as it was given; empty: none
};

enum class TableFormat { hdf5, csv };

// The format that a file's name asks for, by its ending .h5 or .csv. asked_by: the option, for the
// error. Errors: Error(Fault::usage) for any other ending.
TableFormat table_format_of(const std::string& file, const std::string& asked_by);

// The table of the frames of a recording, which stands beside it. tables: not off.
std::string table_beside(const std::string& recording, RecordFrames tables);
// The file with the facts beside a table of text.
std::string facts_file_of(const std::string& table);
// All files that tables beside a recording may be made of, whether they are there or not.
std::array<std::string, 3> table_files_beside(const std::string& recording);

// The first bytes of a table: all that stands before its first row. Rows follow without gaps.
//
// Design note: while frames come, nothing may be half true in the file, since the program may be
// killed between any two system calls, and a reader may open the file at any moment. HDF5's own
// growing tables do not promise that: their indices are spread over the file, and in the mode that
// does promise it (SWMR) a killed writer leaves a mark that keeps readers out. So the HDF5 library
// makes the head of a file with a table of fixed size, in memory, and only the few numbers that
// depend on the number of rows are written anew after each block of rows. The library says which
// these are: heads for one row and for two rows differ in nothing else.
struct TableHead {
  // An unsigned 64-bit number, little endian, that is begin + per_row * rows.
  struct Field {
    std::size_t at = 0;  // byte in the head
    std::uint64_t begin = 0;
    std::uint64_t per_row = 0;
    bool none_without_rows = false;  // then all its bits are set where there are no rows
    [[nodiscard]] std::uint64_t value(std::uint64_t rows) const {
      return none_without_rows && rows == 0 ? ~std::uint64_t{0} : begin + per_row * rows;
    }
  };
  std::string bytes;  // of a table without rows
  // The fields that make room come first, and the number of rows comes after them, so that a table
  // that is left between two fields has too much room, which every reader takes, and never too
  // little. The last field is the place of the rows.
  //
  // Design note: HDF5 1.14 refuses a table that has a place and no rows, and makes rows up for a
  // table that has rows and no place. So the first rows come with all fields but the first in one
  // piece, which a killed writer has written whole or not at all.
  std::vector<Field> fields;
  struct Piece {
    std::size_t at = 0;
    std::string bytes;
  };
  // The head from the first to the last of the fields after the first, with so many rows.
  [[nodiscard]] Piece of_rows(std::uint64_t rows) const;
  // Where the recording's SHA-256 is to be written, checksum_bytes hexadecimal digits; 0: nowhere.
  std::size_t checksum_at = 0;
  static constexpr std::size_t checksum_bytes = 64;
};

// An HDF5 file with the table `frames`, whose columns are frame_columns() with their units as the
// attribute `units`, and the facts beside it (docs/reference/tables.md).
//
// Threads: any, one at a time. Errors: std::runtime_error where the library fails, which only a
// lack of memory can bring about.
TableHead make_hdf5_head(const TableFacts& facts);

// A line with the columns' names.
TableHead make_csv_head();

}  // namespace splid::recording
