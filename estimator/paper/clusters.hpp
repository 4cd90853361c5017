#pragma once

#include <vector>

#include "estimator/paper/train_photons.hpp"

namespace splid::paper {

// The place on a circle of period_ns where the most weight lies within width_ns.
struct Cluster {
  double begin_ns = 0;   // in [0, period)
  double weight = 0;     // of all points in [begin, begin + width]
  double middle_ns = 0;  // their mean, in [0, period)
};

// points_ns: in [0, period_ns), with one weight each.
Cluster find_largest_cluster(const std::vector<double>& points_ns,
                             const std::vector<double>& weights, double period_ns, double width_ns);

// Leaves only the photons of the largest cluster of T mod t_k. In an interleaved pattern a target's
// photons that came from the pulses of another sub-period lie at many places of this sub-period,
// and its own photons at one place. width_ns: has to hold the target's motion.
//
// The number of photons counted stays as it is, since the background is that of the whole period.
// Source: [P], initialisation of the interleaved mode.
void keep_largest_cluster(TrainPhotons& photons, double width_ns);

}  // namespace splid::paper
