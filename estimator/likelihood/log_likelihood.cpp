#include "estimator/likelihood/log_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/vector_level.hpp"

namespace splid::likelihood {
namespace {

constexpr std::size_t most_terms = 3;
// Which of a batch's powers is the term of a track, and which is the product of two terms.
constexpr std::array<std::size_t, most_terms> power_of_term = {0, 1, 3};
constexpr std::array<std::array<std::size_t, most_terms>, most_terms> power_of_two = {
    {{0, 1, 3}, {1, 2, 4}, {3, 4, 5}}};

Eigen::Index row(std::size_t place) { return static_cast<Eigen::Index>(place); }

void add(SmallMatrix& hessian, std::size_t a, std::size_t b, double value) {
  hessian(row(std::min(a, b)), row(std::max(a, b))) += value;
}

}  // namespace

LogLikelihood::LogLikelihood(const PulseShape& shape, const PulseTrain& train,
                             std::size_t max_photons, const Scope& scope)
    : shape_(shape),
      train_(train),
      kernels_(SPLID_KERNELS_OF(best_vector_level(), likelihood_kernels)),
      near_(train, shape, max_photons, scope.targets, scope.most_width) {
  for (auto* values : {&offset_, &h_, &d1_, &d2_}) values->reserve(near_.most_entries());
  if (scope.may_be_dead) hidden_.emplace(shape, train, max_photons, scope.targets, near_);
}

void LogLikelihood::begin(const FoldedFrame& frame) {
  frame_ = &frame;
  exposure_ = Exposure(frame, train_);
  near_.begin();
  loaded_.count = 0;
}

double LogLikelihood::no_target_nats() const {
  const auto all = static_cast<double>(frame_->size());
  return all > 0 ? all * std::log(all / exposure_.seen_ns) - all : 0;
}

void LogLikelihood::collect(const Model& about, std::size_t gather_from) {
  near_.collect(*frame_, about, gather_from);
  loaded_.count = 0;
  if (hidden_ && frame_->dead != nullptr) hidden_->collect(*frame_, near_, about.count);
}

bool LogLikelihood::is_loaded(const Model& at) const {
  return loaded_.count == at.count && loaded_.log_width == at.log_width &&
         std::equal(at.targets.begin(), at.targets.begin() + at.count, loaded_.targets.begin(),
                    [](const Target& a, const Target& b) { return a.track == b.track; });
}

// Residuals are times of emission. A photon's offset in its detected pulse is the residual times
// scale / (1 - g), by which a pattern is longer when it comes back.
void LogLikelihood::load(const Model& at) {
  if (is_loaded(at)) return;
  loaded_ = at;
  const std::size_t entries = near_.residuals_ns().size();
  for (auto* values : {&offset_, &h_, &d1_, &d2_}) values->resize(entries);
  for (const NearPhotons::Group& group : near_.groups()) {
    for (std::size_t t = 0; t < group.target_count; ++t) {
      const DelayTrack& track = at.targets[group.targets[t]].track;
      const DelayTrack moved = track - near_.near(group.targets[t]).track;
      const LikelihoodKernels::Placing placing = {moved.delay_ns, moved.walk_ns, moved.quadratic_ns,
                                                  dilation(track) * std::exp(-at.log_width)};
      for (std::size_t pulse = 0; pulse < group.pulses; ++pulse) {
        const std::size_t first = group.entries_of(t) + pulse * group.photons;
        kernels_.offsets(offset_.data() + first, near_.residuals_ns().data() + first,
                         near_.shares().data() + group.first, placing, group.photons);
      }
    }
  }
  shape_.evaluate(offset_, {h_, d1_, d2_});
}

double LogLikelihood::dilation(const DelayTrack& track) const {
  return exposure_.scale / (1 - track.walk_ns / exposure_.length_ns);
}

// -integral lambda, and the photons that are near no track.
void LogLikelihood::start(const Model& at, Point& point) const {
  const std::size_t parameters = parameters_of(at.count);
  const Eigen::Index b = row(background_place(at.count));
  point.value = -at.background_per_ns * exposure_.seen_ns;
  point.gradient.setZero(row(parameters));
  point.hessian.setZero(row(parameters), row(parameters));
  point.gradient[b] = -exposure_.seen_ns;
  for (std::size_t k = 0; k < at.count; ++k) {
    const Target& target = at.targets[k];
    const double A = exposure_.amplitude, t_a = exposure_.length_ns;
    const double one_less_g = 1 - target.track.walk_ns / t_a;
    point.value -= target.signal_per_pulse * A * one_less_g;
    point.gradient[row(place_of(k, walk))] += target.signal_per_pulse * A / t_a;
    point.gradient[row(place_of(k, signal))] -= A * one_less_g;
    point.hessian(row(place_of(k, walk)), row(place_of(k, signal))) += A / t_a;
  }
  const double far = static_cast<double>(frame_->size()) - near_.near_count();
  if (far > 0) {
    point.value += far * std::log(at.background_per_ns);
    point.gradient[b] += far / at.background_per_ns;
    point.hessian(b, b) -= far / (at.background_per_ns * at.background_per_ns);
  }
}

// The integral over the dead time is part of -integral lambda, and is given back.
void LogLikelihood::give_back_hidden(const Model& at, Point& point) {
  const std::size_t w = width_place(at.count);
  for (std::size_t k = 0; k < at.count; ++k) {
    const double S = at.targets[k].signal_per_pulse;
    const HiddenLight::Amplitude B = hidden_->of(k, at, dilation(at.targets[k].track));
    const std::array<std::size_t, 4> places = {place_of(k, delay), place_of(k, walk),
                                               place_of(k, quadratic), w};
    point.value += S * B.value;
    point.gradient[row(place_of(k, signal))] += B.value;
    for (std::size_t a = 0; a < places.size(); ++a) {
      point.gradient[row(places[a])] += S * B.gradient[row(a)];
      add(point.hessian, places[a], place_of(k, signal), B.gradient[row(a)]);
      for (std::size_t b = 0; b <= a; ++b) {
        add(point.hessian, places[a], places[b], S * B.hessian(row(a), row(b)));
      }
    }
  }
}

void LogLikelihood::evaluate(const Model& at, const FreeSet& free, Point& point) {
  Wanted wanted;
  wanted.width = free[width_place(at.count)];
  if (free.none()) wanted.terms = 0;  // the value alone
  for (std::size_t k = 0; k < at.count; ++k) {
    if (free[place_of(k, quadratic)]) wanted.terms = 3;
    if (free[place_of(k, walk)]) wanted.terms = std::max<std::size_t>(wanted.terms, 2);
  }
  load(at);
  start(at, point);
  if (hidden_ && frame_->dead != nullptr) give_back_hidden(at, point);
  for (const NearPhotons::Group& group : near_.groups()) {
    for (std::size_t first = 0; first < group.photons; first += batch) {
      const Batch of = {group, first, std::min(batch, group.photons - first)};
      add_batch(of, at, wanted, point);
    }
  }
  point.hessian.triangularView<Eigen::StrictlyLower>() = point.hessian.transpose();
}

void LogLikelihood::add_batch(const Batch& of, const Model& at, const Wanted& wanted,
                              Point& point) {
  gather_light(of, at, wanted);
  add_logs(of, point);
  if (wanted.terms == 0) return;
  kernels_.invert(inverse_.data(), intensity_.data(), of.count);
  kernels_.weigh(powers_.front().data(), batch, wanted.terms,
                 near_.roots().data() + of.first_photon(),
                 near_.shares().data() + of.first_photon(), of.count);
  columns_.count = 0;
  if (wanted.width) width_.fill(0);
  for (std::size_t t = 0; t < of.group.target_count; ++t) {
    add_target(of, t, at, wanted, point);
    if (wanted.width) add_width(of, t, at, wanted, point);
  }
  if (wanted.width) {
    kernels_.product(columns_.add(width_place(at.count)), 1, powers_[0].data(), width_.data(),
                     of.count);
  }
  kernels_.product(columns_.add(background_place(at.count)), 1, powers_[0].data(), inverse_.data(),
                   of.count);
  add_products(of.count, point);
}

// The light of each target at a batch of photons, and the intensity there.
void LogLikelihood::gather_light(const Batch& of, const Model& at, const Wanted& wanted) {
  // How h and its first two derivatives by the offset change where the pulse is wider.
  const double once = std::exp(-at.log_width);
  const std::array<double, 3> narrow = {once, once * once, once * once * once};
  const std::array<double, 3> by_width = {once, once * once, once};
  const double* weights = near_.weights().data() + of.first_photon();
  for (std::size_t i = 0; i < of.count; ++i) {
    intensity_[i] = weights[i] > 0 ? at.background_per_ns : 1;
  }
  for (std::size_t t = 0; t < of.group.target_count; ++t) {
    Light& light = light_[t];
    if (wanted.width) {
      for (Column* column : {&light.dw, &light.dw1, &light.dww}) column->fill(0);
    }
    for (std::size_t pulse = 0; pulse < of.group.pulses; ++pulse) {
      const std::size_t j = of.group.entries_of(t) + pulse * of.group.photons + of.first;
      const LikelihoodKernels::Pulse from = {near_.amplitudes().data() + j, offset_.data() + j,
                                             h_.data() + j, d1_.data() + j, d2_.data() + j};
      (pulse == 0 ? kernels_.set_light : kernels_.add_light)(light.itself(), from, narrow.data(),
                                                             of.count);
      if (!wanted.width) continue;
      kernels_.add_by_width(light.by_width(), from, by_width.data(), of.count);
    }
    kernels_.add_scaled(intensity_.data(), at.targets[of.group.targets[t]].signal_per_pulse,
                        light.h.data(), of.count);
  }
}

// Adds log lambda of the photons.
//
// Design note: the intensities of eight photons are multiplied, and some such products, before the
// logarithm is taken, unless a product is near the limits of a double or photons count several
// times.
void LogLikelihood::add_logs(const Batch& of, Point& point) const {
  constexpr double least = 1e-100, most = 1e100;
  std::array<double, batch / NearPhotons::lanes> products;
  kernels_.products(products.data(), intensity_.data(), of.count);
  const double* weights = near_.weights().data() + of.first_photon();
  double logs = 0, product = 1;
  for (std::size_t n = 0; n * NearPhotons::lanes < of.count; ++n) {
    if (!near_.gathers() && products[n] > least && products[n] < most) {
      product *= products[n];
      if (product > least && product < most) continue;
      logs += std::log(product);
      product = 1;
      continue;
    }
    for (std::size_t i = n * NearPhotons::lanes; i < (n + 1) * NearPhotons::lanes; ++i) {
      if (weights[i] > 0) point.value += weights[i] * std::log(intensity_[i]);
    }
  }
  point.value += logs + std::log(product);
}

// Adds a target's columns, and what the second derivatives of lambda itself by the terms of its
// track and by its signal add to the Hessian.
void LogLikelihood::add_target(const Batch& of, std::size_t t, const Model& at,
                               const Wanted& wanted, Point& point) {
  const std::size_t k = of.group.targets[t];
  const double S = at.targets[k].signal_per_pulse;
  const double by_delay = -dilation(at.targets[k].track);
  const std::array<double, 3> scale = {1, by_delay, S * by_delay * by_delay};
  double* const first_term = columns_.next();
  for (std::size_t r = 0; r < wanted.terms; ++r) columns_.add(of_target * k + r);
  double* const density = columns_.add(place_of(k, signal));
  kernels_.divide({over_.data(), first_.data(), density, second_.data()}, light_[t].itself(),
                  inverse_.data(), powers_[0].data(), scale.data(), of.count);
  for (std::size_t r = 0; r < wanted.terms; ++r) {
    kernels_.product(first_term + r * batch, S, powers_[power_of_term[r]].data(), over_.data(),
                     of.count);
  }
  const auto first = sums_with_powers(first_, wanted, of.count);
  const auto second = sums_with_powers(second_, wanted, of.count);
  for (std::size_t r = 0; r < wanted.terms; ++r) {
    add(point.hessian, of_target * k + r, place_of(k, signal), first[power_of_term[r]]);
    for (std::size_t q = r; q < wanted.terms; ++q) {
      add(point.hessian, of_target * k + r, of_target * k + q, second[power_of_two[r][q]]);
    }
  }
}

// What the second derivatives of lambda itself by the width add.
void LogLikelihood::add_width(const Batch& of, std::size_t t, const Model& at, const Wanted& wanted,
                              Point& point) {
  const std::size_t k = of.group.targets[t];
  const double S = at.targets[k].signal_per_pulse;
  const std::array<double, 3> scale = {1, -S * dilation(at.targets[k].track), S};
  const std::size_t w = width_place(at.count);
  kernels_.divide({over_.data(), first_.data(), density_.data(), second_.data()},
                  light_[t].by_width(), inverse_.data(), powers_[0].data(), scale.data(), of.count);
  kernels_.product(over_.data(), S, light_[t].dw.data(), inverse_.data(), of.count);
  kernels_.add_scaled(width_.data(), 1, over_.data(), of.count);
  add(point.hessian, place_of(k, signal), w, sums_with_powers(density_, {}, of.count)[0]);
  add(point.hessian, w, w, sums_with_powers(second_, {}, of.count)[0]);
  const auto first = sums_with_powers(first_, wanted, of.count);
  for (std::size_t r = 0; r < wanted.terms; ++r) {
    add(point.hessian, of_target * k + r, w, first[power_of_term[r]]);
  }
}

std::array<double, LogLikelihood::most_powers> LogLikelihood::sums_with_powers(
    const Column& column, const Wanted& wanted, std::size_t count) const {
  constexpr std::array<std::size_t, most_terms + 1> powers_of_terms = {0, 1, 3, 6};
  std::array<double, most_powers> sums;
  kernels_.dots(sums.data(), column.data(), powers_.front().data(), batch,
                powers_of_terms[wanted.terms], count);
  return sums;
}

// Adds the first derivatives of log lambda, and their products.
void LogLikelihood::add_products(std::size_t count, Point& point) const {
  std::array<double, most_parameters> sums;
  kernels_.dots(sums.data(), powers_[0].data(), columns_.values.front().data(), batch,
                columns_.count, count);
  for (std::size_t a = 0; a < columns_.count; ++a) {
    point.gradient[row(columns_.place[a])] += sums[a];
  }
  for (std::size_t a = 0; a < columns_.count; ++a) {
    kernels_.dots(sums.data(), columns_.values[a].data(), columns_.values.front().data(), batch,
                  a + 1, count);
    for (std::size_t b = 0; b <= a; ++b) {
      add(point.hessian, columns_.place[a], columns_.place[b], -sums[b]);
    }
  }
}

}  // namespace splid::likelihood
