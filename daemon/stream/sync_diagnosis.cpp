#include "daemon/stream/sync_diagnosis.hpp"

#include <cmath>
#include <cstdio>

namespace splid {
namespace {

// How the syncs' period relates to the pattern's.
std::string relation(double pattern_ps, double sync_ps) {
  constexpr double whole_enough = 1e-3;
  char text[200];
  const double times = pattern_ps > sync_ps ? pattern_ps / sync_ps : sync_ps / pattern_ps;
  const double whole = std::round(times);
  if (whole >= 2 && std::abs(times / whole - 1) < whole_enough) {
    std::snprintf(text, sizeof text, "%s %g of them",
                  pattern_ps > sync_ps ? "the pattern takes" : "one sync takes", whole);
  } else {
    std::snprintf(text, sizeof text, "%.6g ns or %.4g ppm off", (sync_ps - pattern_ps) * 1e-3,
                  (sync_ps / pattern_ps - 1) * 1e6);
  }
  return text;
}

}  // namespace

std::string in_words(const SyncDiagnosis& diagnosis) {
  char text[600];
  if (!diagnosis.sync_period_ps) {
    std::snprintf(text, sizeof text,
                  "%zu syncs in %.4g ms, but neither the pattern's period of %.9g ns nor any other "
                  "fits the time between them: check the sync's cable and threshold, and "
                  "/channels/sync",
                  diagnosis.syncs, diagnosis.frame_ms, diagnosis.pattern_period_ps * 1e-3);
    return text;
  }
  const double sync_ps = *diagnosis.sync_period_ps;
  std::snprintf(text, sizeof text,
                "the syncs come at multiples of %.9g ns, but the pattern's period is %.9g ns (%s): "
                "give the pattern that the generator plays at /pattern/file, or calibrate it",
                sync_ps * 1e-3, diagnosis.pattern_period_ps * 1e-3,
                relation(diagnosis.pattern_period_ps, sync_ps).c_str());
  return text;
}

}  // namespace splid
