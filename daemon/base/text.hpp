#pragma once

#include <cstdint>
#include <string>

#include "protocol/pattern.hpp"

namespace splid::awg {
struct Uploaded;
}  // namespace splid::awg

namespace splid {

// Sentences and numbers for people, which no program reads.

// A number with its thousands separated: 1,234,567.
std::string grouped(std::uint64_t number);

// Adds a sentence, if it is not empty, behind those that a text has: "one; another".
void add_sentence(std::string& text, const std::string& sentence);

// A pattern in a few words:
// "interleaved, 40 pulses in 3780 ns, unambiguous to 566.613 m, closest pulses 9 ns apart".
std::string describe_pattern(const Pattern& pattern);

// What an upload has reached: "MAKER,MODEL,...: plays interleaved, ...; its error queue is empty".
std::string in_words(const awg::Uploaded& uploaded);

}  // namespace splid
