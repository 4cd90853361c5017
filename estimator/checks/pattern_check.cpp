#include "estimator/checks/pattern_check.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "estimator/fold/blind_time.hpp"
#include "estimator/fold/kernel_choice.hpp"

namespace splid {
namespace {

constexpr std::size_t most_photons = 65536;
constexpr std::size_t chunk = 1024;  // photons whose phases are made at once
// Pulses of more photons hide so much of their late light from a blind detector that their width
// moves the place: at three photons 2 % of it by 14 deviations (docs/evidence/pulse-width.md).
constexpr double fewest_that_hide = 0.1;
// Such a window holds 87 % of a gaussian pulse's light, and not much background.
constexpr double half_window_widths = 1.5;

constexpr std::size_t fewest_for_misfit = 4;
constexpr double least_misfit = 0.1;
constexpr double deviations_of_misfit = 6;

// Design note: amplitudes that were never calibrated deviate by some 0.6 rms at worst. 300,000
// draws each were made of 2 to 40 pulses with 8 to 200 signal photons, and of these the draws kept
// in which the signal stands out by 16 nats. Beyond the limits below were at most 2e-5 of them with
// even pulses and 2e-4 with pulses that deviate by 0.6 rms, both with the fewest photons; from 30
// photons on it was none and 2e-4.
constexpr double most_uneven = 0.4;  // squared deviation that amplitudes may have, chance aside
constexpr double least_dark = 0.9;   // squared deviation that must be seen
constexpr double deviations_of_dark = 4.5;
constexpr double deviations_of_stray = 7;

// Design note: a pattern of many pulses that lies on light of another pattern has dark pulses, but
// a pattern of few pulses may find light for each of them. So light between its pulses is looked
// for. Such light may also come from other targets; three of them as bright as the target that was
// found leave it just as doubtful which of them is the target.
constexpr std::size_t fewest_for_strangers = 8;
constexpr double most_elsewhere = 2;  // squared light between the pulses, over that of the pulses
constexpr double least_mask_ns = 1;   // detectors are no slower, whatever pulse is configured
constexpr double most_masked = 0.75;
constexpr std::size_t most_bins = 65536;
// Phases of photons after which the detector is blind: bins, which are so much finer than a window.
constexpr std::size_t cover_bins = 65536;
constexpr double bins_in_window = 4;
// Those that tell how wide a pulse is: at a 16th of its width they make it 0.02 % wider.
constexpr double fine_bins_a_width = 16;
constexpr std::size_t most_fine_bins = std::size_t{1} << 20;

// Which of a stretch's photons, from `begin` to `end`, stands for the nth `step` of its photons:
// one after the other, at places in their step that are spread evenly.
//
// Design note: where each pulse is seen in each period, every second photon is from the same pulses
// in period after period.
std::size_t photon_of(std::size_t nth, std::size_t step, std::size_t begin, std::size_t end) {
  const std::uint64_t place_32 = (nth * 0x9E3779B97F4A7C15U) >> 32;  // the golden ratio's turns
  const auto in_step = static_cast<std::size_t>((place_32 * step) >> 32);
  return std::min(begin + nth * step + in_step, end - 1);
}

// Powers of two; 0 where that is too many.
std::size_t fine_bins(double period_ns, double width_ns) {
  const double bins = std::max(1.0, std::ceil(period_ns / width_ns * fine_bins_a_width));
  return bins > most_fine_bins ? 0 : std::bit_ceil(static_cast<std::size_t>(bins));
}

double whole_turns_off(double turns) { return turns - std::floor(turns); }

}  // namespace

PatternCheck::PatternCheck(const PulseTrain& train, const PulseShape& shape, double reach_ns,
                           std::size_t max_blind_photons, bool is_fitted)
    : train_(train),
      pulse_(shape, train.closest_ns, is_fitted),
      path_(shape, train.closest_ns),
      width_ns_(shape.width_ns()),
      window_ns_(2 * half_window_widths * shape.width_ns()),
      first_ns_(shape.peak_offset_ns() - window_ns_ / 2),
      last_ns_(shape.peak_offset_ns() + window_ns_ / 2),
      reach_ns_(reach_ns) {
  const double looked_at_first_ns = pulse_.looks() ? pulse_.first_ns() : first_ns_;
  const double looked_at_last_ns = pulse_.looks() ? pulse_.last_ns() : last_ns_;
  std::size_t pulses = 0;
  for (const PulseTrain::Stretch& stretch : train.stretches) pulses += stretch.comb.times_ns.size();
  for (const PulseTrain::Stretch& stretch : train.stretches) {
    const Comb& comb = stretch.comb;
    const double sure_ns = stretch.end_ns - stretch.begin_ns - train.circle_ns - 2 * reach_ns;
    const double turns = train.single()        ? 1
                         : stretch.copies == 0 ? 0
                                               : std::max(0.0, sure_ns / comb.period_ns);
    parts_.push_back({{comb, looked_at_first_ns, looked_at_last_ns},
                      CombWindow(comb, first_ns_, last_ns_).max_overlap(),
                      turns,
                      weights_.size(),
                      weights_.size() + parts_.size(),
                      bins_.size(),
                      pulse_.looks() ? fine_bins(comb.period_ns, shape.width_ns()) : 0});
    for (const double amplitude : comb.amplitudes) {
      weights_.push_back(amplitude * turns);
      turns_.push_back(turns);
    }
    if (pulses < fewest_for_strangers && turns > 0) add_bins(stretch, shape, parts_.back());
  }
  counts_.resize(weights_.size());
  light_.resize(weights_.size());
  seen_turns_.resize(weights_.size());
  covers_.resize(weights_.size() + parts_.size());
  has_fine_bins_ = max_blind_photons > most_photons;
  std::size_t most_fine = 0;
  for (const Part& part : parts_) {
    if (part.turns == 0) continue;
    most_fine = std::max(most_fine, part.fine_bins);
    has_fine_bins_ = has_fine_bins_ && part.fine_bins > 0;
  }
  phases_.resize(has_fine_bins_ ? std::max(cover_bins, most_fine) : cover_bins);
  note_kinds();
  double all = 0;
  for (const double weight : weights_) all += weight;
  for (double& weight : weights_) weight = all > 0 ? weight / all : 0;
}

// Puts pulses of much the same amplitude into one kind.
void PatternCheck::note_kinds() {
  std::vector<double> amplitudes;
  for (const PulseTrain::Stretch& stretch : train_.stretches) {
    const std::vector<double>& own = stretch.comb.amplitudes;
    amplitudes.insert(amplitudes.end(), own.begin(), own.end());
  }
  const auto [least, most] = std::minmax_element(amplitudes.begin(), amplitudes.end());
  const double range = *most - *least;
  constexpr double last = HidingLight::most_kinds - 1;
  for (const double amplitude : amplitudes) {
    const double kind = range > 0 ? std::round((amplitude - *least) / range * last) : 0;
    kinds_.push_back(static_cast<std::uint8_t>(kind));
  }
}

// Divides the comb's period into bins of a window's width, and marks as free the bins that the
// light of no pulse reaches.
void PatternCheck::add_bins(const PulseTrain::Stretch& stretch, const PulseShape& shape,
                            Part& part) {
  const Comb& comb = stretch.comb;
  const double before_ns = std::max(-shape.first_ns(), least_mask_ns);
  const double after_ns = std::max(shape.last_ns(), least_mask_ns);
  const auto bins = static_cast<std::size_t>(
      std::clamp(std::ceil(comb.period_ns / window_ns_), 1.0, static_cast<double>(most_bins)));
  const double bin_ns = comb.period_ns / static_cast<double>(bins);
  std::vector<std::uint8_t> is_free(bins, 1);
  for (const double time_ns : comb.times_ns) {
    const double first = std::floor((time_ns - before_ns) / bin_ns);
    const double last = std::floor((time_ns + after_ns) / bin_ns);
    for (double bin = first; bin <= last && bin < first + static_cast<double>(bins); ++bin) {
      const double turned =
          bin - static_cast<double>(bins) * std::floor(bin / static_cast<double>(bins));
      is_free[static_cast<std::size_t>(turned)] = 0;
    }
  }
  const auto masked = std::count(is_free.begin(), is_free.end(), std::uint8_t{0});
  if (static_cast<double>(masked) > most_masked * static_cast<double>(bins)) return;
  part.bins_per_turn = static_cast<double>(bins);
  is_free_.insert(is_free_.end(), is_free.begin(), is_free.end());
  bins_.resize(is_free_.size());
}

PatternVerdict PatternCheck::judge(const FoldedFrame& frame, const FrameParameters& found) {
  path_.begin(found.signal_per_pulse * train_.mean_amplitude(), found.background_per_ns,
              train_.single() && frame.seen_ns > 0.99 * frame.length_ns * frame.scale);
  PatternVerdict verdict;
  if (frame.size() == 0) return verdict;
  const std::size_t step = 1 + (frame.size() - 1) / most_photons;
  const double part_seen = 1 / static_cast<double>(step);
  const bool do_hide =
      frame.blind != nullptr &&
      found.signal_per_pulse * frame.blind->share * train_.mean_amplitude() >= fewest_that_hide;
  do_all_tell_width_ = do_hide && has_fine_bins_ && step > 1;
  pulse_step_ = do_all_tell_width_ ? 1 : step;
  count(frame, found.line, step);
  const double periods = frame.seen_ns / (train_.period_ns * frame.scale);
  expect(frame, found, periods);
  const Share share =
      share_out(found.background_per_ns * window_ns_ * frame.scale * periods * part_seen);
  if (!(share.expected > 0)) return verdict;
  // Where the windows of pulses overlap, a photon is counted at each of these pulses.
  std::size_t overlap = 1;
  for (const Part& part : parts_) overlap = std::max(overlap, part.overlap);
  const double dark_chance =
      static_cast<double>(overlap) * (share.chance + most_uneven * share.of_uneven);
  if (share.excess > least_dark * share.scale &&
      share.excess > most_uneven * share.scale + deviations_of_dark * std::sqrt(dark_chance)) {
    verdict.fault = PatternFault::dark_pulses;
  } else if (has_stray_pulses(share)) {
    verdict.fault = PatternFault::stray_pulses;
  }
  if (!train_.single() || counts_.size() < fewest_for_misfit) return verdict;
  if (share.excess < deviations_of_misfit * std::sqrt(share.chance)) return verdict;
  const double misfit = std::sqrt(share.excess / share.scale);
  if (misfit >= least_misfit) verdict.amplitude_misfit = misfit;
  return verdict;
}

// Where a dead time is modelled, it must be longer than the times that are looked at, so that the
// first photon of a pulse hides all that come after it.
PulseVerdict PatternCheck::judge_pulse(const FoldedFrame& frame,
                                       const FrameParameters& found) const {
  if (frame.size() == 0) return {};
  if (frame.blind != nullptr && frame.blind->dead_time_ns < pulse_.last_ns() - pulse_.first_ns()) {
    return {};
  }
  return pulse_.judge(background_in_bin(frame, found.background_per_ns), hiding_);
}

ShapeVerdict PatternCheck::judge_shape(const FoldedFrame& frame, const FrameParameters& found,
                                       double sigma_ns) const {
  if (frame.size() == 0) return {};
  return pulse_.judge_shape(background_in_bin(frame, found.background_per_ns),
                            sigma_ns / width_ns_);
}

// The photons of background that each of the pulse check's bins is expected to have.
double PatternCheck::background_in_bin(const FoldedFrame& frame, double background_per_ns) const {
  const double periods =
      frame.seen_ns / (train_.period_ns * frame.scale) / static_cast<double>(pulse_step_);
  double turns = 0;
  for (const double seen : seen_turns_) turns += seen;
  return background_per_ns * pulse_.bin_ns() * frame.scale * periods * turns;
}

PathVerdict PatternCheck::judge_path(const FoldedFrame& frame, bool is_bent) const {
  const std::size_t step = 1 + (std::max<std::size_t>(frame.size(), 1) - 1) / most_photons;
  const double blind_ns = frame.blind != nullptr ? frame.blind->blind_ns : 0;
  return path_.judge(train_.pulses_per_ns * (frame.seen_ns - blind_ns) / static_cast<double>(step),
                     is_bent);
}

// A Poisson count n of mean E has the variance E, and (n - E)^2 has the variance 2 E^2 + E. Where
// the mean is off by u, the variance of the latter is larger by 4 E u^2.
PatternCheck::Share PatternCheck::share_out(double background_per_turn) const {
  Share share;
  double all = 0, background = 0;
  for (std::size_t p = 0; p < counts_.size(); ++p) {
    all += counts_[p];
    background += background_per_turn * seen_turns_[p];
  }
  share.expected = all - background;
  for (std::size_t p = 0; p < counts_.size(); ++p) {
    const double light = share.expected * light_[p];
    const double dark = background_per_turn * seen_turns_[p];
    const double expected = light + dark;
    const double off = counts_[p] - expected;
    share.excess += off * off - expected;
    share.chance += 2 * expected * expected + expected;
    share.of_uneven += 4 * light * light * expected;
    share.scale += light * light;
    share.inside += (counts_[p] - dark) * (counts_[p] - dark);
  }
  return share;
}

// Light that is spread evenly over the free bins is background. Light that is not shows in the sum
// of the squared counts.
bool PatternCheck::has_stray_pulses(const Share& share) const {
  double excess = 0, chance = 0;
  for (const Part& part : parts_) {
    const auto bins = static_cast<std::size_t>(part.bins_per_turn);
    double sum = 0, squares = 0, free = 0;
    for (std::size_t k = part.first_bin; k < part.first_bin + bins; ++k) {
      if (is_free_[k] == 0) continue;
      const double n = bins_[k];
      sum += n;
      squares += n * n;
      free += 1;
    }
    if (free == 0) continue;
    const double mean = sum / free;
    excess += squares - mean * sum - sum;
    chance += free * (2 * mean * mean + mean);
  }
  return excess > most_elsewhere * share.inside + deviations_of_stray * std::sqrt(chance);
}

// What each pulse is expected to show of the light and of the background.
void PatternCheck::expect(const FoldedFrame& frame, const FrameParameters& found, double periods) {
  std::copy(weights_.begin(), weights_.end(), light_.begin());
  std::copy(turns_.begin(), turns_.end(), seen_turns_.begin());
  hiding_ = {};
  if (frame.blind == nullptr) return;
  double all = 0;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Part& part = parts_[s];
    const std::vector<double>& amplitudes = train_.stretches[s].comb.amplitudes;
    double covers = 0;
    for (std::size_t k = 0; k < amplitudes.size(); ++k) {
      const std::size_t p = part.first_pulse + k;
      covers += covers_[part.first_cover + k];
      const double turns = periods * turns_[p];
      const double blind = turns > 0 ? frame.blind->share * covers / turns : 0;
      const double alive = std::clamp(1 - blind, 0.0, 1.0);
      const double own = found.signal_per_pulse * frame.blind->share * amplitudes[k];
      light_[p] *= alive * (own > 0 ? -std::expm1(-own) / own : 1);
      seen_turns_[p] *= alive;
      all += light_[p];
      add_hiding(kinds_[p], periods * seen_turns_[p], turns - periods * seen_turns_[p], own);
    }
  }
  for (double& light : light_) light = all > 0 ? light / all : 0;
  settle_hiding(frame, found);
}

// Adds pulses that the detector was alive for, and those that it was blind for, of a kind.
void PatternCheck::add_hiding(std::size_t kind, double pulses, double blind, double photons) {
  HidingLight::Kind& sums = hiding_.kinds.at(kind);
  sums.pulses += pulses;
  sums.photons += pulses * photons;
  sums.wakes_per_ns += blind;
}

// From sums to means, of those kinds that there are. Each blind time ends once.
void PatternCheck::settle_hiding(const FoldedFrame& frame, const FrameParameters& found) {
  const double dead_ns = frame.blind->dead_time_ns / frame.scale;
  hiding_.background_per_ns = frame.blind->share * found.background_per_ns * frame.scale;
  for (const HidingLight::Kind& sums : hiding_.kinds) {
    if (!(sums.photons > 0)) continue;
    hiding_.kinds.at(hiding_.count++) = {sums.photons / sums.pulses,
                                         sums.pulses / static_cast<double>(pulse_step_),
                                         sums.wakes_per_ns / sums.pulses / dead_ns};
  }
}

// Counts one of `step` photons each at the pulses and in the bins.
void PatternCheck::count(const FoldedFrame& frame, DelayLine line, std::size_t step) {
  std::fill(counts_.begin(), counts_.end(), 0.0);
  std::fill(bins_.begin(), bins_.end(), 0);
  std::fill(covers_.begin(), covers_.end(), 0.0);
  pulse_.clear();
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    count_part(frame, line, step, s);
    if (frame.blind != nullptr) cover_part(frame, line, s);
  }
}

void PatternCheck::count_part(const FoldedFrame& frame, DelayLine line, std::size_t step,
                              std::size_t stretch) {
  const Part& part = parts_[stretch];
  if (part.turns == 0) return;
  const Comb& comb = train_.stretches[stretch].comb;
  const double turns = (line.delay_ns + train_.stretches[stretch].begin_ns) / comb.period_ns;
  const double slope = line.travel_ns / (frame.length_ns * comb.period_ns);
  const auto count_photon = [&](std::size_t i) {
    const double phase =
        whole_turns_off(frame.phase_ns[i] / comb.period_ns - turns - slope * frame.time_ns[i]);
    count_at(part, phase, comb.period_ns, frame.time_ns[i] / frame.length_ns);
    if (part.bins_per_turn == 0) return;
    const auto bin = static_cast<std::size_t>(phase * part.bins_per_turn);
    const auto last = static_cast<std::size_t>(part.bins_per_turn) - 1;
    ++bins_[part.first_bin + std::min(bin, last)];
  };
  if (part.bins_per_turn == 0) {
    visit_near(frame, line, step, stretch, count_photon);
    return;
  }
  const std::size_t begin = frame.group_begin(stretch);
  const std::size_t end = frame.group_end[stretch];
  for (std::size_t n = 0; begin + n * step < end; ++n) count_photon(photon_of(n, step, begin, end));
}

// Notes when the detector was blind after the photons of a stretch, at the pulses that come after a
// photon's own: covers_ has a part's steps, up where such a time begins and down after its end.
//
// Design note: all photons are looked at, also where their counts are those of a part. A part would
// tell how often the detector was alive only to within its own chance, which is no part of what the
// counts are judged by: where it is alive for a tenth of the time, a tenth of the pulses' light.
// Very many photons are counted in bins of their phase first, which costs a quarter as much. These
// then tell how wide bright pulses are, too.
void PatternCheck::cover_part(const FoldedFrame& frame, DelayLine line, std::size_t stretch) {
  const Part& part = parts_[stretch];
  const double blind_ns = frame.blind->dead_time_ns / frame.scale;
  if (part.turns == 0 || blind_ns <= window_ns_) return;
  const double period_ns = train_.stretches[stretch].comb.period_ns;
  const double to_ns = period_ns * 0x1p-32;
  const auto begin_32 = static_cast<std::uint64_t>(window_ns_ / to_ns);
  const auto end_32 = static_cast<std::uint64_t>(blind_ns / to_ns);
  double* steps = covers_.data() + part.first_cover;
  const auto turn = [&](std::uint64_t time_32, double step) {
    const auto phase_32 = static_cast<std::uint32_t>(time_32);
    steps[part.window.pulses_up_to(phase_32 * to_ns, phase_32)] += step;
    return static_cast<double>(time_32 >> 32);
  };
  double turns = 0;
  const auto cover = [&](std::uint64_t phase_32, double photons) {
    const double from_turn = turn(phase_32 + begin_32, photons);
    turns += photons * (turn(phase_32 + end_32, -photons) - from_turn);
  };
  const std::size_t photons = frame.group_end[stretch] - frame.group_begin(stretch);
  if (!do_all_tell_width_ &&
      (photons <= most_photons || period_ns / cover_bins > window_ns_ / bins_in_window)) {
    for_phases(frame, line, 1, stretch, [&](std::size_t, const auto& phases) {
      for (const std::uint32_t phase_32 : phases) cover(phase_32, 1);
    });
  } else {
    const std::size_t bins = do_all_tell_width_ ? part.fine_bins : cover_bins;
    const int shift = 32 - std::countr_zero(bins);  // of a phase in 2^-32 to its bin
    std::fill_n(phases_.begin(), bins, 0);
    for_phases(frame, line, 1, stretch, [&](std::size_t, const auto& phases) {
      for (const std::uint32_t phase_32 : phases) ++phases_[phase_32 >> shift];
    });
    if (do_all_tell_width_) count_about_pulses(part, train_.stretches[stretch].comb);
    const std::size_t together = do_all_tell_width_ ? most_together(part, period_ns) : 1;
    for (std::size_t bin = 0; bin < bins; bin += together) {
      double count = 0;
      for (std::size_t k = bin; k < bin + together; ++k) count += phases_[k];
      if (count > 0) cover((2 * bin + together) << shift >> 1, count);
    }
  }
  steps[0] += turns;
}

// So many fine bins are taken together where they say when the detector was blind.
std::size_t PatternCheck::most_together(const Part& part, double period_ns) const {
  const double fine_ns = period_ns / static_cast<double>(part.fine_bins);
  return std::bit_floor(static_cast<std::size_t>(window_ns_ / bins_in_window / fine_ns));
}

// Where pulses hide much of their light, all photons tell how wide they are, by their fine bins.
//
// Design note: 65,536 of the photons of a frame of 50 ms with 3 photons a pulse know the width to
// 0.3 %, which moves the place by two deviations of all 510,000.
void PatternCheck::count_about_pulses(const Part& part, const Comb& comb) {
  const double bin_ns = comb.period_ns / static_cast<double>(part.fine_bins);
  for (const double time_ns : comb.times_ns) {
    const double first = std::floor((time_ns + part.window.first_ns()) / bin_ns);
    const double last = std::floor((time_ns + part.window.last_ns()) / bin_ns);
    for (double at = first; at <= last; ++at) {
      const auto bin = static_cast<std::size_t>(static_cast<std::int64_t>(at)) % part.fine_bins;
      if (phases_[bin] > 0) pulse_.add_spread(at * bin_ns - time_ns, bin_ns, phases_[bin]);
    }
  }
}

// Counts a photon, at a share of the frame from -1/2 to 1/2, at the pulses whose windows hold it.
void PatternCheck::count_at(const Part& part, double phase, double period_ns, double share) {
  const auto phase_32 = static_cast<std::uint32_t>(static_cast<std::uint64_t>(phase * 0x1p32));
  for (const CombWindow::Pulse& pulse : part.window.candidates(phase_32)) {
    const double residual_ns = phase * period_ns - pulse.time_ns;
    const bool inside = residual_ns >= first_ns_ && residual_ns <= last_ns_;
    counts_[part.first_pulse + part.window.index_of(pulse)] += inside ? 1 : 0;
    if (residual_ns < part.window.first_ns() || residual_ns > part.window.last_ns()) continue;
    if (pulse_.looks() && !do_all_tell_width_) pulse_.add(residual_ns);
    path_.add(residual_ns, share);
  }
}

// Visits one of `step` photons of a stretch each, in chunks: with the number of the first of them
// among those that are visited, and their phases in 2^-32 of the comb's period.
template <class Visit>
void PatternCheck::for_phases(const FoldedFrame& frame, DelayLine line, std::size_t step,
                              std::size_t stretch, const Visit& visit) const {
  const SearchKernels& kernels = best_search_kernels();
  const double period_ns = train_.stretches[stretch].comb.period_ns;
  const double to_32 = 0x1p32 / period_ns;
  const double delay_32 = std::remainder(line.delay_ns, period_ns) * to_32;
  const double slope_32 = line.travel_ns / frame.length_ns * to_32;
  std::array<std::uint32_t, chunk> some_folded, phases;
  std::array<double, chunk> some_times;
  const std::size_t begin = frame.group_begin(stretch);
  const std::size_t end = frame.group_end[stretch];
  const std::size_t all = (end - begin + step - 1) / step;
  for (std::size_t first = 0; first < all; first += chunk) {
    const std::size_t count = std::min(chunk, all - first);
    const std::uint32_t* folded = frame.phase_32.data() + begin + first;
    const double* times = frame.time_ns.data() + begin + first;
    if (step > 1) {
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t photon = photon_of(first + k, step, begin, end);
        some_folded[k] = frame.phase_32[photon];
        some_times[k] = frame.time_ns[photon];
      }
      folded = some_folded.data();
      times = some_times.data();
    }
    kernels.line_phases(phases.data(), folded, times, delay_32, slope_32, count);
    visit(first, std::span(phases.data(), count));
  }
}

// Visits those of one of `step` photons each of a stretch that may be near a pulse.
//
// Design note: the kernels pick them at 1 ns a photon. The division and the look at the pulses cost
// five times as much, and few photons are near a pulse.
template <class Visit>
void PatternCheck::visit_near(const FoldedFrame& frame, DelayLine line, std::size_t step,
                              std::size_t stretch, const Visit& visit) const {
  const SearchKernels& kernels = best_search_kernels();
  const CombWindow& window = parts_[stretch].window;
  std::array<std::uint32_t, chunk> picked;
  const std::size_t begin = frame.group_begin(stretch);
  const std::size_t end = frame.group_end[stretch];
  for_phases(frame, line, step, stretch, [&](std::size_t first, const auto& phases) {
    const std::size_t near =
        kernels.pick(picked.data(), phases.data(), window.flags(), window.shift(), phases.size());
    for (std::size_t n = 0; n < near; ++n) visit(photon_of(first + picked[n], step, begin, end));
  });
}

}  // namespace splid
