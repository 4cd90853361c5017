#include "daemon/pattern_calibration.hpp"

#include <vector>

#include "daemon/channel_map.hpp"
#include "daemon/direct_framing.hpp"
#include "daemon/format.hpp"
#include "daemon/frame.hpp"
#include "daemon/frame_plan.hpp"
#include "daemon/framer.hpp"
#include "daemon/sync_diagnosis.hpp"
#include "estimator/pulse_finder.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

// Folds each frame and uses it again.
class FoldingSink final : public FrameSink {
 public:
  FoldingSink(const FrameCapacity& capacity, PulseFinder& finder)
      : frame_(capacity), finder_(finder) {}
  Frame& open() override { return frame_; }
  void close() override { finder_.add(frame_.view()); }

 private:
  Frame frame_;
  PulseFinder& finder_;
};

Pattern pattern_of(const Pattern& nominal, const std::vector<FoundPulse>& pulses,
                   double period_ps) {
  Pattern pattern = nominal;
  PatternSegment& segment = pattern.segments.front();
  if (pulses.size() != segment.pulse_times_ps.size()) {
    pattern.mode = pulses.size() == 1 ? Mode::baseline : Mode::random;
    pattern.unambiguous_delay_ps = period_ps;
    pattern.subperiods_ps.clear();
  }
  if (pattern.mode != Mode::ambiguous) pattern.unambiguous_delay_ps = period_ps;
  segment = {period_ps, {}, {}, 0};
  for (const FoundPulse& pulse : pulses) {
    segment.pulse_times_ps.push_back(pulse.time_ps);
    segment.amplitudes.push_back(pulse.amplitude);
  }
  pattern.calibrated_period_ps = period_ps;
  pattern.pulse.reset();
  return pattern;
}

}  // namespace

Pattern calibrate_pattern(const Config& config, TagSource& source, const std::string& recording,
                          const std::stop_token& stop) {
  if (config.pattern.segments.size() != 1) {
    throw Error(Fault::usage,
                config.pattern_file + ": has several segments; patterns of one can be calibrated");
  }
  const double nominal_ps = pattern_period_ps(config.pattern);
  PulseFinder finder(nominal_ps, config.pulse.sigma_ps);
  const auto ring_tags = static_cast<std::size_t>(config.pipeline.ring_capacity_tags);
  FoldingSink folding(frame_capacity(config.frame.length_ms, config.pattern, ring_tags), finder);
  const ChannelMap channels(config.channels);
  Framer framer(framer_options(config.frame.length_ms, config.pattern, config.drift.method),
                channels, folding);
  DirectFraming sink(framer, stop);
  source.run(sink, stop);
  framer.finish();

  if (finder.photons() == 0) {
    const FramerTotals& seen = framer.totals();
    const std::string counts =
        grouped(seen.photons) + " photons, " + grouped(seen.syncs) + " syncs";
    throw Error(Fault::data,
                recording + ": " +
                    (framer.diagnosis() ? describe(*framer.diagnosis())
                                        : "no frame has both syncs that agree and photons (" +
                                              counts + "); see channels.photon and channels.sync"));
  }
  const std::vector<FoundPulse> pulses = finder.find();
  if (pulses.empty()) {
    throw Error(Fault::data, recording + ": no pulse stands out of the " +
                                 grouped(finder.photons()) + " photons folded on " +
                                 format("%.6g", finder.mean_period_ps()) +
                                 " ps; record a target at rest, closer or for longer");
  }
  return pattern_of(config.pattern, pulses, finder.mean_period_ps());
}

}  // namespace splid
