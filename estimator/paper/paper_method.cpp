#include "estimator/paper/paper_method.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid::paper {

PaperMethod::PaperMethod(const Pattern& pattern, const PulseShape& shape, const SceneOptions& scene,
                         RemainderTheorem theorem)
    : shape_(shape),
      scene_(scene),
      max_speed_mps_(scene.motion == Motion::static_target ? 0 : scene.max_speed_mps),
      mode_(pattern.mode),
      unambiguous_ns_(pattern.unambiguous_delay_ps * ns_per_ps),
      theorem_(theorem),
      train_(pattern) {
  if (mode_ == Mode::interleaved) {
    for (const double subperiod_ps : pattern.subperiods_ps) {
      repetitions_.push_back(subperiod_of(subperiod_ps * ns_per_ps));
    }
  } else if (mode_ != Mode::random) {
    for (const auto& segment : train_.segments) repetitions_.push_back(repetition_of(segment.comb));
  }
}

PaperResult PaperMethod::estimate(const FrameView& view) const {
  if (!view.sync.locked) return {};
  const auto length_ns = static_cast<double>(view.end_ps - view.start_ps) * ns_per_ps;
  FoldedFrame frame(train_, view.photons_ps.size(),
                    FrameSearch::reach_ns(scene_, shape_, length_ns));
  frame.fold(view, train_);
  return estimate(view, frame);
}

PaperResult PaperMethod::estimate(const FrameView& view, const FoldedFrame& frame) const {
  constexpr std::size_t least_photons = 3;
  PaperResult result;
  if (frame.size() < least_photons || !(frame.seen_ns > 0)) return result;
  const auto [first, last] = std::minmax_element(view.photons_ps.begin(), view.photons_ps.end());
  if (*first == *last) return result;
  const std::optional<PaperParameters> start = find_start(view, frame);
  if (!start) return result;

  likelihood::LogLikelihood likelihood(shape_, train_, frame.size(), {});
  likelihood.begin(frame);
  const AlternationResult refined = alternate(likelihood, *start, max_speed_mps_ > 0);
  const PaperParameters& p = refined.parameters;
  const auto reported_ns = [&](double delay_ns) {
    return fold_on(delay_ns, unambiguous_ns_) * frame.scale;
  };
  const double moved_ns = p.velocity_mps / speed_of_light_mps * frame.length_ns;
  result.found = refined.gain_nats > 0 && std::isfinite(p.delay_ns);
  result.delay_start_ns = reported_ns(p.delay_ns);
  result.delay_ns = reported_ns(p.delay_ns + moved_ns);
  result.velocity_mps = p.velocity_mps;
  result.signal_per_pulse = p.signal_per_pulse;
  result.background_per_ns = p.background_per_ns;
  result.gain_nats = refined.gain_nats;
  result.start = *start;
  result.start.delay_ns = reported_ns(start->delay_ns);
  result.stop = refined.stop;
  return result;
}

std::optional<Start> PaperMethod::start(const FrameView& view, const FoldedFrame& frame,
                                        FrameSearch& search) {
  search.straight(frame, Effort::balanced);
  const PaperResult found = estimate(view, frame);
  if (!found.found) return std::nullopt;
  const double beta = found.velocity_mps / speed_of_light_mps;
  const DelayTrack line = {found.delay_ns / frame.scale / (1 + beta),
                           walk_ns_at(found.velocity_mps, frame.length_ns)};
  return search.judged(frame,
                       likelihood::model_of(line, found.signal_per_pulse, found.background_per_ns));
}

}  // namespace splid::paper
