#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fit/fit.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/likelihood/log_sum.hpp"
#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/several/near_sets.hpp"
#include "estimator/several/near_several.hpp"

namespace splid {

// One of several targets: the line of its photons, and S in counts for a pulse of amplitude 1.
struct TargetParameters {
  DelayLine line;
  double signal_per_pulse = 0;
};

// What the likelihood of several targets depends on. As numbers in a row, in gradients and
// matrices, they are each target's delay, travel and signal (units: ns, ns, counts a pulse), and
// last the background (counts a ns).
struct JointParameters {
  std::array<TargetParameters, most_targets> targets;
  std::size_t count = 0;         // targets
  double background_per_ns = 0;  // > 0 where a photon is near none of the targets

  [[nodiscard]] std::size_t size() const { return 3 * count + 1; }
  void add(const TargetParameters& target) { targets.at(count++) = target; }
  // Of each target, and 0 where there is none.
  [[nodiscard]] std::array<double, most_targets> signals() const {
    std::array<double, most_targets> all{};
    for (std::size_t k = 0; k < count; ++k) all.at(k) = targets.at(k).signal_per_pulse;
    return all;
  }
};

struct JointPoint {
  double value = 0;  // nats
  SmallVector gradient;
  SmallMatrix hessian;
};

// The log-likelihood of a frame with several targets,
//   l = -integral lambda + sum over photons of log lambda,
//   lambda = b + sum_k S_k sum_p a_p h about the pulses of target k
// with its exact first and second derivatives. With one target it is that of Likelihood. It knows
// no dead time.
//
// Threads: one thread for each object, which holds scratch. Errors: none. No allocation after
// construction for frames of up to max_photons.
class JointLikelihood {
 public:
  // margin_ns: how far a line's ends may move from where collect() saw it.
  JointLikelihood(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                  double margin_ns);

  // Takes the photons that are near any of the targets' lines.
  void collect(const FoldedFrame& frame, const JointParameters& about);
  // The same, but leaves the photons of the lines that they still serve for. The frame is that of
  // the last collect() or forget().
  void hold(const FoldedFrame& frame, const JointParameters& about);
  // Another frame comes next.
  void forget();
  // Whether what was collected last serves for these targets: no end of a line is more than the
  // margin away from where it was seen.
  [[nodiscard]] bool serves(const JointParameters& at) const;
  // at: as many targets as collect() was given, in the same order.
  void evaluate(const Exposure& exposure, const JointParameters& at, JointPoint& point);
  // The value alone.
  double value(const Exposure& exposure, const JointParameters& at);
  // The value without one of the targets, with the lines of the others as they are, and with the
  // signals and the background at which it is highest; to within some thousandths of a nat, or a
  // ten-thousandth of its difference from value_of_all, the value with all targets.
  double best_without(std::size_t target, const Exposure& exposure, const JointParameters& at,
                      double value_of_all);
  // Chooses photons so that what is left of the frame is as if some of the targets were not there:
  // a photon stays with the share that the others and the background have in its intensity. Which
  // photons those are is drawn by lots that hang on the frame's photons alone. Each photon of the
  // frame gets a number: its bit k says whether the photon stays where target k alone does, and its
  // bit stays_without_any whether it stays where none does.
  void thin(const Exposure& exposure, const JointParameters& at, std::vector<std::uint8_t>& stays);
  static constexpr unsigned stays_without_any = most_targets;

  // The photons whose offset from the pulses of a target at `line` is in [first_ns, last_ns).
  // target: one about whose line, or one nearby, the photons have been collected.
  [[nodiscard]] double count_near(std::size_t target, DelayLine line, double first_ns,
                                  double last_ns) const;
  // The same, in bins one after the other. bin_ns: below 0 where the bins go down.
  void count_near(std::size_t target, DelayLine line, double first_ns, double bin_ns,
                  std::span<double> counts) const;
  // Sums over the photons whose offset o from the pulses of a target at `line` is no more than
  // reach_ns, in the second half's terms with s the place in the frame, from -1/2 to 1/2.
  struct Moments {
    double photons = 0, o = 0, os = 0, oo = 0, oos = 0, ooss = 0;
  };
  [[nodiscard]] Moments moments_near(std::size_t target, DelayLine line, double reach_ns) const;
  // The photons that have been collected about a target.
  [[nodiscard]] const NearSet& near(std::size_t target) const { return *near_.at(target); }

 private:
  // Four targets, and two others in the places of two of them.
  static constexpr std::size_t kept_sets = most_targets + 2;
  // So many photons are summed up together, so that the sums are over vectors.
  static constexpr std::size_t batch = 64;
  using Column = Eigen::Array<double, static_cast<int>(batch), 1>;
  using Columns = std::array<Column, most_targets>;
  struct Share {  // of one target in the intensity at one photon
    std::size_t target = 0;
    double density = 0, g1 = 0, g2 = 0, g11 = 0, g12 = 0, g22 = 0;
  };
  struct Stretching {  // of a target's pattern by its travel; see Likelihood::evaluate()
    double dilation = 1, turn = 0;
  };
  // Sums over the photons of the first and second derivatives of log lambda: by a target's delay
  // (1), travel (2) and signal (3), and by the background (b).
  struct OfOne {
    double d1 = 0, d2 = 0, d3 = 0, h11 = 0, h12 = 0, h22 = 0, h13 = 0, h23 = 0, h33 = 0;
    double h1b = 0, h2b = 0, h3b = 0;
  };
  struct Sums {
    std::array<OfOne, most_targets> of_one;
    // Of two targets, the first one's parameters row by row.
    std::array<std::array<std::array<double, 9>, most_targets>, most_targets> cross{};
    double background = 0, background_squares = 0;
  };
  // The first derivatives of log lambda of a batch of photons, by a target's parameters.
  using Slopes = std::array<Column, 3>;
  // Some photons of a group.
  struct Batch {
    const NearSeveral::Group& group;
    std::size_t first, count;  // photons, from the group's first on
  };
  // Visits the photons of all groups.
  template <class Visit>
  void visit_batches(const Visit& visit) const {
    for (const NearSeveral::Group& group : several_.groups()) {
      for (std::size_t first = 0; first < group.photons(); first += batch) {
        visit(Batch{group, first, std::min(batch, group.photons() - first)});
      }
    }
  }
  void densities(const Batch& of, std::span<const double> signals, double background,
                 Columns& density, Column& lambda) const;
  void add_batch(const Batch& of, const JointParameters& at, LogSum& logs, Sums& sums) const;
  void add_curved(const Batch& of, std::size_t t, double S, const Column& inverse,
                  const Column& density, Slopes& slopes, OfOne& own) const;
  // The rates alone: the signal of each target, and last the background.
  static constexpr Eigen::Index background_rate = most_targets;
  using RateVector = Eigen::Matrix<double, most_targets + 1, 1>;
  // Sums over the photons, of the logarithms of their intensities and of the derivatives.
  struct RateSums {
    double log_sum = 0;
    RateVector gradient = RateVector::Zero();
    Eigen::Matrix<double, most_targets + 1, most_targets + 1> information =
        Eigen::Matrix<double, most_targets + 1, most_targets + 1>::Zero();

    void add(Eigen::Index one, Eigen::Index other, double product) {
      information(one, other) += product;
      information(other, one) += product;
    }
  };
  [[nodiscard]] RateSums sum_by_rates(const RateVector& rates, std::size_t without) const;
  void add_batch_rates(const Batch& of, const RateVector& rates, std::size_t without, LogSum& logs,
                       RateSums& sums) const;
  void add_crowded_rates(std::size_t photon, const RateVector& rates, std::size_t without,
                         LogSum& logs, RateSums& sums) const;
  [[nodiscard]] bool is_loaded(const JointParameters& at) const;
  void load(const Exposure& exposure, const JointParameters& at);
  void start(const Exposure& exposure, const JointParameters& at, JointPoint& point) const;
  [[nodiscard]] double crowded_light(std::size_t entry, const JointParameters& at) const;
  std::size_t shares_of(std::size_t photon, const JointParameters& at,
                        std::array<Share, most_targets>& shares) const;
  void add_crowded(std::size_t photon, const JointParameters& at, LogSum& logs, Sums& sums) const;
  static void add(std::span<const Share> shares, const JointParameters& at, double lambda,
                  Sums& sums);
  static void add(const Sums& sums, std::size_t targets, JointPoint& point);

  const PulseShape& shape_;
  const PulseTrain& train_;
  double margin_ns_;
  std::vector<CombWindow> windows_;
  NearSets sets_;
  std::array<const NearSet*, most_targets> near_{};  // of each target; nullptr: of none
  std::size_t photons_ = 0;                          // of the frame
  NearSeveral several_;  // the photons of all of near_, where is_sorted_
  bool is_sorted_ = false;
  std::vector<double> offset_, h_, d1_, d2_;   // scratch: one value for each entry
  std::array<Stretching, most_targets> by_{};  // at what was loaded last
  JointParameters loaded_;  // the lines that the scratch is for; no targets: of none
};

}  // namespace splid
