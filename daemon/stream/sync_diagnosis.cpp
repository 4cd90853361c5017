#include "daemon/stream/sync_diagnosis.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

// From so many syncs in a frame on there are plenty of them: a frame locks from three syncs that
// agree.
constexpr std::uint64_t plentiful_syncs = 16;

// How the syncs' period relates to the pattern's.
std::string relation(double pattern_ps, double sync_ps) {
  constexpr double whole_enough = 1e-3;
  const double times = pattern_ps > sync_ps ? pattern_ps / sync_ps : sync_ps / pattern_ps;
  const double whole = std::round(times);
  if (whole >= 2 && std::abs(times - whole) < std::min(0.1, whole * whole_enough)) {
    return fmt::format("{} {:g} of them",
                       pattern_ps > sync_ps ? "the pattern takes" : "one sync takes", whole);
  }
  const std::string off = fmt::format("{:.9g} ns", (sync_ps - pattern_ps) * 1e-3);
  const double off_ppm = (sync_ps / pattern_ps - 1) * 1e6;
  // No oscillator is off by a hundredth: such a period is another's.
  if (std::abs(off_ppm) > 1e4) return off + " off";
  return fmt::format("{} or {:.4g} ppm off", off, off_ppm);
}

}  // namespace

std::string in_words(const SyncDiagnosis& diagnosis) {
  if (!diagnosis.sync_period_ps) {
    return fmt::format(
        "{} syncs in {:.4g} ms, but neither the pattern's period of {:.9g} ns nor any other "
        "fits the time between them: check the sync's cable and threshold, and "
        "/channels/sync",
        diagnosis.syncs, diagnosis.frame_ms, diagnosis.pattern_period_ps * 1e-3);
  }
  const double sync_ps = *diagnosis.sync_period_ps;
  return fmt::format(
      "the syncs come at multiples of {:.9g} ns, but the pattern's period is {:.9g} ns ({}): "
      "give the pattern that the generator plays at /pattern/file, or calibrate it",
      sync_ps * 1e-3, diagnosis.pattern_period_ps * 1e-3,
      relation(diagnosis.pattern_period_ps, sync_ps));
}

void check_locked(const LockCounts& counts, const SyncDiagnosis* diagnosis) {
  if (counts.frames == 0 || counts.locked_frames > 0) return;
  if (diagnosis != nullptr) throw Error(Fault::data, in_words(*diagnosis));
  if (counts.syncs >= plentiful_syncs * counts.frames) {
    throw Error(Fault::data, "no frame could lock: there are " + grouped(counts.syncs) +
                                 " syncs, but they do not come at the pattern's period; give "
                                 "pattern.file the pattern that was played");
  }
  log_warning("no frame has enough syncs: {} in {} frames; check channels.sync", counts.syncs,
              counts.frames);
}

}  // namespace splid
