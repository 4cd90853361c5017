#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "protocol/ptu_header.hpp"
#include "tests/support/ptu_bytes.hpp"

namespace splid::test {

// Records of type hydra_harp_v2. ticks: below 2^25.
constexpr std::uint32_t photon_record(int input, std::uint32_t ticks) {
  return (static_cast<std::uint32_t>(input) << 25U) | ticks;
}
constexpr std::uint32_t sync_record(std::uint32_t ticks) { return (1U << 31U) | ticks; }
constexpr std::uint32_t marker_record(int bits, std::uint32_t ticks) {
  return (1U << 31U) | (static_cast<std::uint32_t>(bits) << 25U) | ticks;
}
constexpr std::uint32_t overflow_record(std::uint32_t wraps) {
  return (1U << 31U) | (63U << 25U) | wraps;
}

// The bytes of a recording.
inline std::string recording(const PtuFacts& facts, std::initializer_list<std::uint32_t> records) {
  std::vector<std::byte> bytes = make_ptu_header(facts);
  const std::vector<std::byte> body = record_bytes(records);
  bytes.insert(bytes.end(), body.begin(), body.end());
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline PtuFacts counted(std::uint64_t records) {
  PtuFacts facts;
  facts.record_count = records;
  return facts;
}

}  // namespace splid::test
