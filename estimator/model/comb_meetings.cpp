#include "estimator/model/comb_meetings.hpp"

#include <algorithm>
#include <cmath>

namespace splid {

CombMeetings::CombMeetings(const PulseTrain& train, double width_ns)
    : circle_ns_(train.circle_ns), tolerance_ns_(3 * width_ns) {
  if (train.single()) {
    periods_ns_ = train.segments.front().subperiods_ns;
  } else {
    for (const PulseTrain::Segment& segment : train.segments) {
      if (segment.comb.times_ns.size() == 1) periods_ns_.push_back(segment.comb.period_ns);
    }
    if (periods_ns_.size() < train.segments.size()) periods_ns_.clear();
  }
  if (periods_ns_.size() < 2) periods_ns_.clear();
}

CombMeetings::Places CombMeetings::find(double one_ns, double other_ns) const {
  Places places;
  if (periods_ns_.empty()) return places;
  const double period_ns = periods_ns_.front();
  const auto turns = static_cast<std::size_t>(std::ceil(circle_ns_ / period_ns));
  for (const double from_ns : {one_ns, other_ns}) {
    for (std::size_t n = 0; n < turns && !places.is_full(); ++n) {
      double place_ns = from_ns + static_cast<double>(n) * period_ns;
      double off_ns = 0;
      if (!meets_at(place_ns, one_ns, other_ns, off_ns)) continue;
      place_ns += off_ns;
      place_ns -= circle_ns_ * std::floor(place_ns / circle_ns_);
      const auto is_here = [&](double delay_ns) { return is_same(place_ns, delay_ns); };
      const auto known = places.delays_ns();
      if (is_here(one_ns) || is_here(other_ns)) continue;
      if (std::none_of(known.begin(), known.end(), is_here)) places.add(place_ns);
    }
  }
  return places;
}

bool CombMeetings::do_meet(double one_ns, double other_ns, double place_ns) const {
  const Places places = find(one_ns, other_ns);
  const auto delays_ns = places.delays_ns();
  return std::any_of(delays_ns.begin(), delays_ns.end(),
                     [&](double delay_ns) { return is_same(delay_ns, place_ns); });
}

bool CombMeetings::is_same(double one_ns, double other_ns) const {
  return std::abs(std::remainder(one_ns - other_ns, circle_ns_)) < 2 * tolerance_ns_;
}

// Whether each rate has its pulses at one of the two there, and not all at the same one, or close
// to them as those of a nearly even comb's copies are. off_ns: how far off their mean is.
bool CombMeetings::meets_at(double place_ns, double one_ns, double other_ns, double& off_ns) const {
  bool all_one = true, all_other = true;
  off_ns = 0;
  for (const double period_ns : periods_ns_) {
    const double to_one = std::remainder(one_ns - place_ns, period_ns);
    const double to_other = std::remainder(other_ns - place_ns, period_ns);
    const double nearest = std::abs(to_one) < std::abs(to_other) ? to_one : to_other;
    if (std::abs(nearest) > tolerance_ns_) return false;
    all_one = all_one && std::abs(to_one) <= 2 * tolerance_ns_;
    all_other = all_other && std::abs(to_other) <= 2 * tolerance_ns_;
    off_ns += nearest / static_cast<double>(periods_ns_.size());
  }
  return !all_one && !all_other;
}

}  // namespace splid
