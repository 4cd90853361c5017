#pragma once

#include <vector>

#include "estimator/paper/train_photons.hpp"

namespace splid::paper {

// Where on a circle of period_ns the most weight lies within width_ns.
struct Cluster {
  double begin_ns = 0;   // in [0, period)
  double weight = 0;     // of all points in [begin, begin + width]
  double middle_ns = 0;  // their mean, in [0, period)
};

// points_ns: in [0, period_ns), one weight each. Threads: any.
Cluster find_largest_cluster(const std::vector<double>& points_ns,
                             const std::vector<double>& weights, double period_ns, double width_ns);

// Leaves only the photons of the largest cluster of T mod t_k: in an interleaved pattern a target's
// photons from the pulses of another sub-period lie at many places of this one's, and those of its
// own at one ([P], initialisation of the interleaved mode). width_ns must hold the target's motion.
//
// What the train counted stays: its background is that of the whole period.
void keep_largest_cluster(TrainPhotons& photons, double width_ns);

}  // namespace splid::paper
