#pragma once

#include <cmath>
#include <functional>
#include <memory>

#include "estimator/checks/findings.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "tests/support/folded_maker.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::test {

inline FoldedMaker interleaved_maker() {
  return FoldedMaker(interleaved_pattern({180000, 189000}, 3780000));
}

// Makes frames, fits them, and judges the fits.
struct JudgedFrames {
  const FoldedMaker& made;
  std::size_t terms = 2;
  std::unique_ptr<PulseShape> shape = make_gaussian(0.1);
  FoldedFrame frame{made.train, 100000};
  likelihood::Maximizer maximizer{*shape, made.train, 100000, {1, 1, false}};
  checks::Findings findings{made.train, *shape, 100000};
  likelihood::Maximum maximum = {};

  using Visit = std::function<void(const checks::Verdict&)>;
  void visit(int frames, std::uint64_t seed, const Visit& visit) {
    for (int n = 0; n < frames; ++n) {
      made.make(frame, seed * 1000003 + static_cast<std::uint64_t>(n));
      maximizer.begin(frame);
      maximum = maximizer.maximize(made.truth(), {likelihood::free_set(1, terms)});
      if (!maximum.has_covariance) continue;
      const auto& c = maximum.covariance;
      visit(findings.judge(
          frame, maximum.model, 0,
          {terms, false, std::sqrt(c(0, 0)), std::sqrt(c(1, 1)), std::sqrt(c(2, 2))}));
    }
  }
};

}  // namespace splid::test
