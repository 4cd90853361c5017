#include "estimator/fold/search_kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "estimator/fold/kernel_choice.hpp"

namespace splid {
namespace {

// Lengths below, at and above those of the kernels' loops, and of any vector.
constexpr std::size_t lengths[] = {0, 1, 31, 32, 33, 255, 256, 257, 300, 1061};

template <class Number>
std::vector<Number> numbers(std::size_t count, std::uint32_t most, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::uint32_t> any(0, most);
  std::vector<Number> made(count);
  for (Number& number : made) number = static_cast<Number>(any(random));
  return made;
}

TEST(SearchKernels, SumsOfTwiceTheBitsDoNotWrap) {
  for (const VectorLevel level : runnable_vector_levels()) {
    for (const std::size_t count : lengths) {
      const auto a = numbers<std::uint8_t>(count, 255, 1);
      const auto b = numbers<std::uint8_t>(count, 255, 2);
      std::vector<std::uint16_t> wide(count);
      search_kernels(level).add_8_to_16(wide.data(), a.data(), b.data(), count);
      const auto c = numbers<std::uint16_t>(count, 65535, 3);
      const auto d = numbers<std::uint16_t>(count, 65535, 4);
      std::vector<std::uint32_t> wider(count);
      search_kernels(level).add_16_to_32(wider.data(), c.data(), d.data(), count);
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(wide[i], a[i] + b[i]) << vector_level_name(level);
        ASSERT_EQ(wider[i], std::uint32_t{c[i]} + d[i]) << vector_level_name(level);
      }
    }
  }
}

TEST(SearchKernels, BytesAreAddedAndTheLargestFound) {
  for (const VectorLevel level : runnable_vector_levels()) {
    const SearchKernels& kernels = search_kernels(level);
    for (const std::size_t count : lengths) {
      const auto a = numbers<std::uint8_t>(count, 255, 1);
      auto sums = numbers<std::uint8_t>(count, 255, 2);
      std::vector<std::uint8_t> out(count);
      kernels.bytes.add(out.data(), a.data(), sums.data(), count);
      kernels.bytes.accumulate(sums.data(), a.data(), count);
      EXPECT_EQ(out, sums) << vector_level_name(level);
      std::uint8_t most = 0;
      for (const std::uint8_t sum : sums) most = std::max(most, sum);
      EXPECT_EQ(kernels.bytes.largest(sums.data(), count), most) << vector_level_name(level);
    }
  }
}

// add_four() of a type, which wraps where a sum does not fit, against a loop.
template <class Number, class AddFour>
void expect_four_lines(AddFour add_four, std::size_t count, const char* level) {
  const std::uint32_t most = std::numeric_limits<Number>::max();
  const auto a = numbers<Number>(count, most, 1);
  const auto b = numbers<Number>(count + 1, most, 2);
  const auto c = numbers<Number>(count + 2, most, 3);
  const auto d = numbers<Number>(count + 3, most, 4);
  const std::size_t stride = count + 5;
  std::vector<Number> out(4 * stride, Number{77});
  add_four(out.data(), stride, a.data(), b.data(), c.data(), d.data(), count);
  for (std::size_t n = 0; n < 4; ++n) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto expected =
          static_cast<Number>(a[i] + b[i + n / 2] + c[i + (n + 1) / 2] + d[i + n]);
      ASSERT_EQ(out[n * stride + i], expected) << level << ' ' << sizeof(Number) << ' ' << n;
    }
    for (std::size_t i = count; i < stride; ++i) ASSERT_EQ(out[n * stride + i], 77) << level;
  }
}

TEST(SearchKernels, FourLinesAreSumsOfFourRows) {
  for (const VectorLevel level : runnable_vector_levels()) {
    const SearchKernels& kernels = search_kernels(level);
    for (const std::size_t count : lengths) {
      expect_four_lines<std::uint8_t>(kernels.bytes.add_four, count, vector_level_name(level));
      expect_four_lines<std::uint16_t>(kernels.words.add_four, count, vector_level_name(level));
      expect_four_lines<std::uint32_t>(kernels.longs.add_four, count, vector_level_name(level));
    }
  }
}

// first_above() of a type, from every place on, against a loop over the sums.
template <class Number, class FirstAbove>
void expect_first_above(FirstAbove first_above, std::size_t count, const char* level) {
  const std::uint32_t half = std::numeric_limits<Number>::max() / 2;
  const auto a = numbers<Number>(count, half, 5);
  const auto b = numbers<Number>(count, half, 6);
  for (const double share : {0.0, 0.5, 0.9, 0.99, 1.0}) {
    const auto least = static_cast<Number>(2.0 * half * share);
    for (std::size_t from = 0; from <= count; ++from) {
      std::size_t expected = from;
      while (expected < count && a[expected] + b[expected] <= least) ++expected;
      ASSERT_EQ(first_above(a.data(), b.data(), from, count, least), expected)
          << level << ' ' << sizeof(Number) << ' ' << count << ' ' << from;
    }
  }
}

TEST(SearchKernels, TheFirstSumAboveALimitIsFound) {
  for (const VectorLevel level : runnable_vector_levels()) {
    const SearchKernels& kernels = search_kernels(level);
    for (const std::size_t count : lengths) {
      const char* name = vector_level_name(level);
      expect_first_above<std::uint8_t>(kernels.bytes.first_above, count, name);
      expect_first_above<std::uint16_t>(kernels.words.first_above, count, name);
      expect_first_above<std::uint32_t>(kernels.longs.first_above, count, name);
    }
  }
}

TEST(SearchKernels, ADelayCellIsThatOfTheExactPhase) {
  constexpr std::size_t count = 1061;
  const auto phases = numbers<std::uint32_t>(count, 0xffffffff, 7);
  const auto rows = numbers<std::uint32_t>(count, 1 << 20, 8);
  for (const VectorLevel level : runnable_vector_levels()) {
    for (const std::uint32_t bins : {1U, 180U, 3780U, 1U << 20}) {
      std::vector<std::uint32_t> cells(count);
      search_kernels(level).delay_cells(cells.data(), rows.data(), phases.data(), 0xfedcba98, count,
                                        bins);
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t delay =
            (phases[i] + (std::uint64_t{1} << 32) - 0xfedcba98) % 0x100000000;
        const auto bin = static_cast<std::uint32_t>(static_cast<double>(delay) * 0x1p-32 * bins);
        ASSERT_EQ(cells[i], rows[i] + bin) << vector_level_name(level);
      }
    }
  }
}

// Phases against those of long doubles, over frames of a millisecond to a minute, with photons on
// whole turns, just beside them, and anywhere. Every level has the same bits.
TEST(SearchKernels, PhotonsAreFoldedAsLongDoublesSay) {
  for (const double half_ps : {5e8, 2.5e10, 3e13}) {
    SearchKernels::Fold by = {1'000'000'000'000'007, 0.999e-3, 1 / 3780000.0, 0.25, 0, 3780};
    by.curvature = 0.3 / (half_ps * half_ps);
    std::vector<std::int64_t> photons;
    for (const std::int64_t turn : {-200, -1, 0, 1, 77}) {
      for (const std::int64_t beside : {-1, 0, 1}) {
        photons.push_back(by.zero_ps + turn * 3780000 + 945000 + beside);
      }
    }
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> any(-half_ps, half_ps);
    while (photons.size() < 1061) photons.push_back(by.zero_ps + std::llround(any(random)));
    std::vector<double> times, phases;
    std::vector<std::uint32_t> phases_32;
    for (const VectorLevel level : runnable_vector_levels()) {
      std::vector<double> t(photons.size()), p(photons.size());
      std::vector<std::uint32_t> p_32(photons.size());
      search_kernels(level).fold(t.data(), p.data(), p_32.data(), photons.data(), by,
                                 photons.size());
      if (times.empty()) times = t, phases = p, phases_32 = p_32;
      ASSERT_EQ(t, times) << vector_level_name(level);
      ASSERT_EQ(p, phases) << vector_level_name(level);
      ASSERT_EQ(p_32, phases_32) << vector_level_name(level);
    }
    const double rounding = 4e-16 * half_ps * by.turns_per_ps + 1e-15;  // of a turn
    for (std::size_t i = 0; i < photons.size(); ++i) {
      const auto x = static_cast<long double>(photons[i] - by.zero_ps);
      const long double turns = x * by.turns_per_ps - by.turns_at_zero - by.curvature * x * x;
      const auto off = static_cast<double>(std::remainder(phases[i] / 3780.0L - turns, 1.0L));
      ASSERT_EQ(times[i], static_cast<double>(x) * by.ns_per_ps);
      ASSERT_LT(std::abs(off), rounding) << photons[i];
      ASSERT_GE(phases[i], 0);
      ASSERT_LT(phases[i], 3780);
      const auto whole = static_cast<std::uint32_t>(std::llround(phases[i] / 3780 * 0x1p32));
      ASSERT_LE(std::min(whole - phases_32[i], phases_32[i] - whole), 1U);
    }
  }
}

// Just below a whole turn, where the phase rounds to a whole period, it is 0.
TEST(SearchKernels, APhaseIsBelowThePeriod) {
  const std::vector<std::int64_t> photons(9, 0);
  for (const VectorLevel level : runnable_vector_levels()) {
    std::vector<double> times(9), phases(9);
    std::vector<std::uint32_t> phases_32(9);
    search_kernels(level).fold(times.data(), phases.data(), phases_32.data(), photons.data(),
                               {0, 1e-3, 1 / 3780000.0, 1e-17, 0, 3780}, photons.size());
    for (const double phase : phases) EXPECT_EQ(phase, 0);
    for (const std::uint32_t phase : phases_32) EXPECT_EQ(phase, 0U);
  }
}

}  // namespace
}  // namespace splid
