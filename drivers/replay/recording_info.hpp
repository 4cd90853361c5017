#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/recording_header.hpp"
#include "protocol/tag.hpp"

namespace splid {

// The losses of a recording, summed up.
struct LossSummary {
  std::uint64_t count = 0;
  std::uint64_t known_tags = 0;          // the sum of the known counts
  std::uint64_t uncounted = 0;           // losses whose count nobody knows
  std::optional<std::int64_t> first_ps;  // begin of the earliest, tagger's clock; absent: no losses
  std::optional<std::int64_t> last_ps;   // begin of the latest
  std::int64_t longest_ps = 0;

  void add(const Loss& loss);
};

// What a recording holds.
struct RecordingInfo {
  RecordingHeader header;
  std::uint64_t records = 0;             // records that were read, overflows included
  std::uint64_t overflow_records = 0;    // each may stand for several wraps
  std::uint64_t unknown_records = 0;     // neither photon, sync, marker nor overflow
  std::uint64_t saturated_photons = 0;   // T3: too long after their sync to say when
  std::map<int, std::uint64_t> photons;  // counts by input; none is 0
  std::uint64_t syncs = 0;  // of a T3 recording: those with a photon or marker in their period
  std::array<std::uint64_t, 16> markers{};  // counts by marker bits
  std::optional<std::int64_t> first_ps;     // earliest tag, tagger's clock; absent: no tags
  std::optional<std::int64_t> last_ps;      // latest tag
  std::uint64_t steps_back = 0;             // tags earlier than the tag before them
  std::uint64_t far_steps_back = 0;         // steps back by more than 1 us
  std::int64_t longest_step_back_ps = 0;    // 0: no tag steps back
  LossSummary losses;                       // that the header lists, and that the records tell of
  bool whole = false;                       // read to the end, not only to max_tags
  std::vector<std::string> warnings;        // sentences for people

  [[nodiscard]] std::uint64_t tags() const;
};

// Is called with the tags of a recording as they are read, in the file's order.
using SeeTags = std::function<void(std::span<const Tag>)>;

// Reads a recording up to its end, or to the first block that reaches max_tags (0: no limit). see:
// may be empty.
//
// Threads: any. Errors: as RecordingReader.
RecordingInfo scan_recording(const std::string& file, std::uint64_t max_tags = 0,
                             const SeeTags& see = {});

// What a T3 recording cannot say, or says less well than the frames made of it will have it, in
// sentences for people: divided syncs, times since a sync that do not fit a record, steps of these
// times that are coarser than a pulse, photons lost by it, and another period than the pattern's.
// No sentences for a recording in T2 mode. period_ps: of the pattern; pulse_sigma_ps: of its
// pulses.
std::vector<std::string> doubts_of_t3(const RecordingInfo& info, double period_ps,
                                      double pulse_sigma_ps);

// Why pulses of this width cannot be in a recording, the rest of a sentence that begins with the
// width: the steps of its times alone spread them more. Absent where they can.
std::optional<std::string> width_fault(const RecordingHeader& header, double pulse_sigma_ps);

// Which channels have tags, in words: "input 1, input 2 and sync"; "no tags" where no channel has
// any.
std::string channels_in_words(const RecordingInfo& info);

}  // namespace splid
