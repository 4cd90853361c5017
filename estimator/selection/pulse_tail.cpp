#include "estimator/selection/pulse_tail.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/likelihood/maximizer.hpp"
#include "estimator/likelihood/small_matrix.hpp"

namespace splid::selection {
namespace {

using likelihood::Maximizer;

constexpr std::array tail_lengths_widths = {1.0, 2.0, 3.0, 4.5};
constexpr int most_steps = 12;
constexpr double first_share = 0.1;  // of the light, in the tail

}  // namespace

PulseTail::PulseTail(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons)
    : shape_(shape),
      train_(train),
      cell_ns_(shape.width_ns() / cells_a_width),
      near_(max_photons, max_photons) {
  const double reach_ns = std::min(reach_widths * shape.width_ns(), 0.499 * train.closest_ns);
  first_ns_ = shape.peak_offset_ns() - reach_ns;
  if (reach_ns < pulse_reach_widths * shape.width_ns()) return;
  cells_ = std::min(most_cells, static_cast<std::size_t>(2 * reach_ns / cell_ns_));
  windows_ = comb_windows(train, first_ns_, first_ns_ + static_cast<double>(cells_) * cell_ns_);
}

void PulseTail::count(const FoldedFrame& frame, const likelihood::Model& about) {
  about_ = about.targets.front().track;
  exposure_ = Exposure(frame, train_);
  near_.collect(frame, windows_, train_, about_);
  counts_.fill(0);
  for (const double residual_ns : near_.residual_ns) {
    const double cell = (residual_ns - first_ns_) / cell_ns_;
    if (cell >= 0 && cell < static_cast<double>(cells_))
      counts_[static_cast<std::size_t>(cell)] += 1;
  }
}

// Puts a target's returns about the track, over the frame, into a column.
void PulseTail::put(const likelihood::Model& model, std::size_t target, std::size_t column) {
  constexpr int parts = 8;
  const likelihood::Target& own = model.targets.at(target);
  const double photons = own.signal_per_pulse * exposure_.amplitude / parts;
  const double narrow = std::exp(-model.log_width);
  auto light = by_.col(static_cast<Eigen::Index>(column)).head(static_cast<Eigen::Index>(cells_));
  light.setZero();
  for (int part = 0; part < parts; ++part) {
    const double share = (part + 0.5) / parts - 0.5;
    const double apart_ns =
        std::remainder(own.track.at(share) - about_.at(share), train_.circle_ns);
    for (std::size_t i = 0; i <= cells_; ++i) {
      place_[i] = (first_ns_ + static_cast<double>(i) * cell_ns_ - apart_ns) * narrow;
    }
    shape_.integrate(std::span(place_).first(cells_ + 1), light_);
    for (std::size_t i = 0; i < cells_; ++i) {
      light[static_cast<Eigen::Index>(i)] += photons * (light_[i + 1] - light_[i]);
    }
  }
}

double PulseTail::nats(const likelihood::Model& model) {
  dark_ = model.background_per_ns * exposure_.seen_ns * train_.pulses_per_ns * cell_ns_;
  expected_.fill(dark_);
  double value = 0;
  for (std::size_t k = 0; k < model.count; ++k) {
    put(model, k, 0);
    for (std::size_t i = 0; i < cells_; ++i) expected_[i] += by_(static_cast<Eigen::Index>(i), 0);
  }
  for (std::size_t i = 0; i < cells_; ++i) {
    value += (counts_[i] > 0 ? counts_[i] * std::log(expected_[i]) : 0) - expected_[i];
  }
  return value;
}

double PulseTail::other_width_nats(const likelihood::Model& model, double enough_nats) {
  dark_ = model.background_per_ns * exposure_.seen_ns * train_.pulses_per_ns * cell_ns_;
  others_ = model.count - 1;
  by_.setZero();
  for (std::size_t k = 0; k < others_; ++k) put(model, k + 1, first_other + k);
  fitted_ = {};
  fitted_[body] = model.targets.front().signal_per_pulse * exposure_.amplitude;
  for (std::size_t k = 0; k < others_; ++k) fitted_[first_other + k] = 1;
  fitted_[offset_at() + 1] = model.log_width;
  return maximize(fitted_, 0, enough_nats);
}

double PulseTail::with_tail_nats(double enough_nats) {
  double best = -std::numeric_limits<double>::infinity();
  for (const double widths : tail_lengths_widths) {
    Amounts at = fitted_;
    at[tail] = first_share * at[body];
    at[body] -= at[tail];
    best = std::max(best, maximize(at, widths * shape_.width_ns(), enough_nats));
    if (best > enough_nats) break;
  }
  return best;
}

// The expected photons and their derivatives; returns the log-likelihood of the counts. The tail
// follows from tail' = (light - tail) / length, with a light that is linear over a cell.
double PulseTail::expect(const Amounts& at, double tail_ns) {
  const auto offset = static_cast<Eigen::Index>(offset_at()), width = offset + 1;
  const double narrow = std::exp(-at[offset_at() + 1]);
  for (std::size_t i = 0; i <= cells_; ++i) {
    place_[i] = (first_ns_ + static_cast<double>(i) * cell_ns_ - at[offset_at()]) * narrow;
  }
  const std::span place = std::span(place_).first(cells_ + 1);
  shape_.integrate(place, light_);
  shape_.evaluate(place, {h_, d1_, d2_});
  const double steps = tail_ns > 0 ? cell_ns_ / tail_ns : 0, stays = std::exp(-steps);
  double late = 0, late_density = 0, value = 0;
  for (std::size_t i = 0; i < cells_; ++i) {
    const double light = light_[i + 1] - light_[i];
    double late_next = 0, density_next = 0;
    if (tail_ns > 0) {
      const double grows = light / steps;
      late_next = light_[i + 1] - grows + (late - light_[i] + grows) * stays;
      density_next = (light_[i + 1] - late_next) / tail_ns;
    }
    const auto row = static_cast<Eigen::Index>(i);
    by_(row, body) = light;
    by_(row, tail) = late_next - late;
    by_(row, offset) =
        -narrow * at[body] * (h_[i + 1] - h_[i]) - at[tail] * (density_next - late_density);
    by_(row, width) = -at[body] * (place_[i + 1] * h_[i + 1] - place_[i] * h_[i]);
    double expected = dark_ + at[body] * light + at[tail] * (late_next - late);
    for (std::size_t k = first_other; k < first_other + others_; ++k) {
      expected += at[k] * by_(row, static_cast<Eigen::Index>(k));
    }
    expected_[i] = std::max(expected, 1e-12);
    value += (counts_[i] > 0 ? counts_[i] * std::log(expected_[i]) : 0) - expected_[i];
    late = late_next, late_density = density_next;
  }
  return value;
}

// Scores by Fisher, with amounts of light that stay above 0.
double PulseTail::maximize(Amounts& at, double tail_ns, double enough_nats) {
  constexpr double most_log_width = 1.4, least_kept = 0.1;
  const auto size = static_cast<Eigen::Index>(amounts());
  double value = expect(at, tail_ns);
  for (int n = 0; n < most_steps; ++n) {
    const auto cells = static_cast<Eigen::Index>(cells_);
    const Eigen::Map<const Eigen::ArrayXd> counts(counts_.data(), cells);
    const Eigen::Map<const Eigen::ArrayXd> expected(expected_.data(), cells);
    const auto by = by_.topLeftCorner(cells, size);
    auto over = over_.topLeftCorner(cells, size);
    over = expected.inverse().matrix().asDiagonal() * by;
    SmallVector slope = over.transpose() * (counts - expected).matrix();
    SmallMatrix information = by.transpose().lazyProduct(over);
    information.diagonal() *= 1 + 1e-9;
    information.diagonal().array() += 1e-12;
    if (tail_ns == 0) {
      slope[tail] = 0;
      information(tail, tail) = 1;
    }
    const auto step = solution_of_positive(information, slope);
    if (!step || !(slope.dot(*step) > Maximizer::compared_nats)) return value;
    const double most_nats = value + Maximizer::most_nats(slope.dot(*step) / 2);
    if (most_nats < enough_nats || value > enough_nats) return value;
    const Amounts from = at;
    double part = 1, next = value;
    for (int halved = 0; halved < 5; ++halved, part /= 2) {
      for (std::size_t a = 0; a < amounts(); ++a) {
        at[a] = from[a] + part * (*step)[static_cast<Eigen::Index>(a)];
        if (a < offset_at()) at[a] = std::max(at[a], least_kept * from[a]);
      }
      at[offset_at() + 1] = std::clamp(at[offset_at() + 1], -most_log_width, most_log_width);
      next = expect(at, tail_ns);
      if (next > value) break;
    }
    if (!(next > value)) {
      at = from;
      return expect(at, tail_ns);
    }
    if (next - value < Maximizer::compared_nats) return next;
    value = next;
  }
  return value;
}

}  // namespace splid::selection
