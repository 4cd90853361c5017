#pragma once

#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>

#include "tests/support/program.hpp"

namespace splid::test {

// What a reader finds that believes a PTU's header, as the makers' own do: it reads as many records
// as TTResult_NumberOfRecords counts, and fails where the file has fewer. Shares nothing with the
// product's reader.
struct StrictPtu {
  bool readable = false;
  std::uint64_t counted = 0;  // by the header
  std::uint64_t held = 0;     // whole records in the file
  // Among the records that the header counts:
  std::uint64_t photons = 0;
  std::uint64_t syncs = 0;
  std::uint64_t overflows = 0;
  double created_days = 0;  // since 1899-12-30
};

inline std::uint64_t word_at(const std::string& bytes, std::size_t offset, std::size_t count) {
  std::uint64_t word = 0;
  for (std::size_t i = count; i-- > 0;) {
    word = (word << 8U) | static_cast<unsigned char>(bytes[offset + i]);
  }
  return word;
}

// Reads the header's words; where the records begin, and 0 where the header is not whole.
inline std::size_t read_header(const std::string& bytes, StrictPtu& found) {
  if (bytes.size() < 16 || bytes.compare(0, 6, "PQTTTR") != 0) return 0;
  std::size_t at = 16;
  for (bool is_end = false; !is_end;) {
    if (bytes.size() < at + 48) return 0;
    const std::string name = bytes.substr(at, 32).c_str();
    const std::uint64_t type = word_at(bytes, at + 36, 4);
    const std::uint64_t value = word_at(bytes, at + 40, 8);
    if (name == "TTResult_NumberOfRecords") found.counted = value;
    if (name == "File_CreatingTime") std::memcpy(&found.created_days, &value, sizeof value);
    const bool is_long = type == 0x4001FFFF || type == 0x4002FFFF || type == 0x2001FFFF;
    at += 48 + (is_long ? value : 0);
    is_end = name == "Header_End";
  }
  return at;
}

// How many records the header of a file counts that is still written. Reads its first 1 MiB alone:
// a writer may be faster than who reads to the end of the file, which then never comes.
inline std::uint64_t counted_in_header(const std::string& file) {
  std::string bytes(1U << 20U, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  StrictPtu found;
  return read_header(bytes, found) == 0 ? 0 : found.counted;
}

// The file must not be growing.
inline StrictPtu read_strictly(const std::string& file) {
  StrictPtu found;
  const std::string bytes = file_text(file);
  std::size_t at = read_header(bytes, found);
  if (at == 0) return found;
  if (bytes.size() < at) return found;
  found.held = (bytes.size() - at) / 4;
  if (found.counted > found.held) return found;
  for (std::uint64_t i = 0; i < found.counted; ++i, at += 4) {
    const auto record = static_cast<std::uint32_t>(word_at(bytes, at, 4));
    const bool special = (record >> 31U) == 1;
    const std::uint32_t channel = record >> 25U & 63U;
    found.photons += special ? 0 : 1;
    found.syncs += special && channel == 0 ? 1 : 0;
    found.overflows += special && channel == 63 ? 1 : 0;
  }
  found.readable = true;
  return found;
}

}  // namespace splid::test
