#pragma once

#include <cstdint>
#include <string>

#include "daemon/stream/framer.hpp"

namespace splid {

// Watches whether a live scan makes frames: whether its markers go on, and its lines have ends.
//
// Threads: one. Errors: none.
class ScanWatch {
 public:
  // What is wrong, in a sentence with what to do; empty where nothing is, and where frames are cut
  // by time. totals: of the stream so far; now_ns: steady clock. A line without an end is told of
  // for 5 s; that no line ends, after 5 s or three times the longest line so far, if that is
  // longer. The counts in the sentence are renewed once a second.
  std::string look(const FramerTotals& totals, std::int64_t now_ns);

 private:
  std::string fault_of(const FramerTotals& totals, std::int64_t now_ns);

  std::string said_;
  std::int64_t said_ns_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t cut_lines_ = 0;
  std::int64_t frames_since_ns_ = 0;  // the last ones came; 0: not looked yet
  std::int64_t longest_ns_ = 0;       // between frames
  std::int64_t cut_until_ns_ = 0;     // a cut line is told of
};

}  // namespace splid
