// Whole frames at every level of vectors that this machine runs: each value that is published has
// the same bits.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "estimator/model/vector_level.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

struct LevelScene {
  test::FrameMaker made;
  std::vector<test::FrameMaker> others;
  PulseOptions pulse;
  SceneOptions scene;
  EstimatorOptions options;
  DetectorOptions detector;
#ifdef SPLID_SANITIZED
  int frames = 2;  // bits are compared by the release build
#else
  int frames = 6;
#endif
};

struct LevelKind {
  const char* name;
  // What a frame of this kind has to show, so that it is of this kind.
  std::function<bool(const Estimate&)> shows;
  std::function<void(LevelScene&)> set;
};

bool has_place(const Estimate& e) { return e.has_values && e.std_delay_ns > 0; }

void add_other(LevelScene& s, double further_m, double faster_mps, double share) {
  s.others.push_back(s.made.beside(further_m, faster_mps, share));
  s.scene.targets = static_cast<std::int64_t>(s.others.size()) + 1;
}

const std::vector<LevelKind> level_kinds = {
    {"one target", has_place, [](LevelScene&) {}},
    {"faint, fine cells", has_place, [](LevelScene& s) { s.made.signal_per_pulse = 1.2e-4; }},
    {"no target", [](const Estimate& e) { return e.status == FrameStatus::no_target; },
     [](LevelScene& s) { s.made.signal_per_pulse = 0; }},
    {"400,000 photons", has_place,
     [](LevelScene& s) {
       s.made.signal_per_pulse = 0.3;
       s.made.background_per_ns = 5e-3;
       s.frames = 2;
     }},
    {"random", has_place,
     [](LevelScene& s) { s.made.pattern = test::random_pattern(3780000, 40, 9000, 5); }},
    {"rates in turn", has_place,
     [](LevelScene& s) {
       s.made.pattern = test::mrr_pattern({180000, 189000}, 3780000, 2e9);
       s.made.signal_per_pulse = 3e-3;
     }},
    {"one pulse", has_place,
     [](LevelScene& s) { s.made.pattern = test::periodic_pattern(180000); }},
    {"long frame", has_place,
     [](LevelScene& s) {
       s.made.length_ms = 5000;
       s.made.signal_per_pulse = 4e-6;
       s.made.background_per_ns = 1e-6;
       s.frames = 3;
     }},
    {"clock drift", has_place, [](LevelScene& s) { s.made.drift_ppm = 30; }},
    {"auto", has_place, [](LevelScene& s) { s.scene.motion = Motion::automatic; }},
    {"at rest", has_place,
     [](LevelScene& s) {
       s.made.velocity_mps = 0;
       s.scene.motion = Motion::static_target;
     }},
    {"accelerating", [](const Estimate& e) { return e.std_acceleration_mps2 > 0; },
     [](LevelScene& s) {
       s.made.acceleration_mps2 = 80;
       s.made.signal_per_pulse = 5e-3;
       s.scene.motion = Motion::accelerating;
     }},
    {"accelerates unasked",
     [](const Estimate& e) { return e.findings.has(FindingName::acceleration); },
     [](LevelScene& s) {
       s.made.acceleration_mps2 = 60;
       s.made.signal_per_pulse = 0.05;
     }},
    {"two targets", [](const Estimate& e) { return e.target_count == 2; },
     [](LevelScene& s) { add_other(s, 30, -20, 0.5); }},
    {"two targets, 3 widths apart", [](const Estimate& e) { return e.target_count == 2; },
     [](LevelScene& s) {
       s.made.signal_per_pulse = 5e-3;
       add_other(s, 0.06, 0, 0.5);
     }},
    {"four targets", [](const Estimate& e) { return e.target_count == 4; },
     [](LevelScene& s) {
       for (const double further_m : {1, 10, 100}) add_other(s, further_m, 1, 0.6);
     }},
    {"width fitted", [](const Estimate& e) { return e.std_pulse_sigma_ns > 0; },
     [](LevelScene& s) {
       s.made.sigma_ns = 0.2;
       s.pulse.width = PulseWidth::fitted;
     }},
    {"wider than configured",
     [](const Estimate& e) { return e.findings.has(FindingName::pulse_width); },
     [](LevelScene& s) {
       s.made.sigma_ns = 0.15;
       s.made.signal_per_pulse = 0.02;
     }},
    {"dead time modelled", [](const Estimate& e) { return e.blind_fraction > 0.1; },
     [](LevelScene& s) {
       s.made.dead_time_ns = s.detector.dead_time_ns = 50;
       s.made.length_ms = 1;
       s.made.signal_per_pulse = 1;
       s.made.background_per_ns = 0.02;
     }},
    {"dead time unknown", has_place,
     [](LevelScene& s) {
       s.made.dead_time_ns = 50;
       s.made.signal_per_pulse = 0.1;
       s.made.background_per_ns = 2e-3;
     }},
    {"method paper", has_place, [](LevelScene& s) { s.options.method = Method::paper; }},
    {"method paper, random", has_place,
     [](LevelScene& s) {
       s.options.method = Method::paper;
       s.made.pattern = test::random_pattern(3780000, 40, 9000, 5);
       s.made.velocity_mps = 1;
     }},
};

// Every member of an Estimate that is published, as bits.
class Bits {
 public:
  void add(double value) { all_.push_back(std::bit_cast<std::uint64_t>(value)); }
  void add(const FoundList& findings) {
    all_.push_back(findings.all().size());
    for (const Finding& finding : findings.all()) {
      all_.push_back(static_cast<std::uint64_t>(finding.name));
      for (const double value : {finding.value, finding.std, finding.gain_nats}) add(value);
    }
  }
  void add(const TargetEstimate& t) {
    all_.push_back(static_cast<std::uint64_t>(t.status));
    for (const double value :
         {t.delay_ns, t.std_delay_ns, t.delay_start_ns, t.velocity_mps, t.std_velocity_mps,
          t.signal_per_pulse, t.std_signal_per_pulse, t.significance_nats, t.range_odds_nats}) {
      add(value);
    }
    add(t.findings);
  }
  void add(const Estimate& e) {
    for (const std::uint64_t value :
         {static_cast<std::uint64_t>(e.status), std::uint64_t{e.has_values},
          std::uint64_t{e.dead_time_modelled}, static_cast<std::uint64_t>(e.stop),
          std::uint64_t{e.photons}, std::uint64_t{e.target_count}}) {
      all_.push_back(value);
    }
    for (const double value :
         {e.delay_ns, e.delay_start_ns, e.velocity_mps, e.acceleration_mps2, e.signal_per_pulse,
          e.background_per_ns, e.std_delay_ns, e.std_velocity_mps, e.std_acceleration_mps2,
          e.std_signal_per_pulse, e.std_background_per_ns, e.pulse_sigma_ns, e.std_pulse_sigma_ns,
          e.significance_nats, e.threshold_nats, e.range_odds_nats, e.blind_fraction}) {
      add(value);
    }
    add(e.findings);
    add(e.recent_findings);
    for (std::size_t k = 0; k < e.target_count; ++k) add(e.targets.at(k));
  }
  bool operator==(const Bits&) const = default;

 private:
  std::vector<std::uint64_t> all_;
};

class VectorLevels : public testing::TestWithParam<LevelKind> {
 protected:
  void TearDown() override { limit_vector_level(runnable_vector_levels().back()); }
};

// Each frame is estimated on its own, and again in the track of the frames before it.
Bits bits_at(VectorLevel level, const LevelScene& scene,
             const std::vector<test::FrameMaker::Frame>& frames,
             const std::function<bool(const Estimate&)>& shows) {
  limit_vector_level(level);
  EXPECT_EQ(best_vector_level(), level);
  FrameEstimator estimator(scene.made.pattern, scene.pulse, scene.scene, scene.options,
                           scene.made.length_ms, 1'000'000, ClockReference::tagger, scene.detector);
  TargetTrack track;
  Bits bits;
  for (const test::FrameMaker::Frame& frame : frames) {
    const Estimate alone = estimator.estimate(frame.view());
    EXPECT_TRUE(shows(alone));
    bits.add(alone);
    bits.add(estimator.estimate(frame.view(), &track));
  }
  return bits;
}

TEST_P(VectorLevels, GiveWholeFramesTheSameBits) {
  LevelScene scene;
  scene.made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  scene.made.velocity_mps = 12.5;
  GetParam().set(scene);
  std::vector<test::FrameMaker::Frame> frames;
  for (int n = 0; n < scene.frames; ++n) {
    frames.push_back(scene.made.make_with(scene.others, static_cast<std::uint64_t>(n) + 1));
  }
  const Bits expected = bits_at(VectorLevel::generic, scene, frames, GetParam().shows);
  for (const VectorLevel level : runnable_vector_levels()) {
    EXPECT_EQ(bits_at(level, scene, frames, GetParam().shows), expected)
        << vector_level_name(level);
  }
}

INSTANTIATE_TEST_SUITE_P(All, VectorLevels, testing::ValuesIn(level_kinds),
                         [](const testing::TestParamInfo<LevelKind>& tested) {
                           std::string name;
                           for (const char c : std::string(tested.param.name)) {
                             name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                           }
                           return name;
                         });

}  // namespace
}  // namespace splid
