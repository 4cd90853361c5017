#include "estimator/selection/target_selection.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/search/target_fit.hpp"
#include "estimator/sync/deviations.hpp"

namespace splid::selection {
namespace {

// What is left of a frame holds all of a target but so much.
constexpr double lost_nats = 3;

}  // namespace

TargetSelection::TargetSelection(TargetSearch& search, AccelerationSearch* acceleration,
                                 const PulseTrain& train, const PulseShape& shape,
                                 const SelectionScope& scope, std::size_t max_photons)
    : search_(search),
      acceleration_(acceleration),
      train_(train),
      shape_(shape),
      scope_(scope),
      maximizer_(
          shape, train, max_photons,
          {most_targets, scope.is_width_free ? TargetFit::most_width : 1, scope.may_be_dead}),
      wide_(shape, train, max_photons, {most_targets, TargetFit::most_width, scope.may_be_dead}),
      thinning_(shape, train, max_photons, scope.is_width_free ? TargetFit::most_width : 1),
      tail_(shape, train, max_photons) {
  for (std::size_t k = 0; k < most_targets; ++k) {
    members_.push_back({{{}, search.no_peaks()}, false});
  }
  lines_.reserve(most_targets + most_targets * CombMeetings::most_places);
}

const Selection& TargetSelection::select(const FoldedFrame& frame, const Maximum& first,
                                         std::size_t track_terms, Effort most) {
  frame_ = &frame;
  terms_ = track_terms;
  maximizer_.begin(frame);
  wide_.begin(frame);
  all_ = {};
  all_.model = first.model;
  all_.gain_nats = first.gain_nats;
  is_refined_ = !scope_.is_width_free;
  pair_odds_nats_ = {};
  members_[0].is_detected = true;
  search_.keep(first, members_[0].search);
  // What is not detected stays, and leaves room for as many more.
  std::size_t wanted = scope_.targets;
  for (bool is_more = true; is_more && all_.model.count < std::min(wanted, most_targets);) {
    while (is_more && all_.model.count < std::min(wanted, most_targets)) is_more = add_next(most);
    judge_targets();
    wanted = scope_.targets + all_.model.count - detected();
  }
  for (std::size_t k = all_.model.count; k-- > 0;) {
    if (!members_[k].is_detected && all_.model.count > 1) drop(k);
  }
  selection_.count = 1;
  if (all_.model.count > 1) finish();
  return selection_;
}

// Looks for one more target; returns false where there is none. Two that look like one in their
// middle are tried first, since this needs no search.
bool TargetSelection::add_next(Effort most) {
  const bool is_first = is_refined_ && all_.model.count == 1;
  const Maximum split = is_first ? best_split(true) : Maximum{};
  if (is_first && is_plain_pair(split) && accept(split)) return true;
  if (!is_refined_ && all_.model.count == 1) refine();
  const FoldedFrame& rest = thinning_.rest(*frame_, all_.model);
  if (rest.size() == 0) return false;
  std::optional<Target> next = find_seen(rest);
  if (!next) next = find_next(rest, most);
  if (next && add(*next)) return true;
  return accept(best_split(false));
}

// Adds a target of what is left, fitted together with the others unless it is a plain one; returns
// false where it is none.
bool TargetSelection::add(const Target& next) {
  Member& member = members_[all_.model.count];
  const double gain_nats = member.search.fit.gain_nats;
  if (gain_nats < scope_.threshold_nats - lost_nats) return false;
  if (!is_plain(next, gain_nats)) {
    refine();
    Model with = all_.model;
    with.add(next);
    return accept(maximize(with, likelihood::Maximizer::compared_nats));
  }
  is_refined_ = false;
  all_.model.add(next);
  all_.model.background_per_ns = member.search.fit.model.background_per_ns;
  all_.gain_nats += gain_nats;
  return true;
}

bool TargetSelection::accept(const Maximum& together) {
  if (!together.has_covariance) return false;
  if (!(together.gain_nats >= all_.gain_nats + scope_.threshold_nats)) return false;
  all_ = together;
  return true;
}

void TargetSelection::refine() {
  if (!is_refined_) all_ = maximize(all_.model, likelihood::Maximizer::compared_nats);
  is_refined_ = true;
}

Maximum TargetSelection::maximize(const Model& start, double enough_nats) {
  return maximizer_.maximize(
      start, {.free = likelihood::free_set(start.count, terms_, scope_.is_width_free),
              .enough_nats = enough_nats});
}

void TargetSelection::drop(std::size_t target) {
  const auto put_last = [target](auto& all) {
    const auto at = all.begin() + static_cast<std::ptrdiff_t>(target);
    std::rotate(at, at + 1, all.end());
  };
  put_last(all_.model.targets);
  put_last(members_);
  --all_.model.count;
  is_refined_ = false;
}

std::size_t TargetSelection::detected() const {
  return static_cast<std::size_t>(std::count_if(
      members_.begin(), members_.begin() + static_cast<std::ptrdiff_t>(all_.model.count),
      [](const Member& member) { return member.is_detected; }));
}

// Whether a target of what is left is one for sure, and has nothing to do with the others.
bool TargetSelection::is_plain(const Target& next, double gain_nats) const {
  const std::span known(all_.model.targets.data(), all_.model.count);
  return gain_nats >= scope_.threshold_nats + plain_margin_nats &&
         std::none_of(known.begin(), known.end(), [&](const Target& other) {
           return apart_widths(next.track, other.track) <= tail_widths;
         });
}

double TargetSelection::apart_ns(const DelayTrack& a, const DelayTrack& b) const {
  return std::remainder(a.delay_ns - b.delay_ns, train_.circle_ns);
}

// How far apart two are over the frame, root mean square.
double TargetSelection::apart_widths(const DelayTrack& a, const DelayTrack& b) const {
  return in_quadrature(apart_ns(a, b), (a.walk_ns - b.walk_ns) / std::sqrt(12.0)) /
         shape_.width_ns();
}

double TargetSelection::parting_widths(const DelayTrack& a, const DelayTrack& b) const {
  return std::abs(a.walk_ns - b.walk_ns) / shape_.width_ns();
}

}  // namespace splid::selection
