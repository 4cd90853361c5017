#include "estimator/checks/frame_checks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/model/chance.hpp"

namespace splid::checks {
namespace {

constexpr std::size_t most_stray = 4;
constexpr double stray_ratio = 4;  // over the median of the pulses' photons

}  // namespace

FindingSums::FindingSums(const Findings& findings)
    : findings_(findings),
      by_pulse_(findings.map().by_pulse().size()),
      expected_(by_pulse_.size()),
      light_(by_pulse_.size()),
      by_phase_(findings.map().by_phase().size()),
      seen_phase_(by_phase_.size()) {}

void FindingSums::clear() {
  rows_ = {};
  for (auto* sums : {&by_pulse_, &expected_, &light_, &by_phase_, &seen_phase_}) {
    std::fill(sums->begin(), sums->end(), 0.0);
  }
  frames_ = length_ns_ = seen_ns_ = 0;
}

void FindingSums::add(const FoldedFrame& frame) {
  for (std::size_t row = 0; row < rows_with_directions; ++row)
    rows_[row].add(findings_.scores().rows[row]);
  const ResidualMap& map = findings_.map();
  for (std::size_t p = 0; p < by_pulse_.size(); ++p) {
    const PulseLight expected = findings_.expected_at(p);
    by_pulse_[p] += map.by_pulse()[p];
    expected_[p] += expected.light + expected.dark;
    light_[p] += expected.light;
  }
  for (std::size_t k = 0; k < by_phase_.size(); ++k) {
    by_phase_[k] += map.by_phase()[k];
    seen_phase_[k] += findings_.seen_at_phase(k);
  }
  frames_ += 1, length_ns_ += frame.length_ns, seen_ns_ += frame.seen_ns;
}

void FindingSums::say(FoundList& all, const FindingRow& row, double amount,
                      double gain_nats) const {
  if (2 * gain_nats < sure_squares) return;
  const FindingScale scale = {length_ns_ / frames_, seen_ns_ / frames_};
  all.add(row.found(row.value(amount, scale), gain_nats));
}

// A sum of chi squared has the tail that SquareSum has. Its measure of the size is the mean square
// beyond chance, in one direction's own units.
void FindingSums::add_sum(FoundList& all, std::size_t row) const {
  const RowScore& sum = rows_[row];
  const FindingRow& named = finding_table()[row];
  if (!(sum.information[0] > 0)) return;
  double amount = 0, squares = 0;
  for (std::size_t t = 0; t < sum.score.size(); ++t) {
    if (!(sum.information[t] > 0)) continue;
    amount += sum.score[t] / sum.information[t];
    squares += sum.score[t] * sum.score[t] / sum.information[t];
  }
  if (named.keeps_sign) {
    if (named.is_flat_light() && amount < 0) return;
    return say(all, named, amount, squares / 2);
  }
  const SquareSum chi = {sum.squares - sum.degrees, 2 * sum.degrees, 8 * sum.degrees, 0};
  const double more = std::max(0.0, sum.squares / sum.degrees - 1);
  say(all, named, std::sqrt(more * frames_ / sum.information[0]), chi.gain_nats());
}

FoundList FindingSums::found() const {
  FoundList all;
  if (frames_ == 0) return all;
  for (std::size_t row = 0; row < rows_with_directions; ++row) add_sum(all, row);
  SquareSum pulses, phases;
  for (std::size_t p = 0; p < by_pulse_.size(); ++p)
    pulses.add(by_pulse_[p], expected_[p], light_[p]);
  const std::span<const std::uint8_t> is_free = findings_.map().is_free();
  double photons = 0, bins = 0, seen = 0;
  for (std::size_t k = 0; k < by_phase_.size(); ++k) {
    if (is_free[k] != 0) photons += by_phase_[k], seen += seen_phase_[k], bins += 1;
  }
  for (std::size_t k = 0; k < by_phase_.size(); ++k) {
    if (is_free[k] != 0) phases.add(by_phase_[k], photons * seen_phase_[k] / seen);
  }
  const double amount = std::sqrt(std::max(0.0, phases.excess) * bins) / frames_;
  say(all, finding_table()[phase_row], amount, phases.gain_nats());
  say(all, finding_table()[pulse_row], pulses.relative(), pulses.gain_nats());
  return all;
}

FrameChecks::FrameChecks(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
                         double dead_time_ns, double reach_ns)
    : train_(train),
      pulse_reach_ns_(pulse_reach_widths * shape.width_ns()),
      findings_(train, shape, max_photons, dead_time_ns),
      sums_{FindingSums(findings_), FindingSums(findings_)},
      cleaned_(train, max_photons, reach_ns) {
  sorted_.reserve(findings_.map().by_pulse().size());
  stays_.reserve(max_photons);
}

// The first target comes last, so that its residual map is there to be summed up.
std::array<Verdict, most_targets> FrameChecks::judge(const FrameView& view,
                                                     const FoldedFrame& frame,
                                                     const likelihood::Maximum& fitted,
                                                     std::size_t track_terms) {
  std::array<Verdict, most_targets> verdicts;
  const SeenParts parts = seen_parts(view);
  for (std::size_t k = fitted.model.count; k-- > 0;) {
    const auto std_of = [&](likelihood::OfTarget parameter) {
      const auto i = static_cast<Eigen::Index>(likelihood::place_of(k, parameter));
      return std::sqrt(fitted.covariance(i, i));
    };
    const FitFacts facts = {track_terms, fitted.model.log_width != 0, std_of(likelihood::delay),
                            std_of(likelihood::walk), std_of(likelihood::quadratic)};
    verdicts.at(k) = findings_.judge(frame, fitted.model, k, facts, parts);
  }
  return verdicts;
}

std::optional<Finding> FrameChecks::take_stray_light(FoldedFrame& frame, const DelayTrack& target) {
  const std::span<const double> counts = findings_.map().by_pulse();
  if (counts.size() < fewest_pulses) return std::nullopt;
  sorted_.assign(counts.begin(), counts.end());
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  const double usual = std::max(1.0, *middle);
  const double most = stray_ratio * usual + sure_deviations_of_many * std::sqrt(usual);
  std::array<double, most_stray> at_ns{};
  std::size_t stray = 0;
  double photons = 0, gain_nats = 0;
  for (std::size_t p = 0; p < counts.size(); ++p) {
    if (counts[p] <= most) continue;
    if (stray == most_stray) return std::nullopt;
    at_ns[stray++] = train_.segments.front().comb.times_ns[p];
    photons += counts[p] - usual;
    gain_nats += counts[p] * std::log(counts[p] / usual) - (counts[p] - usual);
  }
  if (stray == 0) return std::nullopt;
  stays_.resize(frame.size());
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double off_ns = frame.phase_ns[i] - target.at(frame.time_ns[i] / frame.length_ns);
    const bool is_stray = std::any_of(at_ns.begin(), at_ns.begin() + stray, [&](double pulse_ns) {
      return std::abs(std::remainder(off_ns - pulse_ns, train_.period_ns)) < pulse_reach_ns_;
    });
    stays_[i] = is_stray ? 0 : 1;
  }
  const double per_s = 1e9 / frame.seen_ns;
  cleaned_.take_some(stays_, frame);
  std::swap(cleaned_, frame);
  return Finding{finding_table()[phase_row].name, photons * per_s,
                 std::sqrt(photons + 2 * usual) * per_s, gain_nats};
}

void FrameChecks::put_back(FoldedFrame& frame) { std::swap(cleaned_, frame); }

const FoundList& FrameChecks::sum_up(const FoldedFrame& frame) {
  constexpr double fewest = 3, most = 50;
  for (FindingSums& sums : sums_) sums.add(frame);
  if (sums_.at(older_).frames() >= fewest) recent_ = sums_.at(older_).found();
  if (sums_.at(1 - older_).frames() >= most) {
    older_ = 1 - older_;
    sums_.at(1 - older_).clear();
  }
  return recent_;
}

}  // namespace splid::checks
