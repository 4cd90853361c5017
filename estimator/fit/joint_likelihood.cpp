#include "estimator/fit/joint_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fit/log_sum.hpp"

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

// Each target's photons ascend, so that merging their rows gives each photon once.
void JointLikelihood::merge(std::size_t targets) {
  for (auto* values : {&residual_, &position_, &amplitude_}) values->clear();
  for (auto* values : {&index_, &first_}) values->clear();
  target_.clear();
  loaded_.count = 0;
  std::array<std::size_t, most_targets> next{};
  while (true) {
    std::uint32_t photon = std::numeric_limits<std::uint32_t>::max();
    for (std::size_t k = 0; k < targets; ++k) {
      if (next.at(k) < near_[k].index.size()) photon = std::min(photon, near_[k].index[next.at(k)]);
    }
    first_.push_back(static_cast<std::uint32_t>(residual_.size()));
    if (photon == std::numeric_limits<std::uint32_t>::max()) return;
    index_.push_back(photon);
    for (std::size_t k = 0; k < targets; ++k) {
      const NearSet& near = near_[k];
      std::size_t& n = next.at(k);
      if (n == near.index.size() || near.index[n] != photon) continue;
      for (std::size_t j = near.first[n]; j < near.first[n + 1]; ++j) {
        target_.push_back(static_cast<std::uint8_t>(k));
        residual_.push_back(near.residual_ns[j]);
        position_.push_back(near.position[j]);
        amplitude_.push_back(near.amplitude[j]);
      }
      ++n;
    }
  }
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
    Share share{k};
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
    shares.at(count++) = share;
  }
  return count;
}

void JointLikelihood::add(const Share& share, double S, double lambda, OfOne& sums) {
  const double inverse = 1 / lambda;
  const double weight = S * inverse;
  const double l1 = weight * share.g1, l2 = weight * share.g2, l3 = share.density * inverse;
  sums.gradient += Eigen::Vector4d(l1, l2, l3, inverse);
  Eigen::Matrix4d& H = sums.hessian;
  H(0, 0) += weight * share.g11 - l1 * l1;
  H(0, 1) += weight * share.g12 - l1 * l2;
  H(1, 1) += weight * share.g22 - l2 * l2;
  H(0, 2) += share.g1 * inverse - l1 * l3;
  H(1, 2) += share.g2 * inverse - l2 * l3;
  H(2, 2) -= l3 * l3;
  H(0, 3) -= l1 * inverse;
  H(1, 3) -= l2 * inverse;
  H(2, 3) -= l3 * inverse;
  H(3, 3) -= inverse * inverse;
}

// A photon that several targets have a share in.
void JointLikelihood::add(std::span<const Share> shares, const JointParameters& at, double lambda,
                          JointPoint& point) {
  const double inverse = 1 / lambda;
  const auto b = static_cast<Eigen::Index>(at.size() - 1);
  JointVector& g = point.gradient;
  JointMatrix& H = point.hessian;
  std::array<Eigen::Vector3d, most_targets> by;
  for (std::size_t n = 0; n < shares.size(); ++n) {
    const Share& share = shares[n];
    const double S = at.targets.at(share.target).signal_per_pulse;
    const auto d = static_cast<Eigen::Index>(3 * share.target);
    by.at(n) = Eigen::Vector3d(S * share.g1, S * share.g2, share.density) * inverse;
    const Eigen::Vector3d& l = by.at(n);
    g.segment<3>(d) += l;
    H(d, d) += S * share.g11 * inverse;
    H(d, d + 1) += S * share.g12 * inverse;
    H(d + 1, d + 1) += S * share.g22 * inverse;
    H(d, d + 2) += share.g1 * inverse;
    H(d + 1, d + 2) += share.g2 * inverse;
    H.block<3, 1>(d, b) -= l * inverse;
    for (std::size_t m = 0; m <= n; ++m) {
      const auto c = static_cast<Eigen::Index>(3 * shares[m].target);
      H.block<3, 3>(c, d) -= by.at(m) * l.transpose();
    }
  }
  g[b] += inverse;
  H(b, b) -= inverse * inverse;
}

void JointLikelihood::add(const OfOne& sums, std::size_t target, JointPoint& point) {
  const Eigen::Index b = point.gradient.size() - 1;
  const auto d = static_cast<Eigen::Index>(3 * target);
  point.gradient.segment<3>(d) += sums.gradient.head<3>();
  point.gradient[b] += sums.gradient[3];
  point.hessian.block<3, 3>(d, d) += sums.hessian.topLeftCorner<3, 3>();
  point.hessian.block<3, 1>(d, b) += sums.hessian.topRightCorner<3, 1>();
  point.hessian(b, b) += sums.hessian(3, 3);
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
  std::size_t dark = photons_ - index_.size();  // photons of the background alone
  LogSum logs;
  std::array<OfOne, most_targets> of_one;
  std::array<Share, most_targets> shares;
  for (std::size_t i = 0; i < index_.size(); ++i) {
    const std::size_t count = shares_of(i, at, shares);
    if (count == 0) {
      ++dark;
      continue;
    }
    double lambda = at.background_per_ns;
    for (std::size_t n = 0; n < count; ++n) {
      lambda += at.targets.at(shares.at(n).target).signal_per_pulse * shares.at(n).density;
    }
    logs.add(lambda);
    const std::size_t k = shares.front().target;
    if (count == 1) {
      add(shares.front(), at.targets.at(k).signal_per_pulse, lambda, of_one.at(k));
    } else {
      add({shares.data(), count}, at, lambda, point);
    }
  }
  point.value += logs.value();
  for (std::size_t k = 0; k < at.count; ++k) add(of_one.at(k), k, point);
  if (dark > 0) {
    const auto n = static_cast<double>(dark);
    const Eigen::Index b = point.gradient.size() - 1;
    point.value += n * std::log(at.background_per_ns);
    point.gradient[b] += n / at.background_per_ns;
    point.hessian(b, b) -= n / (at.background_per_ns * at.background_per_ns);
  }
  point.hessian.triangularView<Eigen::StrictlyLower>() = point.hessian.transpose();
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

// The photons of each target and of the background are shared out by their intensities, and
// their sums are the next intensities, round by round (expectation maximisation). The value only
// grows, and the rates of targets that hardly overlap are right after a few rounds.
double JointLikelihood::best_without(std::size_t target, const Exposure& exposure,
                                     const JointParameters& at) {
  constexpr int rounds = 30;
  constexpr double settled = 0.01;  // deviations of a target's photons: 1e-4 nats
  load(exposure, at);
  const double A = exposure.amplitude;
  std::array<double, most_targets> signals{};
  for (std::size_t k = 0; k < at.count; ++k) {
    if (k != target) signals.at(k) = at.targets.at(k).signal_per_pulse;
  }
  double value = 0;
  for (int round = 0; round < rounds; ++round) {
    double background = static_cast<double>(photons_);
    for (const double S : signals) background -= S * A;
    const SharedOut shared = share_out(signals, background / exposure.seen_ns, target);
    value = shared.log_sum - static_cast<double>(photons_);
    double change = 0;
    for (std::size_t k = 0; k < at.count; ++k) {
      const double before = signals.at(k) * A;
      change = std::max(change, std::abs(shared.photons.at(k) - before) / std::sqrt(1 + before));
      signals.at(k) = shared.photons.at(k) / A;
    }
    if (change < settled) break;
  }
  return value;
}

// Design note: the photons that only one target is near are by far the most, so that they are
// shared out without a loop, and those that only the target left out is near are not looked at.
JointLikelihood::SharedOut JointLikelihood::share_out(
    const std::array<double, most_targets>& signals, double background_per_ns,
    std::size_t without) const {
  SharedOut shared;
  LogSum logs;
  std::size_t dark = photons_ - index_.size();
  for (std::size_t i = 0; i < index_.size(); ++i) {
    const std::size_t begin = first_[i];
    const std::size_t end = first_[i + 1];
    if (end == begin + 1) {
      const std::size_t k = target_[begin];
      if (k == without) {
        ++dark;
        continue;
      }
      const double light = signals[k] * amplitude_[begin] * h_[begin];
      const double lambda = background_per_ns + light;
      logs.add(lambda);
      shared.photons[k] += light / lambda;
      continue;
    }
    double lambda = background_per_ns;
    for (std::size_t j = begin; j < end; ++j) lambda += signals[target_[j]] * amplitude_[j] * h_[j];
    logs.add(lambda);
    const double inverse = 1 / lambda;
    for (std::size_t j = begin; j < end; ++j) {
      shared.photons[target_[j]] += signals[target_[j]] * amplitude_[j] * h_[j] * inverse;
    }
  }
  shared.log_sum = logs.value();
  if (dark > 0) shared.log_sum += static_cast<double>(dark) * std::log(background_per_ns);
  return shared;
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

double JointLikelihood::count_near(std::size_t target, double first_ns, double last_ns) const {
  const std::vector<double>& residuals = near_[target].residual_ns;
  return static_cast<double>(
      std::count_if(residuals.begin(), residuals.end(),
                    [&](double residual) { return residual >= first_ns && residual < last_ns; }));
}

}  // namespace splid
