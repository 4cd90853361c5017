#include "drivers/awg/awg_model.hpp"

#include <array>

namespace splid::awg {
namespace {

// Design note: outputs are off from the first command on. The manuals do not say what an output
// shows while its levels change, and less than that fires a laser.
constexpr std::array<Step, 2> stop_all = {{{":ABOR"}, {":OUTP1 OFF"}}};
// In the marker mode the marker has an output of its own. In other modes there may be no channel 3.
constexpr std::array<Step, 3> stop_marker_too = {{{":ABOR"}, {":OUTP1 OFF"}, {":OUTP3 OFF"}}};

// Sources: M8195A Revision 2 User's Guide, chapters 1.5 (memory), 5 (markers), 6 (commands). In the
// marker mode channel 1 has the samples and channel 3 shows marker 1.
constexpr std::array<Step, 2> internal_memory = {{{":INST:DACM MARK"}, {":TRAC1:MMOD INT"}}};
constexpr std::array<Step, 3> extended_memory = {
    {{":INST:DACM MARK"}, {":TRAC1:MMOD EXT"}, {":INST:MEM:EXT:RDIV DIV1"}}};

constexpr std::array<Step, 8> prepare_m8195a = {{
    {":FREQ:RAST {rate}"},
    {":ROSC:SOUR {reference}"},
    {":VOLT1 {amplitude}", ":VOLT1?"},
    {":VOLT1:OFFS {offset}", ":VOLT1:OFFS?"},
    {":VOLT3 {marker}", ":VOLT3?"},
    {":VOLT3:OFFS {half_marker}", ":VOLT3:OFFS?"},
    {":TRAC1:DEL:ALL"},
    {":TRAC1:DEF 1,{samples}", ":TRAC1:CAT?"},
}};

constexpr std::array<Step, 7> play_m8195a = {{
    {":TRAC1:SEL 1", ":TRAC1:SEL?"},
    {":FUNC:MODE ARB"},
    {":INIT:CONT:STAT ON"},
    {":INIT:GATE:STAT OFF"},
    {":OUTP3 ON"},
    {":OUTP1 ON"},
    {":INIT:IMM"},
}};

// Source: M8190A User's Guide, chapters 6 (markers) and 8 (commands). Rate and width go in one
// line: either alone may be out of the range that the old value of the other leaves.
constexpr std::array<Step, 1> precision = {{{":FREQ:RAST {rate};:TRAC1:DWID WPR"}}};

constexpr std::array<Step, 8> prepare_m8190a = {{
    {":ROSC:SOUR {reference}"},
    {":OUTP1:ROUT DC"},
    {":VOLT1:AMPL {amplitude}", ":VOLT1:AMPL?"},
    {":VOLT1:OFFS {offset}", ":VOLT1:OFFS?"},
    {":MARK1:SAMP:VOLT:AMPL {marker}", ":MARK1:SAMP:VOLT:AMPL?"},
    {":MARK1:SAMP:VOLT:OFFS {half_marker}", ":MARK1:SAMP:VOLT:OFFS?"},
    {":TRAC1:DEL:ALL"},
    {":TRAC1:DEF 1,{samples}", ":TRAC1:CAT?"},
}};

constexpr std::array<Step, 6> play_m8190a = {{
    {":TRAC1:SEL 1", ":TRAC1:SEL?"},
    {":FUNC1:MODE ARB"},
    {":INIT:CONT1 ON"},
    {":INIT:GATE1 OFF"},
    {":OUTP1 ON"},
    {":INIT:IMM1"},
}};

// Design note: an M8190A has 128 Mi samples without its memory option; an M8195A's extended memory
// has more. But at 54 GSa/s even 128 Mi samples last 2.5 ms, and their 256 MiB take minutes to
// send.
constexpr std::int64_t large_memory_samples = 134'217'728;

constexpr Model m8195a(const char* name, std::span<const Step> mode, std::int64_t granule_samples,
                       std::int64_t max_samples) {
  return {.name = name,
          .identity = "M8195A",
          .min_rate_hz = 53.76e9,
          .max_rate_hz = 65e9,
          .granule_samples = granule_samples,
          .min_samples = 1'280,
          .max_samples = max_samples,
          .marker_gap_samples = 128,
          .min_amplitude_v = 0.075,
          .max_amplitude_v = 1,
          .min_marker_v = 0.1,
          .max_marker_v = 1,
          .format = SampleFormat::byte_pair,
          .stop = stop_all,
          .undo = stop_marker_too,
          .mode = mode,
          .prepare = prepare_m8195a,
          .play = play_m8195a};
}

constexpr std::array<Model, 3> known_models = {{
    m8195a("m8195a", internal_memory, 128, 262'144),
    m8195a("m8195a_extended", extended_memory, 256, large_memory_samples),
    {.name = "m8190a",
     .identity = "M8190A",
     .min_rate_hz = 125e6,
     .max_rate_hz = 8e9,
     .granule_samples = 48,
     .min_samples = 240,
     .max_samples = large_memory_samples,
     .marker_gap_samples = 96,
     .min_amplitude_v = 0.15,
     .max_amplitude_v = 1,
     .min_marker_v = 0.5,
     .max_marker_v = 1.75,
     .format = SampleFormat::word_14,
     .stop = stop_all,
     .undo = stop_all,
     .mode = precision,
     .prepare = prepare_m8190a,
     .play = play_m8190a},
}};

}  // namespace

std::span<const Model> models() { return known_models; }

}  // namespace splid::awg
