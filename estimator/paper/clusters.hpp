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

// Leaves only the photons of the largest cluster of T mod t_k: those that came from the pulses of
// another sub-period lie at many places. width_ns: has to hold the target's motion. The number of
// photons counted stays, as the background is that of the period. Source: [P], initialisation.
void keep_largest_cluster(TrainPhotons& photons, double width_ns);

}  // namespace splid::paper
