#include "estimator/paper/paper_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"
#include "estimator/paper/train_photons.hpp"

namespace splid::paper {
namespace {

// How far photons may move until the near ones are looked for again. A pulse's window is 20 widths
// wide; this much on either side makes half as many photons more, and few searches for the maximum
// leave it.
constexpr double margin_widths = 5;

}  // namespace

PaperLikelihood::PaperLikelihood(const CorrectedTimes& frame, const EmissionTimes& emission,
                                 const PulseShape& shape)
    : frame_(frame),
      emission_(emission),
      shape_(shape),
      photons_(static_cast<double>(frame.time_ns.size())),
      seen_ns_(frame.seen_ns * frame.scale),
      amplitude_(emission.train().amplitude_per_ns * frame.seen_ns) {}

// How far a photon may be from where it was when the near ones were noted, at most, with what the
// window has grown by.
double PaperLikelihood::moved_since_noted_ns(const Window& window, double line_ns) const {
  const double at_start_ns = noted_line_ns_ - line_ns;
  const double at_end_ns = at_start_ns + (noted_rate_ - rate_) * frame_.length_ns;
  return std::max(std::abs(at_start_ns), std::abs(at_end_ns)) +
         std::max(std::abs(window.first_ns - noted_window_.first_ns),
                  std::abs(window.last_ns - noted_window_.last_ns));
}

void PaperLikelihood::note_near(const Window& window, double line_ns) {
  const double margin_ns = margin_widths * shape_.width_ns();
  // A hundredth of the margin is for rounding.
  if (noted_ && moved_since_noted_ns(window, line_ns) <= 0.99 * margin_ns) return;
  noted_ = true;
  noted_line_ns_ = line_ns;
  noted_rate_ = rate_;
  noted_window_ = window;
  likely_near_.clear();
  for (std::size_t j = 0; j < frame_.time_ns.size(); ++j) {
    const double sent_ns = frame_.phase_ns[j] - rate_ * frame_.time_ns[j] - line_ns;
    const double phase_ns = fold_on(sent_ns, emission_.period_ns());
    if (emission_.any_near(phase_ns, window.first_ns - margin_ns, window.last_ns + margin_ns)) {
      likely_near_.push_back(j);
    }
  }
}

// Design note: the photon's offset t - tau / (1 - beta) - e (1 + beta) / (1 - beta) is equal to
// (t - g t - tau / (1 + beta) - e) / (1 - g) with g = 2 beta / (1 + beta). The second form is
// folded on the period before e is taken off. It is then good to 1e-12 ns at any t, and resolves
// velocities of nanometres a second.
void PaperLikelihood::collect(double delay_ns, double beta) {
  for (auto* pairs : {&offset_ns_, &pair_amplitude_, &by_velocity_}) pairs->clear();
  first_.clear();
  const double stretch = frame_.scale / (1 - rate_);
  const double line_ns = delay_ns / (1 + beta);
  const double per_mps = -frame_.scale / ((1 - beta) * (1 - beta) * speed_of_light_mps);
  const Window window = {shape_.first_ns() / stretch, shape_.last_ns() / stretch};
  note_near(window, line_ns);
  for (const std::size_t j : likely_near_) {
    const double moved_ns = rate_ * frame_.time_ns[j];
    const double phase_ns = fold_on(frame_.phase_ns[j] - moved_ns - line_ns, emission_.period_ns());
    const double sent_ns = frame_.time_ns[j] - moved_ns - line_ns;
    const std::size_t before = offset_ns_.size();
    emission_.near(phase_ns, window.first_ns, window.last_ns, [&](double off_ns, double amplitude) {
      offset_ns_.push_back(off_ns * stretch);
      pair_amplitude_.push_back(amplitude);
      // d offset / dv, by e, the time at which this pulse left.
      by_velocity_.push_back(per_mps * (delay_ns + 2 * (sent_ns - off_ns)));
    });
    if (offset_ns_.size() > before) first_.push_back(before);
  }
  first_.push_back(offset_ns_.size());
}

void PaperLikelihood::move_to(double delay_ns, double velocity_mps) {
  const double beta = velocity_mps / speed_of_light_mps;
  rate_ = 2 * beta / (1 + beta);
  rate_by_mps_ = 2 / ((1 + beta) * (1 + beta) * speed_of_light_mps);
  collect(delay_ns, beta);
  for (auto* values : {&h_, &d1_, &d2_}) values->resize(offset_ns_.size());
  shape_.evaluate(offset_ns_, {h_, d1_, d2_});
  const double by_delay = -frame_.scale / (1 - beta);
  near_.assign(first_.size() - 1, Near{});
  for (std::size_t k = 0; k < near_.size(); ++k) {
    for (std::size_t i = first_[k]; i < first_[k + 1]; ++i) {
      near_[k].density += pair_amplitude_[i] * h_[i];
      near_[k].by_delay += pair_amplitude_[i] * d1_[i] * by_delay;
      near_[k].by_velocity += pair_amplitude_[i] * d1_[i] * by_velocity_[i];
    }
  }
}

PaperLikelihood::Point PaperLikelihood::evaluate(double signal_per_pulse,
                                                 double background_per_ns) const {
  const double S = signal_per_pulse;
  const double b = background_per_ns;
  const double flat_per_ns = photons_ / seen_ns_;
  const double far = photons_ - static_cast<double>(near_.size());
  Point point;
  point.gain_nats = photons_ - S * amplitude_ * (1 - rate_) - b * seen_ns_;
  point.by_velocity = S * amplitude_ * rate_by_mps_;
  point.by_signal = -amplitude_ * (1 - rate_);
  point.by_background = -seen_ns_;
  if (far > 0) {
    point.gain_nats += far * std::log(b / flat_per_ns);
    point.by_background += far / b;
  }
  for (const Near& photon : near_) {
    const double lambda = b + S * photon.density;
    point.gain_nats += std::log(lambda / flat_per_ns);
    point.by_delay += S * photon.by_delay / lambda;
    point.by_velocity += S * photon.by_velocity / lambda;
    point.by_signal += photon.density / lambda;
    point.by_background += 1 / lambda;
  }
  return point;
}

}  // namespace splid::paper
