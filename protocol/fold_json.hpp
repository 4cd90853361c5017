#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_status.hpp"

// The `fold` message: what the photons of one frame look like, for people to look at, and its JSON
// (docs/reference/messages.md). daemon/output/frame_fold.hpp makes the pictures.

namespace splid {

// Pictures of one frame's photons. A picture is absent where the frame does not give it: all of
// them without a lock to the syncs, and all but `period` without a target. Times are in ns of the
// pattern's clock.
struct PhotonFold {
  static constexpr std::size_t stack_bins = 200;
  static constexpr std::size_t period_bins = 1024;
  static constexpr std::size_t plane_cells = 64;  // along each of its two sides

  // The photons about every pulse that they may belong to, laid upon each other.
  struct Stack {
    double first_ns = 0;  // where the first bin begins, from the pulse's time
    double bin_ns = 0;
    std::vector<std::uint64_t> counts;  // stack_bins of them
    std::vector<double> expected;       // counts that the estimate expects there, finite, >= 0
  };
  std::optional<Stack> stack;

  // The whole pattern period, from its start.
  struct Period {
    double bin_ns = 0;
    bool moved_back = false;            // by the target's delay: a photon stands where it left
    std::vector<std::uint64_t> counts;  // period_bins of them
  };
  std::optional<Period> period;

  // The likelihood about the estimate, with its signal and background. Cell i of a side is
  // i - (plane_cells - 1) / 2 steps from the estimate, which is in the middle.
  struct Plane {
    double delay_step_ns = 0;
    double velocity_step_mps = 0;
    std::vector<double> gain_nats;  // over no target; rows of equal velocity, delay runs in a row
  };
  std::optional<Plane> plane;
};

struct FoldMessage {
  double timestamp_s = 0;      // of the frame
  std::uint64_t sequence = 0;  // of the frame
  FrameStatus status = FrameStatus::not_run;
  std::uint64_t photons = 0;  // in the frame
  std::uint64_t folded = 0;   // of them in the pictures; fewer where there are very many
  PhotonFold fold;
  std::string pixel = {};  // whose frame it is; empty where there is one pixel
};

inline constexpr const char* topic_fold = "fold";

// One line of JSON without a line feed. Expected counts have four digits, gains two decimals.
std::string to_json(const FoldMessage& message);

}  // namespace splid
