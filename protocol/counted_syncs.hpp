#pragma once

#include <cstdint>

namespace splid {

// When the syncs of a recording came that counts syncs and does not time them: sync k is at k
// pattern periods, in the generator's own clock, in which each period has the same length.
class CountedSyncs {
 public:
  // period_ps: the pattern period, 1 ps to 1 s.
  // Errors: Error(Fault::data) for a period outside that range.
  explicit CountedSyncs(double period_ps);

  // The number times the period, to a tenth of a picosecond up to 1e12 syncs. Unsigned, since the
  // numbers of a damaged file may be anything.
  [[nodiscard]] std::int64_t time_ps(std::uint64_t number) const {
    constexpr std::uint64_t at_most = (std::uint64_t{1} << 53U) - 1;
    // Signed numbers are converted in one instruction, unsigned ones in several.
    const auto rest = static_cast<std::int64_t>(number & at_most);
    const double rest_ps = static_cast<double>(rest) * rest_of_period_ps_;
    const std::uint64_t whole_ps = number * static_cast<std::uint64_t>(whole_period_ps_);
    return static_cast<std::int64_t>(whole_ps + static_cast<std::uint64_t>(rounded(rest_ps)));
  }

  // The nearest whole number of one that is not negative. A call of std::llround() for each record
  // takes longer than all the rest.
  static std::int64_t rounded(double value) {
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): see above
    return static_cast<std::int64_t>(value + 0.5);
  }

 private:
  std::int64_t whole_period_ps_;
  double rest_of_period_ps_;
};

// The time of a step of a photon's time since its sync, in ps.
// resolution_s: 1e-15 to 1e-3 s. Errors: Error(Fault::data) for a resolution outside that range.
double step_of_time_ps(double resolution_s);

}  // namespace splid
