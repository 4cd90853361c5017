#include "estimator/checks/findings.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "estimator/sync/deviations.hpp"

namespace splid::checks {
namespace {

// Rows that chance screens out in all but two frames of a hundred are not fitted.
constexpr double screen_squares = 5.41, screen_deviations = 2.05;
// A SquareSum has one side only.
constexpr double sure_squares_of_sums = million_deviations * million_deviations;
constexpr std::size_t most_fitted = 3;
// With fewer photons of signal richer fits have more false alarms than they say.
constexpr double fewest_photons = 50;
// A finding of so many terms asks for so many photons each.
constexpr double photons_a_term = 4;

// Design note: amplitudes that were never calibrated deviate by some 0.6 rms at worst. A pattern
// that was not played has a best delay at which half of its pulses are dark: 0.95 rms.
constexpr double most_uneven = 0.4, least_dark = 0.9, deviations_of_dark = 4.5;
// Light that stands still beside the target's pulses may be more of the same: as much as three such
// targets have leaves it doubtful which of them is the target.
constexpr double most_elsewhere = 2, deviations_of_stray = 7;
constexpr std::size_t fewest_for_amplitudes = 4;
constexpr std::size_t coarse_phases = 16;  // fine bins in a coarse one
// The walk of the mean of two surfaces, over half of their distance, that stays below five
// deviations however fast the beam goes from one to the other.
constexpr double walk_of_spread = 0.4;
// A target whose pulses are lit alike to so much is none that other light makes up.
constexpr double most_uneven_of_target = 0.25, deviations_of_even = 3;

}  // namespace

double sure_squares_of(double degrees) {
  return degrees <= 1 ? sure_squares : chi_squared_of(million_deviations, degrees);
}

void RowScore::add(const RowScore& more) {
  for (std::size_t t = 0; t < score.size(); ++t) {
    score[t] += more.score[t];
    information[t] += more.information[t];
  }
  squares += more.squares;
  degrees += more.degrees;
}

Findings::Findings(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
                   double dead_time_ns)
    : pulse_(shape),
      train_(train),
      map_(train, shape, max_photons),
      seen_finder_(train, map_, shape.width_ns(), dead_time_ns),
      fit_(map_, train, pulse_),
      kernels_(kernels()) {
  seen_pulses_.reserve(map_.by_pulse().size());
  candidates_.reserve(rows_with_directions);
}

const Findings::RowMoments& Findings::kernels() {
  static const RowMoments of_rows = [] {
    RowMoments made;
    for (std::size_t row = 0; row < made.size(); ++row) {
      Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(map_parts, map_parts);
      const Direction& direction = finding_table()[row].directions.front();
      for (std::size_t k = direction.first; k <= direction.last; ++k) {
        const Eigen::Map<const Eigen::VectorXd> of_order(map_basis().of(k).data(), map_parts);
        shared += of_order * of_order.transpose() / of_order.squaredNorm();
      }
      made[row] = {shared.array().cube().sum(), shared.diagonal().squaredNorm()};
    }
    return made;
  }();
  return of_rows;
}

const Verdict& Findings::judge(const FoldedFrame& frame, const likelihood::Model& model,
                               std::size_t target, const FitFacts& facts, const SeenParts& parts) {
  verdict_ = {};
  scores_ = {};
  if (!map_.looks() || frame.seen_ns <= 0) return verdict_;
  const DelayTrack& track = model.targets.at(target).track;
  map_.fill(frame, track);
  seen_ = &seen_finder_.look(frame, map_, parts);
  fit_.begin(frame, model, target, *seen_);
  list_terms(facts);
  screen(facts);
  if (!candidates_.empty()) decide(frame);
  if (!candidates_.empty()) name_best(frame);
  see_pulses(model, target);
  judge_pulses();
  is_alone_ = model.count == 1;
  if (is_alone_) judge_phases(frame);
  return verdict_;
}

void Findings::list_terms(const FitFacts& facts) {
  size_ = 0;
  for (std::size_t k = 0; k < facts.track_terms; ++k) terms_[size_++] = {Shape::path, k};
  terms_[size_++] = {Shape::light, 0};
  terms_[size_++] = {Shape::dark, 0};
  if (facts.is_width_fitted) terms_[size_++] = {Shape::width, 0};
  fitted_ = size_;
  for (std::size_t row = 0; row < rows_with_directions; ++row) {
    first_term_[row] = size_;
    for (const Direction& direction : finding_table()[row].directions) {
      for (std::size_t k = direction.first; k <= direction.last; ++k) {
        terms_[size_++] = {direction.shape, k};
      }
    }
    const Term& first = terms_[first_term_[row]];
    const auto is_same = [&](const Term& t) {
      return t.shape == first.shape && t.order == first.order;
    };
    const bool is_fitted = std::any_of(terms_.begin(), terms_.begin() + fitted_, is_same);
    if (is_fitted) size_ = first_term_[row];
    row_terms_[row] = size_ - first_term_[row];
  }
}

// Scores of all rows, orthogonal to what was fitted.
void Findings::screen(const FitFacts& facts) {
  std::array<double, map_parts> narrowed_ns2{};
  for (std::size_t j = 0; j < map_parts; ++j) {
    const double share = (static_cast<double>(j) + 0.5) / map_parts - 0.5;
    const double walk = facts.std_walk_ns * share;
    const double quadratic = facts.std_quadratic_ns * DelayTrack::quadratic_at(share);
    narrowed_ns2[j] = facts.std_delay_ns * facts.std_delay_ns + walk * walk + quadratic * quadratic;
  }
  fit_.scores(std::span(terms_).first(size_), narrowed_ns2, slopes_);
  candidates_.clear();
  const auto n = static_cast<Eigen::Index>(fitted_);
  const auto all = static_cast<Eigen::Index>(size_);
  const Eigen::LLT<TermMatrix> cholesky(slopes_.information.topLeftCorner(n, n));
  if (cholesky.info() != Eigen::Success) return;
  solved_ = slopes_.information.topRightCorner(n, all - n);
  for (auto column : solved_.colwise()) cholesky.solveInPlace(column);
  const TermVector fitted = slopes_.gradient.head(n);
  slopes_.gradient.tail(all - n).noalias() -= solved_.transpose() * fitted;
  for (std::size_t row = 0; row < rows_with_directions; ++row) score_row(row);
}

void Findings::score_row(std::size_t row) {
  const auto k = static_cast<Eigen::Index>(row_terms_[row]);
  if (k == 0) return;
  const auto first = static_cast<Eigen::Index>(first_term_[row]);
  const auto n = static_cast<Eigen::Index>(fitted_);
  TermMatrix information = slopes_.information.block(first, first, k, k);
  information.noalias() -=
      slopes_.information.block(first, 0, k, n).lazyProduct(solved_.middleCols(first - n, k));
  const TermVector score = slopes_.gradient.segment(first, k);
  const Eigen::LLT<TermMatrix> cholesky(information);
  if (cholesky.info() != Eigen::Success || !(information.diagonal().minCoeff() > 1e-9)) return;
  RowScore& said = scores_.rows[row];
  const double factor = bartlett(row);
  said.degrees = static_cast<double>(k);
  said.squares = score.dot(TermVector(cholesky.solve(score))) / factor;
  for (Eigen::Index t = 0; t < std::min<Eigen::Index>(k, 2); ++t) {
    said.score[static_cast<std::size_t>(t)] = score[t];
    said.information[static_cast<std::size_t>(t)] = information(t, t);
  }
  const bool is_flat = finding_table()[row].is_flat_light();
  const double photons = std::max(fewest_photons, photons_a_term * said.degrees);
  if (!is_flat && fit_.signal() < photons) return;
  const double limit = k == 1 ? screen_squares : chi_squared_of(screen_deviations, said.degrees);
  if (said.squares <= limit) return;
  candidates_.push_back({row, 0, 0, {}});
  if (is_flat && said.score[0] + said.score[1] > 0) judge_beside();
}

// E 2 gain / degrees - 1, to first order in one over the photons.
double Findings::bartlett(std::size_t row) const {
  if (row_terms_[row] < 3) return 1;
  const MapFit::Moments moments = fit_.moments(terms_[first_term_[row]].shape);
  const double more =
      moments.fourth * kernels_[row].fourth / 2 - moments.third * kernels_[row].third / 3;
  return 1 + std::max(0.0, more) / static_cast<double>(row_terms_[row]);
}

// Maximizes the log-likelihood of the map in what was fitted, and in the terms of these rows.
double Findings::fit_with(std::span<const std::size_t> rows, Member& member) {
  std::array<Term, most_terms> terms{};
  auto end = std::copy_n(terms_.begin(), fitted_, terms.begin());
  for (const std::size_t row : rows) {
    end = std::copy_n(terms_.begin() + static_cast<std::ptrdiff_t>(first_term_[row]),
                      row_terms_[row], end);
  }
  return fit_.maximize(member, std::span(terms.begin(), end), slopes_);
}

// A frame that one row explains lets many others through the screen. Each fit takes some 0.1 ms.
void Findings::keep_highest() {
  const auto over = [&](const Candidate& c) {
    return scores_.rows[c.row].squares - sure_squares_of(static_cast<double>(row_terms_[c.row]));
  };
  std::sort(candidates_.begin(), candidates_.end(),
            [&](const Candidate& a, const Candidate& b) { return over(a) > over(b); });
  while (candidates_.size() > most_fitted) candidates_.pop_back();
}

// The fitted model has its maximum about where the member without amounts is, so that most rows
// are seen not to be sure before that maximum is looked for on the map.
void Findings::decide(const FoldedFrame& frame) {
  keep_highest();
  const auto fades = [](const Candidate& c) {
    return finding_table()[c.row].name == FindingName::fading;
  };
  const auto is_unsure = [&](const Candidate& c) { return !is_sure(c); };
  if (std::any_of(candidates_.begin(), candidates_.end(), fades)) fit_.see_background(frame);
  fit_.slopes({}, {}, slopes_);
  const double about = slopes_.value;
  for (Candidate& candidate : candidates_) {
    candidate.gain_nats = fit_with(std::array{candidate.row}, candidate.member);
    candidate.squares = 2 * (candidate.gain_nats - about) / bartlett(candidate.row);
    if (is_unsure(candidate) && candidate.squares > 2 * likely_nats) {
      // Light that is likely to be wider hides as much. Chance makes it so in one frame of 700.
      const double hidden = hidden_by_spread_ns(candidate.member);
      verdict_.wider.off_delay_ns = std::max(verdict_.wider.off_delay_ns, hidden);
      verdict_.wider.off_walk_ns = std::max(verdict_.wider.off_walk_ns, walk_of_spread * hidden);
    }
  }
  std::erase_if(candidates_, is_unsure);
  if (candidates_.empty()) return;
  base_ = {};
  base_value_ = fit_with({}, base_);
  for (Candidate& candidate : candidates_) {
    candidate.gain_nats -= base_value_;
    candidate.squares = 2 * candidate.gain_nats / bartlett(candidate.row);
    scores_.rows[candidate.row].squares = candidate.squares;
  }
  std::erase_if(candidates_, is_unsure);
}

bool Findings::is_sure(const Candidate& candidate) const {
  return candidate.squares > sure_squares_of(static_cast<double>(row_terms_[candidate.row]));
}

// The row with the largest gain, and those that are sure beside it.
void Findings::name_best(const FoldedFrame& frame) {
  const auto best = std::max_element(
      candidates_.begin(), candidates_.end(),
      [](const Candidate& a, const Candidate& b) { return a.gain_nats < b.gain_nats; });
  find_sandwich();
  say(best->row, best->gain_nats, best->member, frame);
  follow(best->member, best->row);
  const Shape shape = terms_[first_term_[best->row]].shape;
  if (shape == Shape::width || shape == Shape::tail) widen_by_parting(*best);
  for (Candidate& other : candidates_) {
    if (&other == &*best) continue;
    Member both = best->member;
    const double gain =
        fit_with(std::array{best->row, other.row}, both) - base_value_ - best->gain_nats;
    other.squares = 2 * gain / bartlett(other.row);
    if (!is_sure(other)) continue;
    say(other.row, gain, both, frame);
    follow(both, other.row);
  }
}

void Findings::say(std::size_t row, double gain_nats, const Member& member,
                   const FoldedFrame& frame) {
  const FindingRow& named = finding_table()[row];
  const std::span terms = std::span(terms_).subspan(first_term_[row], row_terms_[row]);
  double amount = 0;
  for (const Term& term : terms) {
    const double of_term = member.of(term);
    amount += terms.size() > 2 ? of_term * of_term * MapBasis::mean_square(term.order) : of_term;
  }
  if (terms.size() > 2) amount = std::sqrt(amount);
  if (named.is_flat_light() && amount <= 0) return;
  verdict_.found.add(named.found(named.value(amount, {frame.length_ns, frame.seen_ns}), gain_nats));
}

// Where the richer model has the target at mid-frame, and how fast it moves there.
void Findings::follow(const Member& richer, std::size_t row) {
  std::array<double, map_parts> off{};
  for (std::size_t j = 0; j < map_parts; ++j) {
    off[j] = fit_.sum(richer, Shape::path, j) - fit_.sum(base_, Shape::path, j);
  }
  constexpr std::size_t mid = map_parts / 2;
  // A step from one part to the next is a 32nd of the walk.
  double delay = (off[mid - 1] + off[mid]) / 2, walk = (off[mid] - off[mid - 1]) * map_parts;
  if (finding_table()[row].name == FindingName::vibration) {
    double squares = 0, steps = 0;
    for (std::size_t j = 0; j < map_parts; ++j) {
      squares += off[j] * off[j] / map_parts;
      if (j > 0) steps += std::pow(off[j] - off[j - 1], 2) / (map_parts - 1);
    }
    delay = std::sqrt(squares), walk = map_parts * std::sqrt(steps);
  }
  const double hidden = hidden_by_spread_ns(richer);
  verdict_.wider.off_delay_ns = std::max(verdict_.wider.off_delay_ns, in_quadrature(delay, hidden));
  verdict_.wider.off_walk_ns =
      std::max(verdict_.wider.off_walk_ns, in_quadrature(walk, walk_of_spread * hidden));
  const auto grown = [&](Shape shape) {
    return std::abs(std::expm1(richer.of({shape, 0}) - base_.of({shape, 0})));
  };
  verdict_.wider.off_signal = std::max(verdict_.wider.off_signal, grown(Shape::light));
  verdict_.wider.off_background = std::max(verdict_.wider.off_background, grown(Shape::dark));
}

// Light whose width changes over the frame is that of two targets that part: at half of their
// distance, a + b u, from their mean, its variance is that of the pulse and (a + b u)^2. Then the
// walk of each is off by 2 b.
void Findings::widen_by_parting(const Candidate& best) {
  Member both = best.member;
  const double gain = fit_with(std::array{width_row, parting_row}, both) - base_value_;
  const bool is_likely = gain - best.gain_nats > likely_nats;
  if (best.row != parting_row && !is_likely) return;
  const auto variance = [&](double p1, double p2) {
    return std::exp(2 * (both.of({Shape::width, 0}) + p1 * both.of({Shape::width, 1}) +
                         p2 * both.of({Shape::width, 2})));
  };
  const double b =
      std::sqrt(std::max(0.0, (variance(1, 1) + variance(-1, 1)) / 2 - variance(0, -0.5)));
  verdict_.wider.off_walk_ns = std::max(verdict_.wider.off_walk_ns, 2 * b * pulse_.width_ns());
}

// Light that is wider than the pulse hides a shift: two surfaces look like a pulse that is wider by
// half of their distance. Where the beam moves from one to the other, their mean walks by a part of
// that.
double Findings::hidden_by_spread_ns(const Member& richer) const {
  const double wider = std::exp(2 * richer.of({Shape::width, 0})) - 1;
  return pulse_.width_ns() * std::sqrt(std::max(0.0, wider));
}

// The inverse information on both sides of the squared scores that the photons have.
void Findings::find_sandwich() {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero(), squares = Eigen::Matrix2d::Zero();
  for (std::size_t j = 0; j < map_parts; ++j) {
    const Eigen::Vector2d by(1, map_basis().at(1, j));
    const MapFit::PathSquares of_part = fit_.path_squares(base_, j);
    information += of_part.expected * by * by.transpose();
    squares += of_part.seen * by * by.transpose();
  }
  const Eigen::Matrix2d inverse = information.inverse();
  const Eigen::Matrix2d covariance = inverse * squares * inverse;
  if (!covariance.allFinite()) return;
  verdict_.wider.least_delay_ns = std::sqrt(std::max(0.0, covariance(0, 0)));
  verdict_.wider.least_walk_ns = 2 * std::sqrt(std::max(0.0, covariance(1, 1)));
}

PulseLight Findings::expected_at(std::size_t p) const {
  const Comb& comb = train_.segments.front().comb;
  const double pulses = static_cast<double>(comb.times_ns.size()), seen = seen_pulses_[p];
  if (!(seen > 0)) return {0, 0};
  return {
      light_of_pulses_ * comb.amplitudes[p] * seen / seen_amplitude_,
      seen * fit_.dark_per_ns() * map_parts / pulses * 2 * half_pulse_widths * pulse_.width_ns()};
}

// Pulses that another target's come near, anywhere in the frame, are left out.
void Findings::see_pulses(const likelihood::Model& model, std::size_t target) {
  seen_pulses_.assign(map_.by_pulse().size(), 1);
  const Comb& comb = train_.segments.front().comb;
  const DelayTrack& own = model.targets.at(target).track;
  for (std::size_t p = 0; p < seen_pulses_.size(); ++p) {
    if (!seen_->of_pulse.empty()) seen_pulses_[p] = seen_->of_pulse[p];
    for (std::size_t k = 0; k < model.count; ++k) {
      const DelayTrack apart = model.targets[k].track - own;
      const double near_ns = pulse_reach_widths * pulse_.width_ns() + std::abs(apart.walk_ns) / 2 +
                             std::abs(apart.quadratic_ns);
      const double from_ns = comb.times_ns[p] - apart.delay_ns;
      if (k != target && std::abs(comb.to_nearest_ns(from_ns)) < near_ns) seen_pulses_[p] = 0;
    }
  }
}

// Whether the light is shared among the pulses as the pattern's amplitudes say.
void Findings::judge_pulses() {
  const std::size_t pulses = seen_pulses_.size();
  light_of_pulses_ = seen_amplitude_ = 0;
  if (pulses == 0) return;
  const std::vector<double>& amplitudes = train_.segments.front().comb.amplitudes;
  double light = 0;
  for (std::size_t p = 0; p < pulses; ++p) {
    seen_amplitude_ += amplitudes[p] * seen_pulses_[p];
    light += counted_at(p) - expected_at(p).dark;
  }
  if (!(light > 0)) return;
  light_of_pulses_ = light;
  double of_uneven = 0;
  for (std::size_t p = 0; p < pulses; ++p) {
    const PulseLight own = expected_at(p);
    scores_.by_pulse.add(counted_at(p), own.light + own.dark, own.light);
    of_uneven += 4 * own.light * own.light * (own.light + own.dark);
  }
  const SquareSum& sum = scores_.by_pulse;
  const double chance = std::sqrt(sum.variance + most_uneven * of_uneven);
  const double gain = sum.gain_nats(), misfit = sum.relative();
  if (2 * gain > sure_squares_of_sums && sum.excess > least_dark * sum.scale &&
      sum.excess > most_uneven * sum.scale + deviations_of_dark * chance) {
    verdict_.is_foreign = true;
    // The share of the pulses' amplitude without light, if the others are lit alike.
    const double dark_share = misfit * misfit / (1 + misfit * misfit);
    verdict_.found.add(finding_table()[pattern_row].found(dark_share, gain));
  } else if (pulses >= fewest_for_amplitudes && 2 * gain > sure_squares_of_sums) {
    verdict_.found.add(finding_table()[pulse_row].found(misfit, gain));
  }
}

Findings::PhaseGroup Findings::phases(std::size_t group) const {
  const std::span<const std::uint32_t> counts = map_.by_phase();
  const std::span<const std::uint8_t> is_free = map_.is_free();
  const std::size_t first = group * coarse_phases;
  std::uint32_t bins = 0, sum = 0;
  std::uint64_t squares = 0;
  for (std::size_t k = first; k < std::min(first + coarse_phases, counts.size()); ++k) {
    const std::uint32_t count = counts[k] * is_free[k];
    bins += is_free[k], sum += count, squares += std::uint64_t{count} * count;
  }
  return {static_cast<double>(bins), static_cast<double>(sum), static_cast<double>(squares)};
}

// Adds the free bins of a group to the sums. mean: photons of a bin whose light was all seen.
void Findings::sum_phases(double mean, std::size_t group, std::span<const double> seen) {
  const PhaseGroup all = phases(group);
  if (seen.empty()) {
    scores_.by_phase.add_alike(all.bins, mean, all.sum, all.squares);
    return scores_.by_phase_coarse.add(all.sum, mean * all.bins);
  }
  double expected = 0;
  for (std::size_t k = group * coarse_phases;
       k < std::min((group + 1) * coarse_phases, seen.size()); ++k) {
    if (map_.is_free()[k] == 0) continue;
    scores_.by_phase.add(map_.by_phase()[k], mean * seen[k]);
    expected += mean * seen[k];
  }
  scores_.by_phase_coarse.add(all.sum, expected);
}

// Whether light comes between the pulses that is not spread evenly.
void Findings::judge_phases(const FoldedFrame& frame) {
  const std::span<const std::uint32_t> counts = map_.by_phase();
  const std::span<const double> seen_phases = seen_->of_phase;
  const std::size_t groups = (counts.size() + coarse_phases - 1) / coarse_phases;
  double photons = 0, bins = 0, seen = 0;
  for (std::size_t g = 0; g < groups; ++g) {
    const PhaseGroup group = phases(g);
    photons += group.sum, bins += group.bins;
  }
  for (std::size_t k = 0; k < seen_phases.size(); ++k) seen += seen_phases[k] * map_.is_free()[k];
  if (seen_phases.empty()) seen = bins;
  if (!(photons > 0) || !(seen > 0)) return;
  const SquareSum &fine = scores_.by_phase, &coarse = scores_.by_phase_coarse;
  for (std::size_t g = 0; g < groups; ++g) sum_phases(photons / seen, g, seen_phases);
  const SquareSum& surer = coarse.gain_nats() > fine.gain_nats() ? coarse : fine;
  const double gain = surer.gain_nats();
  const bool has_strangers = fine.excess > most_elsewhere * scores_.by_pulse.scale +
                                               deviations_of_stray * std::sqrt(fine.variance);
  if (has_strangers && map_.by_pulse().size() < fewest_pulses) {
    verdict_.is_foreign = true;
    verdict_.found.add(finding_table()[pattern_row].found(1, gain));
  }
  if (2 * gain < sure_squares_of_sums) return;
  const double cells = &surer == &coarse ? bins / coarse_phases : bins;
  const FindingRow& row = finding_table()[phase_row];
  const double photons_per_s =
      row.value(std::sqrt(surer.excess * cells), {frame.length_ns, frame.seen_ns});
  verdict_.found.add(row.found(photons_per_s, gain));
  const SquareSum& own = scores_.by_pulse;
  const bool is_even =
      map_.by_pulse().size() >= fewest_pulses &&
      own.excess + deviations_of_even * std::sqrt(own.variance) < most_uneven_of_target * own.scale;
  verdict_.is_doubtful = !is_even && (has_strangers || 2 * own.gain_nats() > sure_squares_of_sums);
}

// The gain of a gaussian's signal over the light from 4 widths on.
void Findings::judge_beside() {
  std::array<double, most_cells> counts{}, expected{};
  double beside = 0, beside_ns = 0;
  std::array<double, most_cells> light{};
  fit_.expect({}, 0, expected);
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    for (std::size_t j = 0; j < map_parts; ++j) counts[i] += map_.part(j)[i];
    const double cell_ns = map_.cell_ns(i);
    const double mid_ns = map_.edge_ns(i) + cell_ns / 2 - pulse_.peak_ns();
    const bool is_beside = std::abs(mid_ns) > flat_from_widths * pulse_.width_ns();
    if (is_beside) beside += counts[i], beside_ns += cell_ns;
    light[i] =
        is_beside ? 0 : std::max(0.0, expected[i] - fit_.dark_per_ns() * cell_ns) * map_parts;
  }
  if (beside_ns == 0) return;
  const double dark_per_ns = std::max(beside / beside_ns, fit_.dark_per_ns() * map_parts);
  double amount = 1, gain = 0;  // of the fitted signal
  for (int step = 0; step < 20; ++step) {
    double slope = 0, curve = 0;
    gain = 0;
    for (std::size_t i = 0; i < map_.cells(); ++i) {
      const double dark = dark_per_ns * map_.cell_ns(i);
      const double q = light[i] / (dark + amount * light[i]);
      slope += counts[i] * q - light[i], curve += counts[i] * q * q;
      gain += counts[i] * std::log1p(amount * light[i] / dark) - amount * light[i];
    }
    if (!(curve > 0)) break;
    amount = std::clamp(amount + slope / curve, amount / 4, 2 * amount);
  }
  verdict_.gain_beside_nats = std::max(0.0, gain);
}

}  // namespace splid::checks
