// Scenes that the estimator's model does not have, made by the simulator's driver and framed as a
// stream is: how many frames are called ok, and how many of these have a distance or a velocity
// that is more than 5 of its deviations off. Where light is spread over a depth, each distance in
// it is right; where there is no target, no frame that is ok is right. Then the share of frames of
// each status, and of each finding.
//
//   scenes [FRAMES [NAME]]    by default 100 frames for each scene; scenes whose name has NAME

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/stream/frame_plan.hpp"
#include "daemon/stream/framer.hpp"
#include "daemon/stream/framer_sink.hpp"
#include "drivers/simulator/scene_truth.hpp"
#include "drivers/simulator/simulator.hpp"
#include "estimator/checks/finding.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "protocol/pattern_make.hpp"

namespace splid {
namespace {

using simulator::MotionKind;
using simulator::Options;

constexpr double length_ms = 50;
constexpr double far_deviations = 5;

// What is simulated, and what of it the estimator is told.
struct Set {
  Options scene;
  PulseOptions pulse;
  SceneOptions asked;
  DetectorOptions detector;
  bool has_target = true;
};

struct Scene {
  const char* name;
  std::function<void(Set&)> change;  // of [P]'s target at 10 m/s
};

Set paper_set() {
  Set set;
  set.scene.pace = simulator::Speed::max;
  set.scene.target.motion = MotionKind::linear;
  set.scene.target.distance_m = 200;
  set.scene.target.velocity_mps = 10;
  return set;
}

void remove_target(Set& set) {
  set.scene.detection.signal_per_pulse = 0;
  set.has_target = false;
}

// Foreign light whose clock is near the generator's, so that it looks like a target at 30 m/s.
void add_foreign(Set& set, double counts_per_s, double frequency_hz) {
  set.scene.drift_ppm = 0;
  set.scene.foreign = {counts_per_s, frequency_hz * (1 + 2e-7), 100};
}

void add_walk(Set& set, std::vector<NumberPair> walk, double signal_per_pulse) {
  set.scene.detection.signal_per_pulse = signal_per_pulse;
  set.scene.detector.dead_time_ns = set.detector.dead_time_ns = 50;
  set.scene.detector.walk = std::move(walk);
}

void behind(Set& set, double distance_m, double share) {
  simulator::FurtherTarget other;
  other.path = set.scene.target;
  other.path.distance_m += distance_m;
  other.signal_per_pulse = share * set.scene.detection.signal_per_pulse;
  set.scene.detection.signal_per_pulse -= other.signal_per_pulse;
  set.scene.more_targets.push_back(other);
}

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = {
      {"plain", [](Set&) {}},
      {"plain, S = 0.02", [](Set& s) { s.scene.detection.signal_per_pulse = 0.02; }},
      {"no target", remove_target},
      {"20 % 5 widths behind, S = 0.02",
       [](Set& s) {
         s.scene.detection.signal_per_pulse = 0.02;
         behind(s, 5 * 0.1 * 0.149896, 0.2);
       }},
      {"slab 1 m", [](Set& s) { s.scene.target.depth_m = 1; }},
      {"slab 1 m, width fitted",
       [](Set& s) {
         s.scene.target.depth_m = 1;
         s.pulse.width = PulseWidth::fitted;
       }},
      {"slab 0.4 m", [](Set& s) { s.scene.target.depth_m = 0.4; }},
      {"fog alone, 0.1 a pulse",
       [](Set& s) {
         remove_target(s);
         s.scene.fog = {0.1, 0, 10};
       }},
      {"fog alone, 0.02 a pulse",
       [](Set& s) {
         remove_target(s);
         s.scene.fog = {0.02, 0, 10};
       }},
      {"laser 80 MHz, 160k/s, no target",
       [](Set& s) {
         remove_target(s);
         add_foreign(s, 160'000, 80e6);
       }},
      {"pick-up 10 MHz, 20k/s, no target",
       [](Set& s) {
         remove_target(s);
         add_foreign(s, 20'000, 10e6);
       }},
      {"pick-up 10 MHz, 100k/s, S/4",
       [](Set& s) {
         s.scene.detection.signal_per_pulse /= 4;
         add_foreign(s, 100'000, 10e6);
       }},
      {"tail 30 %, 0.4 ns",
       [](Set& s) {
         s.scene.detection.tail_fraction = 0.3;
         s.scene.detection.tail_ps = 400;
       }},
      {"walk 150 ps after 50 ns, S = 0.05",
       [](Set& s) {
         add_walk(s, {{50, 150}, {200, 20}}, 0.05);
       }},
      {"the same, detector.walk given",
       [](Set& s) {
         add_walk(s, {{50, 150}, {200, 20}}, 0.05);
         s.detector.walk = s.scene.detector.walk;
       }},
      {"edge of 5 cm in 1 s, S = 0.1",
       [](Set& s) {
         s.scene.detection.signal_per_pulse = 0.1;
         s.scene.target.velocity_mps = 0;
         s.scene.target.depth_m = 0.05;
         s.scene.target.edge_period_s = 2;
       }},
      {"syncs jump 250 ps", [](Set& s) { s.scene.sync.jump_ps = 250; }},
  };
  return all;
}

struct Counts {
  int frames = 0, ok = 0, far = 0;
  std::map<std::string, int> statuses, findings;
};

const char* name_of(FrameStatus status) { return to_string(status); }

class Judge final : public FrameSink {
 public:
  explicit Judge(const Set& set, const Pattern& pattern)
      : set_(set),
        truth_(simulator::scene_truth(set.scene)),
        frame_(std::make_unique<Frame>(FrameCapacity{})),
        estimator_(pattern, set.pulse, set.asked, {}, length_ms, 1 << 20, ClockReference::tagger,
                   set.detector) {}

  Frame& open() override { return *frame_; }
  void close() override {
    if (frame_->seen_fraction < 1) return;
    const Estimate found = estimator_.estimate(frame_->view());
    ++counts.frames;
    ++counts.statuses[name_of(found.status)];
    for (const Finding& finding : found.findings.all()) {
      ++counts.findings[checks::to_string(finding.name)];
    }
    if (found.status != FrameStatus::ok) return;
    ++counts.ok;
    counts.far += is_far(found) ? 1 : 0;
  }

  Counts counts;

 private:
  [[nodiscard]] bool is_far(const Estimate& found) const {
    if (!set_.has_target) return true;
    const auto truth = truth_.at(frame_->view().mid_ps());
    if (!truth) return false;
    // The unambiguous delay is the pattern's period, as the tagger counts it.
    const double range_ns = frame_->view().sync.period_ps * ns_per_ps;
    const double depth_ns = 2e9 * set_.scene.target.depth_m / speed_of_light_mps;
    const double front_ns = 2e9 * truth->distance_m / speed_of_light_mps;
    // From the middle of the depth, less half of it.
    const double off_ns =
        std::abs(std::remainder(found.delay_ns - front_ns - depth_ns / 2, range_ns)) - depth_ns / 2;
    return off_ns > far_deviations * found.std_delay_ns ||
           std::abs(found.velocity_mps - truth->velocity_mps) >
               far_deviations * found.std_velocity_mps;
  }

  const Set& set_;
  SceneTruth truth_;
  std::unique_ptr<Frame> frame_;
  FrameEstimator estimator_;
};

Counts run(const Scene& scene, int frames) {
  const Pattern pattern = make_interleaved(std::vector<double>{180'000, 189'000});
  Set set = paper_set();
  scene.change(set);
  set.scene.seconds = (frames + 1) * length_ms * 1e-3;
  Judge judge(set, pattern);
  const ChannelMap channels{ChannelOptions{}};
  Framer framer(framer_options(length_ms, pattern, DriftMethod::regression, set.detector.walk),
                channels, judge);
  FramerSink sink(framer, {});
  simulator::Source(set.scene, pattern).run(sink, {});
  framer.finish();
  return judge.counts;
}

void print(const char* name, const Counts& counts) {
  const double all = std::max(1, counts.frames) / 100.0;
  std::printf("| %s | %d | %.1f | %.1f |", name, counts.frames, counts.ok / all, counts.far / all);
  for (const auto* shares : {&counts.statuses, &counts.findings}) {
    for (const auto& [what, count] : *shares) std::printf(" %s %.1f", what.c_str(), count / all);
    std::printf(" |");
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 100;
  const std::string wanted = argc > 2 ? argv[2] : "";
  std::printf("| scene | frames | ok, %% | ok and far, %% | status, %% | findings, %% |\n");
  std::printf("|---|---|---|---|---|---|\n");
  for (const splid::Scene& scene : splid::scenes()) {
    if (std::string(scene.name).find(wanted) == std::string::npos) continue;
    splid::print(scene.name, splid::run(scene, frames));
  }
  return 0;
}
