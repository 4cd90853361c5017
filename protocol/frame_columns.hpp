#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"

namespace splid {

// The `frame` message as one row of a table: which columns there are, and a row's bytes and text.
// Each member of the message is a column, and a member of an object in it has the object's name
// before its own: std.distance_m is the column std_distance_m. Only schema and v, which are the
// same for all frames, have no column.

enum class ColumnType {
  number,   // double; NaN where the message has no value
  integer,  // 64-bit signed; -1 where the message has no value
  flag,     // one byte, 0 or 1
  text,     // ASCII, filled up with zeros; empty where the message has no value
};

struct FrameColumn {
  std::string name;
  std::string unit;  // empty: none
  ColumnType type = ColumnType::number;
  std::size_t offset = 0;  // of its first byte in a row
  std::size_t bytes = 0;
};

// The columns in the order of a row, without gaps between them.
const std::vector<FrameColumn>& frame_columns();
std::size_t frame_row_bytes();

// Appends the row of a message in the machine's byte order. A number that is not finite counts as
// no value, as in the JSON.
//
// Threads: any. Errors: none.
void append_frame_row(const FrameMessage& message, std::string& rows);

// The columns' names, and a message's values, as a line of comma-separated text with its line feed.
// A value is written as in the JSON, without the quotes of a string; no value is no text.
std::string frame_csv_head();
std::string frame_csv_row(const FrameMessage& message);

}  // namespace splid
