#include "estimator/several/joint_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

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

}  // namespace

JointLikelihood::JointLikelihood(const PulseShape& shape, const PulseTrain& train,
                                 std::size_t max_photons, double margin_ns)
    : shape_(shape),
      train_(train),
      margin_ns_(margin_ns),
      windows_(
          comb_windows(train, shape.first_ns() - 2 * margin_ns, shape.last_ns() + 2 * margin_ns)),
      sets_(kept_sets, max_photons, max_photons * widest_overlap(windows_)),
      several_(max_photons, most_targets * max_photons * widest_overlap(windows_)) {
  const std::size_t of_one = max_photons * widest_overlap(windows_);
  for (auto* values : {&offset_, &h_, &d1_, &d2_}) values->reserve(most_targets * of_one);
}

void JointLikelihood::collect(const FoldedFrame& frame, const JointParameters& about) {
  forget();
  hold(frame, about);
}

void JointLikelihood::forget() {
  near_.fill(nullptr);
  sets_.forget();
}

void JointLikelihood::hold(const FoldedFrame& frame, const JointParameters& about) {
  if (serves(about)) return;
  photons_ = frame.size();
  near_.fill(nullptr);
  for (std::size_t k = 0; k < about.count; ++k) {
    near_.at(k) = &sets_.about(frame, windows_, train_, about.targets.at(k).line, margin_ns_);
  }
  is_sorted_ = false;
  loaded_.count = 0;
}

bool JointLikelihood::serves(const JointParameters& at) const {
  for (std::size_t k = 0; k < near_.size(); ++k) {
    if ((near_.at(k) != nullptr) != (k < at.count)) return false;
    if (k < at.count &&
        NearSets::ends_apart_ns(near_.at(k)->line, at.targets.at(k).line) > margin_ns_) {
      return false;
    }
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
  if (!is_sorted_) several_.sort(std::span(near_).first(at.count), photons_);
  is_sorted_ = true;
  loaded_ = at;
  std::array<double, most_targets> delay{}, travel{};
  for (std::size_t k = 0; k < at.count; ++k) {
    const DelayLine& line = at.targets.at(k).line;
    delay.at(k) = line.delay_ns - near_.at(k)->line.delay_ns;
    travel.at(k) = line.travel_ns - near_.at(k)->line.travel_ns;
    const double one_less_g = 1 - line.travel_ns / exposure.length_ns;
    by_.at(k) = {exposure.scale / one_less_g, 1 / (one_less_g * exposure.length_ns)};
  }
  const std::size_t count = several_.residual_ns.size();
  for (auto* scratch : {&offset_, &h_, &d1_, &d2_}) scratch->resize(count);
  const auto load_entries = [&](std::size_t begin, std::size_t end, std::size_t k) {
    for (std::size_t j = begin; j < end; ++j) {
      offset_[j] =
          (several_.residual_ns[j] - delay[k] - travel[k] * several_.position[j]) * by_[k].dilation;
    }
  };
  std::size_t crowded = 0;
  for (const NearSeveral::Group& group : several_.groups()) {
    for (std::size_t t = 0; t < group.target_count; ++t) {
      crowded = group.entries_of(t + 1);
      load_entries(group.entries_of(t), crowded, group.targets[t]);
    }
  }
  for (std::size_t j = crowded; j < count; ++j) load_entries(j, j + 1, several_.target[j]);
  shape_.evaluate(offset_, {h_, d1_, d2_});
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
  LogSum logs;
  Sums sums;
  visit_batches([&](const Batch& of) { add_batch(of, at, logs, sums); });
  const std::size_t near = several_.index().size();
  for (std::size_t i = several_.first_crowded(); i < near; ++i) add_crowded(i, at, logs, sums);
  if (const std::size_t dark = photons_ - near; dark > 0) {  // photons of the background alone
    const auto n = static_cast<double>(dark);
    point.value += n * std::log(at.background_per_ns);
    sums.background += n / at.background_per_ns;
    sums.background_squares += n / (at.background_per_ns * at.background_per_ns);
  }
  point.value += logs.value();
  add(sums, at.count, point);
  point.hessian.triangularView<Eigen::StrictlyLower>() = point.hessian.transpose();
}

double JointLikelihood::value(const Exposure& exposure, const JointParameters& at) {
  load(exposure, at);
  LogSum logs;
  Columns density;
  Column lambda;
  const std::array<double, most_targets> signals = at.signals();
  visit_batches([&](const Batch& of) {
    densities(of, signals, at.background_per_ns, density, lambda);
    for (std::size_t i = 0; i < of.count; ++i) logs.add(lambda.coeff(static_cast<Eigen::Index>(i)));
  });
  const std::size_t near = several_.index().size();
  for (std::size_t i = several_.first_crowded(); i < near; ++i) {
    double all = at.background_per_ns;
    const auto [begin, end] = several_.crowded(i);
    for (std::size_t j = begin; j < end; ++j) all += crowded_light(j, at);
    logs.add(all);
  }
  JointPoint integral;
  start(exposure, at, integral);
  const auto dark = static_cast<double>(photons_ - near);
  return integral.value + logs.value() + (dark > 0 ? dark * std::log(at.background_per_ns) : 0);
}

// What a target has in the intensity at a crowded photon by one of its pulses.
double JointLikelihood::crowded_light(std::size_t entry, const JointParameters& at) const {
  return at.targets[several_.target[entry]].signal_per_pulse * several_.amplitude[entry] *
         h_[entry];
}

void JointLikelihood::thin(const Exposure& exposure, const JointParameters& at,
                           std::vector<std::uint8_t>& stays) {
  load(exposure, at);
  stays.assign(photons_, 0xff);
  const std::span<const std::uint32_t> index = several_.index();
  const auto draw = [&](std::uint32_t photon, const std::array<double, most_targets>& light) {
    const double b = at.background_per_ns;
    const double lot = lot_of(photon) * std::accumulate(light.begin(), light.end(), b);
    unsigned bits = lot < b ? 1U << stays_without_any : 0;
    for (std::size_t k = 0; k < light.size(); ++k) bits |= lot < b + light[k] ? 1U << k : 0;
    stays[photon] = static_cast<std::uint8_t>(bits);
  };
  for (const NearSeveral::Group& group : several_.groups()) {
    for (std::size_t i = 0; i < group.photons(); ++i) {
      std::array<double, most_targets> light{};
      for (std::size_t t = 0; t < group.target_count; ++t) {
        const std::size_t j = group.entries_of(t) + i;
        const std::size_t k = group.targets[t];
        light[k] = at.targets[k].signal_per_pulse * several_.amplitude[j] * h_[j];
      }
      draw(index[group.first + i], light);
    }
  }
  for (std::size_t i = several_.first_crowded(); i < index.size(); ++i) {
    std::array<double, most_targets> light{};
    const auto [begin, end] = several_.crowded(i);
    for (std::size_t j = begin; j < end; ++j) light[several_.target[j]] += crowded_light(j, at);
    draw(index[i], light);
  }
}

double JointLikelihood::count_near(std::size_t target, DelayLine line, double first_ns,
                                   double last_ns) const {
  const NearSet& near = *near_[target];
  const double delay_ns = line.delay_ns - near.line.delay_ns;
  const double travel_ns = line.travel_ns - near.line.travel_ns;
  std::size_t count = 0;
  for (std::size_t j = 0; j < near.entries(); ++j) {
    const double offset = near.residual_ns[j] - delay_ns - travel_ns * near.position[j];
    // Both are compared in any case, so that this is a loop over vectors.
    count +=
        static_cast<std::size_t>(offset >= first_ns) & static_cast<std::size_t>(offset < last_ns);
  }
  return static_cast<double>(count);
}

void JointLikelihood::count_near(std::size_t target, DelayLine line, double first_ns, double bin_ns,
                                 std::span<double> counts) const {
  const NearSet& near = *near_[target];
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
  const NearSet& near = *near_[target];
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
