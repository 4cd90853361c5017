#pragma once

#include <array>
#include <string_view>
#include <utility>

namespace splid {

// The unit that a key's name ends in, as people write it: "ps" of "sigma_ps"; empty where the name
// has none.
constexpr std::string_view unit_of_key(std::string_view key) {
  // The longest ending first.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 22> units = {{
      {"_ppm_per_s", "ppm/s"},
      {"_per_pulse", "counts a pulse"},
      {"_deg_per_s", "degrees/s"},
      {"_per_s", "counts/s"},
      {"_mps", "m/s"},
      {"_mps2", "m/s²"},
      {"_ppm", "ppm"},
      {"_turns", "turns"},
      {"seconds", "s"},
      {"_tags", "tags"},
      {"_deg", "degrees"},
      {"_hz", "Hz"},
      {"_ps", "ps"},
      {"_ns", "ns"},
      {"_ms", "ms"},
      {"_s", "s"},
      {"_m", "m"},
      {"_v", "V"},
      {"_mv", "mV"},
      {"_kib", "KiB"},
      {"_mib", "MiB"},
      {"_gib", "GiB"},
  }};
  for (const auto& [ending, unit] : units) {
    if (key.ends_with(ending)) return unit;
  }
  return {};
}

}  // namespace splid
