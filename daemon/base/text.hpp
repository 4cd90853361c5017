#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"
#include "protocol/pattern.hpp"

namespace splid::awg {
struct Uploaded;
}  // namespace splid::awg

namespace splid {

// Sentences and numbers for people, which no program reads.

// A number with its thousands separated: 1,234,567.
std::string grouped(std::uint64_t number);

// A time on the clock of this machine's time zone: "14:03:27.250". unix_s: UTC, seconds since 1970.
std::string clock_time(double unix_s);

// Adds a sentence, if it is not empty, behind those that a text has: "one; another".
void add_sentence(std::string& text, const std::string& sentence);

// A finding in a few words: "acceleration -12.3 +- 0.8 m/s2".
std::string in_words(const FrameMessage::Finding& finding);
// The same with what to do: "acceleration -12.3 +- 0.8 m/s2: Set scene.motion to ...".
std::string with_advice(const FrameMessage::Finding& finding);
// Several in a few words, separated by commas.
std::string in_words(const std::vector<FrameMessage::Finding>& findings);

// A pattern in a few words:
// "interleaved, 40 pulses in 3780 ns, unambiguous to 566.613 m, closest pulses 9 ns apart".
std::string describe_pattern(const Pattern& pattern);

// What an upload has reached: "MAKER,MODEL,...: plays interleaved, ...; its error queue is empty".
std::string in_words(const awg::Uploaded& uploaded);

}  // namespace splid
