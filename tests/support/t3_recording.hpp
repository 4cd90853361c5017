#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/ptu_header.hpp"
#include "protocol/tag.hpp"

namespace splid::test {

// Records of the HydraHarp's kind. ticks: below 2^15; sync: below 1024.
constexpr std::uint32_t t3_photon(int input, std::uint32_t ticks, std::uint32_t sync) {
  return static_cast<std::uint32_t>(input) << 25U | ticks << 10U | sync;
}
constexpr std::uint32_t t3_marker(int bits, std::uint32_t sync) {
  return 1U << 31U | static_cast<std::uint32_t>(bits) << 25U | sync;
}
constexpr std::uint32_t t3_overflow(std::uint32_t count) { return 1U << 31U | 63U << 25U | count; }

// The records that an instrument in T3 mode would have kept of a stream with all its syncs.
inline std::vector<std::uint32_t> as_t3(const std::vector<Tag>& tags, double resolution_ps) {
  std::vector<std::uint32_t> records;
  std::uint32_t syncs = 0;
  std::int64_t sync_ps = -1;
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::sync) {
      sync_ps = tag.time_ps;
      if (++syncs % 1024 == 0) records.push_back(t3_overflow(1));
    } else if (tag.kind == TagKind::photon && sync_ps >= 0) {
      const auto since_ps = static_cast<double>(tag.time_ps - sync_ps);
      const auto ticks = static_cast<std::uint32_t>(since_ps / resolution_ps);
      records.push_back(t3_photon(tag.value, std::min(ticks, 0x7FFFU), syncs % 1024));
    }
  }
  return records;
}

// Sets the value of a tag that a PTU header has.
template <class Value>
void set_ptu_tag(std::string& bytes, const std::string& name, Value value) {
  std::memcpy(&bytes[bytes.find(name) + 40], &value, sizeof value);
}

// A recording in T3 mode, by splid's header of one in T2 mode with other values.
struct T3Recording {
  RecordType type = RecordType::hydra_harp_v2_t3;
  double sync_period_s = 3.78e-6;
  double resolution_s = 128e-12;
  std::int64_t divider = 1;
  std::vector<std::uint32_t> records;

  [[nodiscard]] std::string bytes() const {
    PtuFacts facts;
    facts.record_count = records.size();
    facts.losses_room_bytes = 128;
    const std::vector<std::byte> header = make_ptu_header(facts);
    std::string all(reinterpret_cast<const char*>(header.data()), header.size());
    set_ptu_tag(all, "Measurement_Mode", std::int64_t{3});
    set_ptu_tag(all, "TTResultFormat_TTTRRecType", static_cast<std::int64_t>(type));
    set_ptu_tag(all, "MeasDesc_GlobalResolution", sync_period_s);
    set_ptu_tag(all, "MeasDesc_Resolution", resolution_s);
    set_ptu_tag(all, "MeasDesc_BinningFactor", divider);
    constexpr std::string_view name{"HWSync_Divider\0\0\0\0\0\0\0\0", 22};
    all.replace(all.find("MeasDesc_BinningFactor"), name.size(), name);
    for (const std::uint32_t record : records) {
      for (unsigned shift = 0; shift < 32; shift += 8) {
        all += static_cast<char>(record >> shift & 0xFFU);
      }
    }
    return all;
  }
};

}  // namespace splid::test
