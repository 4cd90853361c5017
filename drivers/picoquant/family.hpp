#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/recording_header.hpp"

namespace splid::picoquant {

// Instruments that one library of PicoQuant's reads. Sources of the facts: the makers' public
// demonstration programs (github.com/PicoQuant: MH150-Demos, HH400-v3.x-Demos) and manuals.
enum class Family : std::uint8_t { multiharp, hydraharp, timeharp260, picoharp300 };

inline constexpr std::array<const char*, 4> family_names = {"multiharp", "hydraharp", "timeharp260",
                                                            "picoharp300"};

// How an input finds a pulse.
enum class Trigger : std::uint8_t {
  edge,               // a threshold and an edge
  constant_fraction,  // a discriminator: a threshold, and a zero crossing
  by_model,           // either, as GetHardwareInfo tells
};

// What one bit of GetFlags says.
struct Flag {
  enum class Meaning : std::uint8_t {
    fifo_full,       // what came is lost from here on; the measurement has to be started anew
    counts_dropped,  // counts are missing, and the measurement goes on
    caution,         // nothing is missing
  };
  int bits;  // any of them
  Meaning meaning;
  const char* words;
};

struct FamilyTraits {
  const char* product;               // for people
  const char* prefix;                // of the library's functions
  std::array<const char*, 2> files;  // the library's names
  // How the versions of the library begin whose functions are known here, and the same for people.
  std::array<std::string_view, 2> version_beginnings;
  const char* versions;
  RecordType record_type;  // of T2
  int read_records;        // most that a call of ReadFiFo gives
  int max_divider;         // of the sync
  Trigger trigger;
  int lowest_level_mv;  // of a constant fraction discriminator
  int highest_zero_cross_mv;
  bool has_reference;    // Initialize takes the source of the clock
  bool has_calibration;  // Initialize is to be followed by Calibrate
  std::span<const Flag> flags;
};

const FamilyTraits& traits_of(Family family);

}  // namespace splid::picoquant
