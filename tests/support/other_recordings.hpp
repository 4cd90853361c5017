#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// Recordings of other formats than PTU, made byte by byte as their descriptions have them.

namespace splid::test {

inline void append_little_endian(std::string& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) {
    bytes += static_cast<char>(value & 0xFFU);
    value >>= 8U;
  }
}

struct QutagEvent {
  std::int64_t time_ps;
  std::int16_t channel;
};

inline std::string qutag_recording(const std::vector<QutagEvent>& events) {
  std::string bytes(40, '\x11');
  for (const QutagEvent& event : events) {
    append_little_endian(bytes, static_cast<std::uint64_t>(event.time_ps), 8);
    append_little_endian(bytes, static_cast<std::uint16_t>(event.channel), 2);
  }
  return bytes;
}

// Fields of a header at their places.
class OldHeader {
 public:
  explicit OldHeader(std::size_t bytes) : bytes_(bytes, '\0') {}

  OldHeader& text(std::size_t at, std::string_view value) {
    bytes_.replace(at, value.size(), value);
    return *this;
  }
  OldHeader& integer(std::size_t at, std::uint64_t value, int bytes = 4) {
    std::string text;
    append_little_endian(text, value, bytes);
    return this->text(at, text);
  }
  [[nodiscard]] std::string with(const std::vector<std::uint32_t>& records) const {
    std::string all = bytes_;
    for (const std::uint32_t record : records) append_little_endian(all, record, 4);
    return all;
  }

 private:
  std::string bytes_;
};

// Of a PicoHarp 300, format version 2.0; mode 2: .pt2, 3: .pt3 with 100 kHz. step_ps: 0 for the
// usual steps, of 4 ps in .pt2 and 8 ps in .pt3.
inline std::string pico_harp_recording(int mode, const std::vector<std::uint32_t>& records,
                                       int image_words = 0, float step_ps = 0) {
  if (step_ps == 0) step_ps = mode == 2 ? 4 : 8;
  OldHeader header(728 + 4 * static_cast<std::size_t>(image_words));
  header.text(0, "PicoHarp 300").text(16, "2.0").text(22, "PicoHarp Software");
  header.text(52, "23/11/26 10:11:12").text(72, "a comment").integer(332, 32);
  header.integer(348, static_cast<std::uint32_t>(mode)).integer(364, 1500).integer(564, 4);
  header.integer(584, std::bit_cast<std::uint32_t>(step_ps / 1000)).integer(704, 100'000);
  header.integer(720, records.size()).integer(724, static_cast<std::uint32_t>(image_words));
  return header.with(records);
}

// Of a HydraHarp 400 with two inputs; version: "1.0" or "2.0"; mode 2: .ht2, 3: .ht3. step_ps: 0
// for the usual steps, of 1 ps in .ht2 and 16 ps in .ht3.
inline std::string hydra_harp_recording(int mode, std::string_view version,
                                        const std::vector<std::uint32_t>& records,
                                        double step_ps = 0, std::uint64_t rate_hz = 200'000) {
  if (step_ps == 0) step_ps = mode == 2 ? 1 : 16;
  constexpr std::size_t rate_at = 696 + 2 * 20;
  OldHeader header(rate_at + 24);
  header.text(0, "HydraHarp 400").text(16, version).text(22, "HydraHarp Software");
  header.text(52, "23/11/26 10:11:12").integer(332, 32);
  header.integer(340, static_cast<std::uint32_t>(mode)).integer(664, 2).integer(680, 1);
  header.integer(352, std::bit_cast<std::uint64_t>(step_ps), 8).integer(rate_at, rate_hz);
  header.integer(rate_at + 16, records.size(), 8);
  return header.with(records);
}

// A Becker & Hickl FIFO file. macro_units: 0.1 ns a sync.
inline std::string spc_recording(std::uint32_t macro_units,
                                 const std::vector<std::uint32_t>& records) {
  return OldHeader(4).integer(0, 1U << 31U | macro_units).with(records);
}
constexpr std::uint32_t spc_photon(std::uint32_t macro, std::uint32_t adc, std::uint32_t route) {
  return adc << 16U | route << 12U | macro;
}
constexpr std::uint32_t spc_invalid = 1U << 31U;
constexpr std::uint32_t spc_overflow = 1U << 30U;
constexpr std::uint32_t spc_gap = 1U << 29U;
constexpr std::uint32_t spc_marker = 1U << 28U;

// A settings file with steps of 8 ps: 65.536 ns of range, gain 2.
inline constexpr std::string_view spc_settings =
    "*SETUP\n  SYS_PARA_BEGIN:\n  #SP [SP_TAC_R,F,6.5536e-08]\n  #SP [SP_TAC_G,I,2]\n"
    "  SYS_PARA_END:\n*END\n";

}  // namespace splid::test
