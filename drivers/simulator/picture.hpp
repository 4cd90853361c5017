#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace splid::simulator {

struct Picture {
  std::size_t columns = 0;
  std::size_t rows = 0;
  std::vector<std::uint16_t> values;  // row by row, the top row first
};

// Reads a grey picture in Netpbm's format PGM, as text (P2) or bytes (P5), of at most 65,535 grey
// levels and 4,096 points either way.
//
// Errors: Error(Fault::usage) naming the file.
Picture read_pgm(const std::string& file);

}  // namespace splid::simulator
