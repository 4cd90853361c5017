#include "drivers/picoquant/family.hpp"

#include <cstddef>

namespace splid::picoquant {
namespace {

using Meaning = Flag::Meaning;

constexpr const char* full_words = "its FIFO was full: more events than USB and this machine take";
constexpr const char* dropped_words = "its inputs drop counts: lower the rate";
constexpr const char* reference_words = "it has lost its reference clock: look at the 10 MHz cable";
constexpr const char* hardware_words =
    "it reports a hardware error: switch it off and on, and ask PicoQuant if that does not help";

constexpr std::array multiharp_flags = {
    Flag{0x0002, Meaning::fifo_full, full_words},
    Flag{0x0040, Meaning::counts_dropped, dropped_words},
    Flag{0x0008, Meaning::caution, reference_words},
    Flag{0x0010, Meaning::caution, hardware_words},
};
constexpr std::array hydraharp_flags = {
    Flag{0x0002, Meaning::fifo_full, full_words},
    Flag{0x0008, Meaning::caution, reference_words},
    Flag{0x0010, Meaning::caution, hardware_words},
};
constexpr std::array timeharp_flags = {
    Flag{0x0002, Meaning::fifo_full, full_words},
    Flag{0x0008, Meaning::counts_dropped, dropped_words},
    Flag{0x0030, Meaning::caution, hardware_words},
};
constexpr std::array picoharp_flags = {
    Flag{0x0003, Meaning::fifo_full, full_words},
    Flag{0x0100, Meaning::caution, hardware_words},
};

constexpr int multiharp_read = 1'048'576;
constexpr int other_read = 131'072;

constexpr std::array<FamilyTraits, 4> all_traits = {{
    {"MultiHarp",
     "MH_",
     {"libmhlib.so", "libmh150.so"},
     {"3.1", "4."},
     "3.1 or 4.x",
     RecordType::generic,
     multiharp_read,
     16,
     Trigger::edge,
     0,
     0,
     true,
     false,
     multiharp_flags},
    {"HydraHarp 400",
     "HH_",
     {"libhhlib.so", "libhh400.so"},
     {"3.", "3."},
     "3.x",
     RecordType::hydra_harp_v2,
     other_read,
     16,
     Trigger::constant_fraction,
     -1000,
     40,
     true,
     true,
     hydraharp_flags},
    {"TimeHarp 260",
     "TH260_",
     {"libth260lib.so", "libth260.so"},
     {"3.", "3."},
     "3.x",
     RecordType::time_harp_260_pico,
     other_read,
     8,
     Trigger::by_model,
     -1200,
     40,
     false,
     false,
     timeharp_flags},
    {"PicoHarp 300",
     "PH_",
     {"libph300.so", "libphlib.so"},
     {"3.", "3."},
     "3.x",
     RecordType::pico_harp,
     other_read,
     8,
     Trigger::constant_fraction,
     -800,
     20,
     false,
     true,
     picoharp_flags},
}};

}  // namespace

const FamilyTraits& traits_of(Family family) {
  return all_traits.at(static_cast<std::size_t>(family));
}

}  // namespace splid::picoquant
