#include "estimator/fit/joint_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fit/small_matrix.hpp"

namespace splid {
namespace {

// A number in [0, 1) that a photon's place in its frame draws, the same on every machine
// (splitmix64, Steele et al. 2014).
double lot_of(std::uint64_t photon) {
  std::uint64_t x = (photon + 1) * 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return static_cast<double>((x ^ (x >> 31U)) >> 11U) * 0x1p-53;
}

// A target whose light is so small a part of the background's has no say in a photon.
constexpr double least_share = 1e-13;

}  // namespace

JointLikelihood::JointLikelihood(const PulseShape& shape, const PulseTrain& train,
                                 std::size_t max_photons, double margin_ns)
    : shape_(shape),
      train_(train),
      margin_ns_(margin_ns),
      windows_(
          comb_windows(train, shape.first_ns() - 2 * margin_ns, shape.last_ns() + 2 * margin_ns)) {
  const std::size_t of_one = max_photons * widest_overlap(windows_);
  for (std::size_t k = 0; k < most_targets; ++k) near_.emplace_back(max_photons, of_one, true);
  index_.reserve(max_photons);
  who_.reserve(max_photons);
  first_.reserve(max_photons + 1);
  const std::size_t entries = most_targets * of_one;
  target_.reserve(entries);
  for (auto* values : {&residual_, &position_, &amplitude_, &offset_, &h_, &d1_, &d2_}) {
    values->reserve(entries);
  }
}

void JointLikelihood::collect(const FoldedFrame& frame, const JointParameters& about) {
  forget();
  hold(frame, about);
}

void JointLikelihood::hold(const FoldedFrame& frame, const JointParameters& about) {
  if (serves(about)) return;
  photons_ = frame.size();
  for (std::size_t k = 0; k < about.count; ++k) {
    if (k < about_.count && serves(k, about)) continue;
    about_.targets.at(k) = about.targets.at(k);
    near_[k].collect(frame, windows_, train_, about.targets.at(k).line);
  }
  about_.count = about.count;
  merge(about.count);
}

bool JointLikelihood::serves(std::size_t target, const JointParameters& at) const {
  const DelayLine& a = about_.targets.at(target).line;
  const DelayLine& b = at.targets.at(target).line;
  return std::abs(a.delay_ns - b.delay_ns) + std::abs(a.travel_ns - b.travel_ns) / 2 <= margin_ns_;
}

bool JointLikelihood::serves(const JointParameters& at) const {
  if (at.count != about_.count) return false;
  for (std::size_t k = 0; k < at.count; ++k) {
    if (!serves(k, at)) return false;
  }
  return true;
}

// Whether the densities at the photons are those for these lines.
bool JointLikelihood::is_loaded(const JointParameters& at) const {
  if (loaded_.count != at.count) return false;
  for (std::size_t k = 0; k < at.count; ++k) {
    const DelayLine& a = loaded_.targets.at(k).line;
    const DelayLine& b = at.targets.at(k).line;
    if (a.delay_ns != b.delay_ns || a.travel_ns != b.travel_ns) return false;
  }
  return true;
}

void JointLikelihood::load(const Exposure& exposure, const JointParameters& at) {
  if (is_loaded(at)) return;
  loaded_ = at;
  std::array<double, most_targets> delay{}, travel{};
  for (std::size_t k = 0; k < at.count; ++k) {
    const DelayLine& line = at.targets.at(k).line;
    delay.at(k) = line.delay_ns - about_.targets.at(k).line.delay_ns;
    travel.at(k) = line.travel_ns - about_.targets.at(k).line.travel_ns;
    const double one_less_g = 1 - line.travel_ns / exposure.length_ns;
    by_.at(k) = {exposure.scale / one_less_g, 1 / (one_less_g * exposure.length_ns)};
  }
  const std::size_t count = residual_.size();
  for (auto* scratch : {&offset_, &h_, &d1_, &d2_}) scratch->resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    const std::size_t k = target_[j];
    offset_[j] = (residual_[j] - delay[k] - travel[k] * position_[j]) * by_[k].dilation;
  }
  shape_.evaluate(offset_, {h_, d1_, d2_});
}

// Each target's density at a photon and its derivatives by delay (1) and travel (2); see
// Likelihood::evaluate(). Targets that do not matter to the photon are left out.
std::size_t JointLikelihood::shares_of(std::size_t photon, const JointParameters& at,
                                       std::array<Share, most_targets>& shares) const {
  std::size_t count = 0;
  for (std::size_t begin = first_[photon], end = begin; begin < first_[photon + 1]; begin = end) {
    const std::size_t k = target_[begin];
    Share& share = shares[count];
    share = {k};
    for (; end < first_[photon + 1] && target_[end] == k; ++end) {
      share.density += amplitude_[end] * h_[end];
    }
    if (at.targets[k].signal_per_pulse * share.density <= least_share * at.background_per_ns) {
      continue;
    }
    const double dilation = by_[k].dilation;
    const double turn = by_[k].turn;
    for (std::size_t j = begin; j < end; ++j) {
      const double a = amplitude_[j];
      const double o1 = -dilation;
      const double o2 = -dilation * position_[j] + offset_[j] * turn;
      share.g1 += a * d1_[j] * o1;
      share.g2 += a * d1_[j] * o2;
      share.g11 += a * d2_[j] * o1 * o1;
      share.g12 += a * (d2_[j] * o1 * o2 - d1_[j] * dilation * turn);
      share.g22 += a * (d2_[j] * o2 * o2 + d1_[j] * 2 * turn * o2);
    }
    ++count;
  }
  return count;
}

// Adds log lambda of a photon that these targets have a share in, and its derivatives.
//
// Design note: the sums lie in structures of plain numbers. In a matrix whose size is not known
// when this is compiled, the same additions take three times as long.
void JointLikelihood::add(std::span<const Share> shares, const JointParameters& at, double lambda,
                          Sums& sums) {
  const double inverse = 1 / lambda;
  sums.background += inverse;
  sums.background_squares += inverse * inverse;
  std::array<std::array<double, 3>, most_targets> by;
  for (std::size_t n = 0; n < shares.size(); ++n) {
    const Share& share = shares[n];
    const double weight = at.targets[share.target].signal_per_pulse * inverse;
    OfOne& own = sums.of_one[share.target];
    const double l1 = weight * share.g1, l2 = weight * share.g2, l3 = share.density * inverse;
    by[n] = {l1, l2, l3};
    own.d1 += l1, own.d2 += l2, own.d3 += l3;
    own.h11 += weight * share.g11 - l1 * l1;
    own.h12 += weight * share.g12 - l1 * l2;
    own.h22 += weight * share.g22 - l2 * l2;
    own.h13 += share.g1 * inverse - l1 * l3;
    own.h23 += share.g2 * inverse - l2 * l3;
    own.h33 -= l3 * l3;
    own.h1b -= l1 * inverse, own.h2b -= l2 * inverse, own.h3b -= l3 * inverse;
    for (std::size_t m = 0; m < n; ++m) {
      auto& cross = sums.cross[shares[m].target][share.target];
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) cross[3 * r + c] -= by[m][r] * by[n][c];
      }
    }
  }
}

void JointLikelihood::add(const Sums& sums, std::size_t targets, JointPoint& point) {
  SmallVector& g = point.gradient;
  SmallMatrix& H = point.hessian;
  const Eigen::Index b = g.size() - 1;
  g[b] += sums.background;
  H(b, b) -= sums.background_squares;
  for (std::size_t k = 0; k < targets; ++k) {
    const OfOne& own = sums.of_one[k];
    const auto d = static_cast<Eigen::Index>(3 * k);
    g.segment<3>(d) += Eigen::Vector3d(own.d1, own.d2, own.d3);
    H(d, d) += own.h11, H(d, d + 1) += own.h12, H(d + 1, d + 1) += own.h22;
    H(d, d + 2) += own.h13, H(d + 1, d + 2) += own.h23, H(d + 2, d + 2) += own.h33;
    H(d, b) += own.h1b, H(d + 1, b) += own.h2b, H(d + 2, b) += own.h3b;
    for (std::size_t m = 0; m < k; ++m) {
      using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      H.block<3, 3>(static_cast<Eigen::Index>(3 * m), d) +=
          Eigen::Map<const Block>(sums.cross[m][k].data());
    }
  }
}

// -integral lambda, with its derivatives.
void JointLikelihood::start(const Exposure& exposure, const JointParameters& at,
                            JointPoint& point) const {
  const auto size = static_cast<Eigen::Index>(at.size());
  point.value = -at.background_per_ns * exposure.seen_ns;
  point.gradient.setZero(size);
  point.hessian.setZero(size, size);
  point.gradient[size - 1] = -exposure.seen_ns;
  for (std::size_t k = 0; k < at.count; ++k) {
    const TargetParameters& target = at.targets.at(k);
    const double A = exposure.amplitude;
    const double one_less_g = 1 - target.line.travel_ns / exposure.length_ns;
    const auto d = static_cast<Eigen::Index>(3 * k);
    point.value -= target.signal_per_pulse * A * one_less_g;
    point.gradient[d + 1] += target.signal_per_pulse * A / exposure.length_ns;
    point.gradient[d + 2] -= A * one_less_g;
    point.hessian(d + 1, d + 2) += A / exposure.length_ns;
  }
}

void JointLikelihood::evaluate(const Exposure& exposure, const JointParameters& at,
                               JointPoint& point) {
  load(exposure, at);
  start(exposure, at, point);
  const std::size_t dark = photons_ - index_.size();  // photons of the background alone
  LogSum logs;
  Sums sums;
  for (std::size_t k = 0; k < at.count; ++k) add_alone(k, at, logs, sums);
  std::size_t next = alone_end_.at(at.count - 1);
  for (std::size_t pair = 0; pair < pairs_; ++pair) {
    add_shared(shared_.at(pair), at, logs, sums);
    next = shared_.at(pair).last;
  }
  for (; next < index_.size(); ++next) add_any(next, at, logs, sums);
  if (dark > 0) {
    const auto n = static_cast<double>(dark);
    point.value += n * std::log(at.background_per_ns);
    sums.background += n / at.background_per_ns;
    sums.background_squares += n / (at.background_per_ns * at.background_per_ns);
  }
  point.value += logs.value();
  add(sums, at.count, point);
  point.hessian.triangularView<Eigen::StrictlyLower>() = point.hessian.transpose();
}

// Adds the photons that only one target is near.
void JointLikelihood::add_alone(std::size_t target, const JointParameters& at, LogSum& logs,
                                Sums& sums) const {
  const double b = at.background_per_ns;
  const double S = at.targets.at(target).signal_per_pulse;
  const double o1 = -by_.at(target).dilation;
  const double turn = by_.at(target).turn;
  OfOne own;
  double background = 0, background_squares = 0;
  const std::size_t end = alone_end_.at(target);
  for (std::size_t i = target == 0 ? 0 : alone_end_.at(target - 1); i < end; ++i) {
    double density = 0, g1 = 0, g2 = 0, g11 = 0, g12 = 0, g22 = 0;
    for (std::size_t j = first_[i]; j < first_[i + 1]; ++j) {
      const double a = amplitude_[j];
      const double o2 = o1 * position_[j] + offset_[j] * turn;
      density += a * h_[j];
      g1 += a * d1_[j] * o1;
      g2 += a * d1_[j] * o2;
      g11 += a * d2_[j] * o1 * o1;
      g12 += a * (d2_[j] * o1 * o2 + d1_[j] * o1 * turn);
      g22 += a * (d2_[j] * o2 * o2 + d1_[j] * 2 * turn * o2);
    }
    const double lambda = b + S * density;
    logs.add(lambda);
    const double inverse = 1 / lambda;
    const double weight = S * inverse;
    const double l1 = weight * g1, l2 = weight * g2, l3 = density * inverse;
    background += inverse, background_squares += inverse * inverse;
    own.d1 += l1, own.d2 += l2, own.d3 += l3;
    own.h11 += weight * g11 - l1 * l1;
    own.h12 += weight * g12 - l1 * l2;
    own.h22 += weight * g22 - l2 * l2;
    own.h13 += g1 * inverse - l1 * l3;
    own.h23 += g2 * inverse - l2 * l3;
    own.h33 -= l3 * l3;
    own.h1b -= l1 * inverse, own.h2b -= l2 * inverse, own.h3b -= l3 * inverse;
  }
  sums.of_one.at(target) = own;
  sums.background += background;
  sums.background_squares += background_squares;
}

// Adds a photon that some targets are near.
void JointLikelihood::add_any(std::size_t photon, const JointParameters& at, LogSum& logs,
                              Sums& sums) const {
  std::array<Share, most_targets> shares;
  const std::size_t count = shares_of(photon, at, shares);
  double lambda = at.background_per_ns;
  for (std::size_t n = 0; n < count; ++n) {
    lambda += at.targets[shares[n].target].signal_per_pulse * shares[n].density;
  }
  logs.add(lambda);
  add({shares.data(), count}, at, lambda, sums);
}

// Adds the photons that two targets are near. Most are near one pulse of each.
//
// Design note: as in add_alone(), the sums are local. All is done for both targets side by side, so
// that the compiler takes vectors of two: that is twice as fast as add_any().
void JointLikelihood::add_shared(const Shared& by_two, const JointParameters& at, LogSum& logs,
                                 Sums& sums) const {
  using Two = std::array<double, 2>;
  const double b = at.background_per_ns;
  Two S, o1, turn;
  for (std::size_t t = 0; t < 2; ++t) {
    S[t] = at.targets.at(by_two.targets[t]).signal_per_pulse;
    o1[t] = -by_.at(by_two.targets[t]).dilation;
    turn[t] = by_.at(by_two.targets[t]).turn;
  }
  Two d1{}, d2{}, d3{}, h11{}, h12{}, h22{}, h13{}, h23{}, h33{}, h1b{}, h2b{}, h3b{};
  double c11 = 0, c12 = 0, c13 = 0, c21 = 0, c22 = 0, c23 = 0, c31 = 0, c32 = 0, c33 = 0;
  double background = 0, background_squares = 0;
  for (std::size_t i = by_two.first; i < by_two.last; ++i) {
    const std::size_t j = first_[i];
    if (first_[i + 1] != j + 2) {
      add_any(i, at, logs, sums);
      continue;
    }
    Two density, g1, g2, g11, g12, g22;
    for (std::size_t t = 0; t < 2; ++t) {
      const double a = amplitude_[j + t];
      const double by_1 = a * d1_[j + t], by_2 = a * d2_[j + t];
      const double o2 = o1[t] * position_[j + t] + offset_[j + t] * turn[t];
      density[t] = a * h_[j + t];
      g1[t] = by_1 * o1[t];
      g2[t] = by_1 * o2;
      g11[t] = by_2 * o1[t] * o1[t];
      g12[t] = by_2 * o1[t] * o2 + by_1 * o1[t] * turn[t];
      g22[t] = by_2 * o2 * o2 + by_1 * 2 * turn[t] * o2;
    }
    const double lambda = b + S[0] * density[0] + S[1] * density[1];
    logs.add(lambda);
    const double inverse = 1 / lambda;
    background += inverse, background_squares += inverse * inverse;
    Two l1, l2, l3;
    for (std::size_t t = 0; t < 2; ++t) {
      const double weight = S[t] * inverse;
      l1[t] = weight * g1[t], l2[t] = weight * g2[t], l3[t] = density[t] * inverse;
      d1[t] += l1[t], d2[t] += l2[t], d3[t] += l3[t];
      h11[t] += weight * g11[t] - l1[t] * l1[t];
      h12[t] += weight * g12[t] - l1[t] * l2[t];
      h22[t] += weight * g22[t] - l2[t] * l2[t];
      h13[t] += g1[t] * inverse - l1[t] * l3[t];
      h23[t] += g2[t] * inverse - l2[t] * l3[t];
      h33[t] += l3[t] * l3[t];
      h1b[t] += l1[t] * inverse, h2b[t] += l2[t] * inverse, h3b[t] += l3[t] * inverse;
    }
    c11 += l1[0] * l1[1], c12 += l1[0] * l2[1], c13 += l1[0] * l3[1];
    c21 += l2[0] * l1[1], c22 += l2[0] * l2[1], c23 += l2[0] * l3[1];
    c31 += l3[0] * l1[1], c32 += l3[0] * l2[1], c33 += l3[0] * l3[1];
  }
  sums.background += background;
  sums.background_squares += background_squares;
  for (std::size_t t = 0; t < 2; ++t) {
    OfOne& own = sums.of_one.at(by_two.targets[t]);
    own.d1 += d1[t], own.d2 += d2[t], own.d3 += d3[t];
    own.h11 += h11[t], own.h12 += h12[t], own.h22 += h22[t];
    own.h13 += h13[t], own.h23 += h23[t], own.h33 -= h33[t];
    own.h1b -= h1b[t], own.h2b -= h2b[t], own.h3b -= h3b[t];
  }
  auto& cross = sums.cross.at(by_two.targets[0]).at(by_two.targets[1]);
  const std::array<double, 9> products = {c11, c12, c13, c21, c22, c23, c31, c32, c33};
  for (std::size_t n = 0; n < products.size(); ++n) cross[n] -= products[n];
}

double JointLikelihood::value(const Exposure& exposure, const JointParameters& at) {
  load(exposure, at);
  LogSum logs;
  for (std::size_t i = 0; i < index_.size(); ++i) {
    double lambda = at.background_per_ns;
    for (std::size_t j = first_[i]; j < first_[i + 1]; ++j) {
      lambda += at.targets[target_[j]].signal_per_pulse * amplitude_[j] * h_[j];
    }
    logs.add(lambda);
  }
  JointPoint integral;
  start(exposure, at, integral);
  const auto dark = static_cast<double>(photons_ - index_.size());
  return integral.value + logs.value() + (dark > 0 ? dark * std::log(at.background_per_ns) : 0);
}

// The likelihood is concave in the rates, so that Newton's method finds their best. All photons but
// those of the other targets are background at first, which is right where targets are far apart.
double JointLikelihood::best_without(std::size_t target, const Exposure& exposure,
                                     const JointParameters& at) {
  constexpr int rounds = 30;
  // So near the top a parabola says what is left to gain to within some thousandths of a nat.
  constexpr double settled_nats = 0.05;
  constexpr double least_rate_kept = 0.1;  // of a rate in one step, so that it stays above 0
  load(exposure, at);
  RateVector scales = RateVector::Zero(), rates = RateVector::Zero();
  for (std::size_t k = 0; k < at.count; ++k) {
    if (k == target) continue;
    const auto d = static_cast<Eigen::Index>(k);
    rates[d] = at.targets.at(k).signal_per_pulse;
    scales[d] = exposure.amplitude;
  }
  const double others = exposure.amplitude * rates.sum();
  rates[background_rate] = std::max(static_cast<double>(photons_) - others, 1.0) / exposure.seen_ns;
  scales[background_rate] = exposure.seen_ns;
  double best = -std::numeric_limits<double>::infinity();
  RateVector from = rates;
  for (int round = 0; round < rounds; ++round) {
    const RateSums sums = sum_by_rates(rates, target);
    const double value = sums.log_sum - scales.dot(rates);
    if (value < best) {
      rates = (rates + from) / 2;
      continue;
    }
    best = value;
    const RateVector slope = sums.gradient - scales;
    const RateVector step = solution_of_semidefinite(sums.information, slope);
    const double to_gain = slope.dot(step) / 2;
    if (!(to_gain > settled_nats)) return best + std::max(to_gain, 0.0);
    from = rates;
    rates = (rates + step).cwiseMax(least_rate_kept * rates);
  }
  return best;
}

// A rate that no photon speaks for stands alone.
//
// Design note: the photons that only one target is near are by far the most, so that they are
// summed up without a loop, and those that only the target left out is near are not looked at. A
// photon that one more target is near is one of these where that is the target left out.
JointLikelihood::RateSums JointLikelihood::sum_by_rates(const RateVector& rates,
                                                        std::size_t without) const {
  RateSums sums;
  LogSum logs;
  const double b = rates[background_rate];
  std::size_t dark = photons_ - index_.size();
  std::array<OfOneRate, most_targets> of_one;
  for (std::size_t i = 0; i < index_.size(); ++i) {
    std::size_t begin = first_[i];
    std::size_t end = first_[i + 1];
    if (end == begin + 2) {
      if (target_[begin] == without) {
        ++begin;
      } else if (target_[begin + 1] == without) {
        --end;
      }
    }
    if (end == begin + 1) {
      const std::size_t k = target_[begin];
      if (k == without) {
        ++dark;
        continue;
      }
      const double density = amplitude_[begin] * h_[begin];
      const double lambda = b + rates[static_cast<Eigen::Index>(k)] * density;
      logs.add(lambda);
      const double inverse = 1 / lambda;
      const double share = density * inverse;
      of_one[k].share += share;
      of_one[k].share_squares += share * share;
      of_one[k].products += share * inverse;
      of_one[k].background += inverse;
      of_one[k].squares += inverse * inverse;
      continue;
    }
    double lambda = b;
    for (std::size_t j = begin; j < end; ++j) {
      if (target_[j] != without) lambda += rates[target_[j]] * amplitude_[j] * h_[j];
    }
    logs.add(lambda);
    const double inverse = 1 / lambda;
    of_one.front().background += inverse;
    of_one.front().squares += inverse * inverse;
    for (std::size_t j = begin; j < end; ++j) {
      if (target_[j] == without) continue;
      const double share = amplitude_[j] * h_[j] * inverse;
      of_one[target_[j]].share += share;
      of_one[target_[j]].products += share * inverse;
      for (std::size_t n = begin; n < end; ++n) {
        if (target_[n] == without) continue;
        sums.information(target_[j], target_[n]) += share * amplitude_[n] * h_[n] * inverse;
      }
    }
  }
  of_one.front().background += static_cast<double>(dark) / b;
  of_one.front().squares += static_cast<double>(dark) / (b * b);
  for (std::size_t k = 0; k < most_targets; ++k) add(of_one[k], k, sums);
  sums.log_sum = logs.value();
  if (dark > 0) sums.log_sum += static_cast<double>(dark) * std::log(b);
  return sums;
}

void JointLikelihood::add(const OfOneRate& of_one, std::size_t target, RateSums& sums) {
  const auto k = static_cast<Eigen::Index>(target);
  sums.gradient[k] += of_one.share;
  sums.gradient[background_rate] += of_one.background;
  sums.information(k, k) += of_one.share_squares;
  sums.information(k, background_rate) += of_one.products;
  sums.information(background_rate, k) += of_one.products;
  sums.information(background_rate, background_rate) += of_one.squares;
  if (!(sums.information(k, k) > 0)) sums.information(k, k) = 1;
}

void JointLikelihood::thin(const Exposure& exposure, const JointParameters& at,
                           std::span<const bool> stays, std::vector<std::uint8_t>& keeps) {
  load(exposure, at);
  keeps.assign(photons_, 1);
  for (std::size_t i = 0; i < index_.size(); ++i) {
    double all = at.background_per_ns;
    double left = all;
    for (std::size_t j = first_[i]; j < first_[i + 1]; ++j) {
      const std::size_t k = target_[j];
      const double light = at.targets[k].signal_per_pulse * amplitude_[j] * h_[j];
      all += light;
      if (stays[k]) left += light;
    }
    keeps[index_[i]] = lot_of(index_[i]) * all < left ? 1 : 0;
  }
}

double JointLikelihood::count_near(std::size_t target, DelayLine line, double first_ns,
                                   double last_ns) const {
  const NearSet& near = near_[target];
  const double delay_ns = line.delay_ns - near.line.delay_ns;
  const double travel_ns = line.travel_ns - near.line.travel_ns;
  std::size_t count = 0;
  for (std::size_t j = 0; j < near.entries(); ++j) {
    const double offset = near.residual_ns[j] - delay_ns - travel_ns * near.position[j];
    count += offset >= first_ns && offset < last_ns ? 1 : 0;
  }
  return static_cast<double>(count);
}

void JointLikelihood::count_near(std::size_t target, DelayLine line, double first_ns, double bin_ns,
                                 std::span<double> counts) const {
  const NearSet& near = near_[target];
  const double start_ns = line.delay_ns - near.line.delay_ns + first_ns;
  const double travel_ns = line.travel_ns - near.line.travel_ns;
  std::fill(counts.begin(), counts.end(), 0.0);
  for (std::size_t j = 0; j < near.entries(); ++j) {
    const double bin = (near.residual_ns[j] - start_ns - travel_ns * near.position[j]) / bin_ns;
    if (bin >= 0 && bin < static_cast<double>(counts.size())) {
      counts[static_cast<std::size_t>(bin)] += 1;
    }
  }
}

JointLikelihood::Moments JointLikelihood::moments_near(std::size_t target, DelayLine line,
                                                       double reach_ns) const {
  const NearSet& near = near_[target];
  const double delay_ns = line.delay_ns - near.line.delay_ns + shape_.peak_offset_ns();
  const double travel_ns = line.travel_ns - near.line.travel_ns;
  Moments sums;
  for (std::size_t j = 0; j < near.entries(); ++j) {
    const double s = near.position[j];
    const double o = near.residual_ns[j] - delay_ns - travel_ns * s;
    if (std::abs(o) > reach_ns) continue;
    sums.photons += 1;
    sums.o += o;
    sums.os += o * s;
    sums.oo += o * o;
    sums.oos += o * o * s;
    sums.ooss += o * o * s * s;
  }
  return sums;
}

}  // namespace splid
