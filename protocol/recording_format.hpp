#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/record_decoder.hpp"
#include "protocol/recording_header.hpp"

namespace splid {

// The recordings that splid reads, of PicoQuant and of others, behind one door: what a file is,
// its header, and the decoder of its records. To add a format, add its kind to RecordingFormat, a
// function that parses its header, a RecordDecoder for its records, and one line in
// recording_format.cpp.

// What a file is, by its first bytes, and by the ending of its name where a format has no mark.
// Absent where it is no recording that splid reads. start: 16 bytes are enough.
//
// Threads: any. Errors: none.
std::optional<RecordingFormat> format_of(std::string_view start, std::string_view name);

// In words, with an article: "a PTU recording".
std::string_view in_words(RecordingFormat format);

// The ending of the file that has a recording's settings beside it, ".set"; empty where the format
// knows none.
std::string_view settings_ending(RecordingFormat format);

// Reads a header from the first bytes of a recording of that format. Absent where the header goes
// on past `prefix`: call it again with more bytes. `complete` says that there are no more, so that
// a cut header is an error. settings: the text of the file beside it, empty where there is none.
//
// Errors: Error(Fault::data) with the byte offset.
std::optional<RecordingHeader> parse_recording_header(RecordingFormat format,
                                                      std::span<const std::byte> prefix,
                                                      bool complete,
                                                      std::string_view settings = {});

// Whether a header of that format has the number of its records.
bool counts_records(RecordingFormat format);

// What splid reads, as the end of a sentence.
inline constexpr std::string_view recordings_in_words =
    "splid reads PTU, .pt2, .pt3, .ht2, .ht3, .qutag and .spc";

// The decoder of a recording's records. period_ps: the pattern period, by which the syncs of T3
// become times; 0: that which the header has.
//
// Errors: Error(Fault::data) for values outside what a decoder takes.
std::unique_ptr<RecordDecoder> make_decoder(const RecordingHeader& header, double period_ps = 0);

// The endings of the names of recordings, by which those of a folder are found: ".ptu" first.
std::span<const std::string_view> recording_endings();

// Whether the name ends as that of a recording.
bool is_named_as_recording(std::string_view name);

}  // namespace splid
