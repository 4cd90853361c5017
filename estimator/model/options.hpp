#pragma once

#include <cstdint>
#include <optional>

#include "estimator/sync/sync_fit.hpp"
#include "protocol/options.hpp"

namespace splid {

enum class Motion { static_target, moving, automatic };
enum class Method { search, paper };
enum class Effort { fast, balanced, exhaustive };
enum class Shape { gaussian, tabulated };

const char* to_string(Effort effort);

// What the scene may hold. JSON: `scene`.
struct SceneOptions {
  Motion motion = Motion::moving;
  double max_speed_mps = 150;  // |v| searched
  double range_offset_m = 0;   // of the instrument: subtracted from each distance
  void describe(OptionVisitor& visitor);
};

// JSON: `estimator`.
struct EstimatorOptions {
  Method method = Method::search;
  Effort effort = Effort::balanced;
  bool tracked = false;            // a frame first looks where the one before found its target
  double false_alarm_rate = 1e-3;  // frames without a target that claim one
  double range_risk = 1e-3;        // chance of a wrong range above which a frame is ambiguous
  void describe(OptionVisitor& visitor);
};

// JSON: `pulse`. The shape of the detected pulse about its time.
struct PulseOptions {
  Shape shape = Shape::gaussian;
  double sigma_ps = 100;  // of a gaussian
  void describe(OptionVisitor& visitor);
};

// JSON: `drift`.
struct DriftOptions {
  DriftMethod method = DriftMethod::regression;
  void describe(OptionVisitor& visitor);
};

}  // namespace splid
