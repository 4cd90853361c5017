#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

// Counts what comes from an instrument, for people who connect it for the first time.
//
// Threads: one. Errors: none.
class TagCensus {
 public:
  // Of the tags of one channel.
  struct Channel {
    std::uint64_t tags = 0;
    // Where at least nine of ten gaps are equal to within a hundredth: the mean of these gaps. An
    // instrument's own syncs may come beside photons alone: at least nine of ten gaps are then
    // whole numbers of periods, to within an eighth of one.
    std::optional<double> period_ps;
  };

  void count(std::span<const Tag> tags);

  // By the names that a configuration takes: an input's number, "sync", or "marker:N", where N are
  // the bits.
  [[nodiscard]] std::map<std::string, Channel> channels() const;
  // The channel of the pattern's syncs: "sync", or else the regular input of the longest period;
  // empty where there is none.
  [[nodiscard]] std::string sync() const;
  // The inputs that have tags, without that of the syncs.
  [[nodiscard]] std::vector<std::string> photons() const;
  [[nodiscard]] std::uint64_t losses() const { return losses_; }
  // Known to be missing.
  [[nodiscard]] std::uint64_t lost_tags() const { return lost_tags_; }

 private:
  struct Times {
    std::uint64_t tags = 0;
    std::vector<std::int64_t> first_ps;  // as many as tell whether they are regular
  };

  std::map<std::pair<TagKind, std::int32_t>, Times> times_;
  std::uint64_t losses_ = 0;
  std::uint64_t lost_tags_ = 0;
};

}  // namespace splid
