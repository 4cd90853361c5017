#pragma once

#include <cstdint>
#include <string>

#include "protocol/pattern.hpp"

namespace splid {

// Words and numbers for people; nothing here is read by a program.

// With thousands separated: 1,234,567.
std::string grouped(std::uint64_t number);

// "interleaved, 40 pulses in 3780 ns, unambiguous to 566.613 m, closest pulses 9 ns apart".
std::string describe_pattern(const Pattern& pattern);

}  // namespace splid
