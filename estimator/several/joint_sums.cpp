#include "estimator/several/joint_likelihood.hpp"

// The sums over the photons of log lambda and its derivatives.

namespace splid {
namespace {

// A target whose light is so small a part of the background's has no say in a photon.
constexpr double least_share = 1e-13;

}  // namespace

// The targets' densities at a batch of photons, in the order of the group's targets, and the
// intensity there. Beyond the batch's end, the densities are 0. signals: of each target.
void JointLikelihood::densities(const Batch& of, std::span<const double> signals, double background,
                                Columns& density, Column& lambda) const {
  lambda.setConstant(background);
  for (std::size_t t = 0; t < of.group.target_count; ++t) {
    Column& own = density[t];
    if (of.count < batch) own.setZero();
    const double S = signals[of.group.targets[t]];
    const std::size_t j = of.group.entries_of(t) + of.first;
    for (std::size_t i = 0; i < of.count; ++i) {
      own.coeffRef(static_cast<Eigen::Index>(i)) = several_.amplitude[j + i] * h_[j + i];
    }
    lambda += S * own;
  }
}

// Adds log lambda of a batch of photons and its derivatives.
//
// Design note: the first derivatives lie in columns, one for each parameter, and the second ones
// are sums of products of two columns, over vectors. To add each photon's products to sums, one
// photon after the other, waits for the memory that the photon before it wrote.
void JointLikelihood::add_batch(const Batch& of, const JointParameters& at, LogSum& logs,
                                Sums& sums) const {
  const std::size_t targets = of.group.target_count;
  Columns density;
  Column lambda, inverse;
  const std::array<double, most_targets> signals = at.signals();
  densities(of, signals, at.background_per_ns, density, lambda);
  if (of.count < batch) inverse.setZero();
  for (std::size_t i = 0; i < of.count; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    logs.add(lambda.coeff(n));
    inverse.coeffRef(n) = 1 / lambda.coeff(n);
  }
  sums.background += inverse.sum();
  sums.background_squares += (inverse * inverse).sum();
  std::array<Slopes, most_targets> slopes;
  for (std::size_t t = 0; t < targets; ++t) {
    const std::size_t k = of.group.targets[t];
    OfOne& own = sums.of_one[k];
    add_curved(of, t, signals[k], inverse, density[t], slopes[t], own);
    const auto& [l1, l2, l3] = slopes[t];
    own.d1 += l1.sum(), own.d2 += l2.sum(), own.d3 += l3.sum();
    own.h11 -= (l1 * l1).sum(), own.h12 -= (l1 * l2).sum(), own.h22 -= (l2 * l2).sum();
    own.h13 -= (l1 * l3).sum(), own.h23 -= (l2 * l3).sum(), own.h33 -= (l3 * l3).sum();
    own.h1b -= (l1 * inverse).sum(), own.h2b -= (l2 * inverse).sum();
    own.h3b -= (l3 * inverse).sum();
    for (std::size_t m = 0; m < t; ++m) {
      auto& cross = sums.cross[of.group.targets[m]][k];
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
          cross[3 * r + c] -= (slopes[m][r] * slopes[t][c]).sum();
        }
      }
    }
  }
}

// The first derivatives of log lambda by one target's parameters, and the sums of what lambda's own
// second derivatives add to those of log lambda. See shares_of() for the offsets' derivatives.
void JointLikelihood::add_curved(const Batch& of, std::size_t t, double S, const Column& inverse,
                                 const Column& density, Slopes& slopes, OfOne& own) const {
  const auto& [dilation, turn] = by_[of.group.targets[t]];
  const double o1 = -dilation;
  const std::size_t j = of.group.entries_of(t) + of.first;
  Column g1, g2, g12, g22, g11;
  if (of.count < batch) {
    for (Column* column : {&g1, &g2, &g11, &g12, &g22}) column->setZero();
  }
  for (std::size_t i = 0; i < of.count; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const double a = several_.amplitude[j + i] * inverse.coeff(n);
    const double by_1 = a * d1_[j + i], by_2 = a * d2_[j + i];
    const double o2 = o1 * several_.position[j + i] + offset_[j + i] * turn;
    g1.coeffRef(n) = by_1 * o1;
    g2.coeffRef(n) = by_1 * o2;
    g11.coeffRef(n) = by_2 * o1 * o1;
    g12.coeffRef(n) = by_2 * o1 * o2 + by_1 * o1 * turn;
    g22.coeffRef(n) = by_2 * o2 * o2 + by_1 * 2 * turn * o2;
  }
  own.h11 += S * g11.sum(), own.h12 += S * g12.sum(), own.h22 += S * g22.sum();
  own.h13 += g1.sum(), own.h23 += g2.sum();
  slopes = {S * g1, S * g2, density * inverse};
}

// Each target's density at a photon and its derivatives by delay (1) and travel (2); see
// Likelihood::evaluate(). Targets that do not matter to the photon are left out.
std::size_t JointLikelihood::shares_of(std::size_t photon, const JointParameters& at,
                                       std::array<Share, most_targets>& shares) const {
  std::size_t count = 0;
  const NearSeveral::Entries entries = several_.crowded(photon);
  for (std::size_t begin = entries.begin, end = begin; begin < entries.end; begin = end) {
    const std::size_t k = several_.target[begin];
    Share& share = shares[count];
    share = {k};
    for (; end < entries.end && several_.target[end] == k; ++end) {
      share.density += several_.amplitude[end] * h_[end];
    }
    if (at.targets[k].signal_per_pulse * share.density <= least_share * at.background_per_ns) {
      continue;
    }
    const double dilation = by_[k].dilation;
    const double turn = by_[k].turn;
    for (std::size_t j = begin; j < end; ++j) {
      const double a = several_.amplitude[j];
      const double o1 = -dilation;
      const double o2 = -dilation * several_.position[j] + offset_[j] * turn;
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

// Adds a photon that is near several pulses of a target.
void JointLikelihood::add_crowded(std::size_t photon, const JointParameters& at, LogSum& logs,
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

}  // namespace splid
