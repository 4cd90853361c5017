#include "estimator/checks/findings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "estimator/checks/finding_sums.hpp"
#include "tests/estimator/checks/judged_frames.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/sanitized.hpp"

namespace splid::checks {
namespace {

using test::FoldedMaker;
using test::interleaved_maker;
using test::JudgedFrames;
using Photon = FoldedMaker::Photon;
using Random = std::mt19937_64;

constexpr double finding_sigma_ns = 0.1;

TEST(FindingTable, EachRowNamesAKeyOfTheConfiguration) {
  bool has[finding_names] = {};
  for (const FindingRow& row : finding_table()) {
    has[static_cast<std::size_t>(row.name)] = true;
    EXPECT_EQ(&row_of(row.name) <= &row, true);
    const std::string advice = row.advice;
    bool names_key = false;
    for (const char* key : {"pulse.", "scene.", "pattern.", "frame.length_ms", "detector"}) {
      names_key = names_key || advice.find(key) != std::string::npos;
    }
    EXPECT_TRUE(names_key && advice.back() == '.') << to_string(row.name);
  }
  for (const bool one : has) EXPECT_TRUE(one);
}

// The screen's squares are chi squared of its degrees: their mean over n frames is known to
// sqrt(2 / (n degrees)). The vibration's many terms have less where photons are few.
TEST(Findings, AreNotSaidOfWhatTheModelHas) {
  struct Case {
    double photons, background;
  };
  const int frames = test::times(150);
  for (const Case& of : {Case{30, 1e-5}, Case{100, 1e-3}, Case{713, 1.75e-4}}) {
    FoldedMaker made = interleaved_maker();
    made.photons = of.photons, made.background_per_ns = of.background;
    JudgedFrames judged{made};
    std::array<double, rows_with_directions> squares{}, degrees{}, lean{};
    int said = 0;
    judged.visit(frames, 7, [&](const Verdict& verdict) {
      said += !verdict.found.all().empty() ? 1 : 0;
      for (std::size_t row = 0; row < rows_with_directions; ++row) {
        const RowScore& of_row = judged.findings.scores().rows[row];
        squares[row] += of_row.squares, degrees[row] += of_row.degrees;
        lean[row] += of_row.score[0] / std::sqrt(of_row.information[0] * frames);
      }
    });
    EXPECT_EQ(said, 0) << of.photons;
    for (std::size_t row = 0; row < rows_with_directions; ++row) {
      EXPECT_LT(squares[row] / degrees[row], 1 + 5 * std::sqrt(2 / degrees[row])) << row;
      EXPECT_LT(std::abs(lean[row]), 4) << of.photons << ' ' << row;
    }
  }
}

struct Scene {
  const char* what;
  FindingName name;
  double value, within;
  std::function<void(FoldedMaker&)> change;
};

std::function<void(FoldedMaker&)> light(std::function<void(Photon&, Random&)> scene) {
  return [scene = std::move(scene)](FoldedMaker& made) { made.scene = scene; };
}

double drawn(Random& random) { return std::uniform_real_distribution<double>(0, 1)(random); }

// The values are the scene's own, to what one step of the family leaves. [P]'s light.
TEST(Findings, SayWhatTheSceneHasBeyondTheModel) {
  const double acceleration = 6e9 * 299792458.0 * 0.1 / (50e6 * 50e6);
  const double jerk = 60e18 * 299792458.0 * 0.1 / std::pow(50e6, 3);
  const std::vector<Scene> scenes = {
      {"width", FindingName::pulse_width, 0.3, 0.02, [](auto& m) { m.sigma_ns = 0.13; }},
      {"tail", FindingName::pulse_tail, 0.3, 0.03, light([](Photon& p, Random& r) {
         if (drawn(r) < 0.3) p.offset_ns += -0.2 * std::log(drawn(r));
       })},
      {"path curves", FindingName::acceleration, acceleration, 0.05 * acceleration,
       light([](Photon& p, Random&) { p.offset_ns += 0.1 * (3 * p.u() * p.u() - 1) / 2; })},
      {"path turns", FindingName::jerk, jerk, 0.05 * jerk,
       light([](Photon& p, Random&) { p.offset_ns += 0.1 * (5 * p.u() * p.u() - 3) * p.u() / 2; })},
      {"vibrates", FindingName::vibration, 0.05 * 149.9, 1, light([](Photon& p, Random&) {
         p.offset_ns += 0.05 * std::sqrt(2.0) * std::sin(6.283 * 6.3 * p.share);
       })},
      {"a third is dark", FindingName::fading, 2, 1.2,
       light([](Photon& p, Random&) { p.is_seen = p.share > -1.0 / 6; })},
      {"light beside", FindingName::unmodelled_light, 0.3 * 713 / 0.05, 800,
       light([](Photon& p, Random& r) {
         if (drawn(r) < 0.3) p.offset_ns = (r() % 2 == 0 ? 1 : -1) * (0.4 + 1.2 * drawn(r));
       })},
      {"half of the pulses are dark", FindingName::wrong_pattern, 0.5, 0.05, [](FoldedMaker& m) {
         for (int k = 0; k < 40; ++k) m.amplitudes.push_back(k % 2);
       }}};
  for (const Scene& scene : scenes) {
    FoldedMaker made = interleaved_maker();
    scene.change(made);
    JudgedFrames judged{made};
    constexpr int frames = 25;
    int said = 0;
    double value = 0;
    judged.visit(frames, 9, [&](const Verdict& verdict) {
      if (verdict.found.all().empty() || verdict.found.all()[0].name != scene.name) return;
      ++said;
      value += verdict.found.all()[0].value;
    });
    EXPECT_GE(said, 0.92 * frames) << scene.what;
    EXPECT_NEAR(value / said, scene.value, scene.within) << scene.what;
  }
}

// A tail of 30 % moves most frames by more than five deviations.
TEST(Findings, TellByHowMuchTheValuesAreOff) {
  FoldedMaker made = interleaved_maker();
  made.scene = [](Photon& p, Random& r) {
    if (drawn(r) < 0.3) p.offset_ns += -0.2 * std::log(drawn(r));
  };
  JudgedFrames judged{made};
  int far = 0, far_after = 0;
  judged.visit(test::times(40), 3, [&](const Verdict& verdict) {
    const double off = std::abs(judged.maximum.model.targets[0].track.delay_ns - 1898);
    const double std = std::sqrt(judged.maximum.covariance(0, 0));
    EXPECT_GT(verdict.wider.least_delay_ns, 0.8 * std);
    far += off > 5 * std ? 1 : 0;
    far_after += off > 4 * std::hypot(std, verdict.wider.off_delay_ns) ? 1 : 0;
  });
  EXPECT_GT(far, test::times(20));
  EXPECT_EQ(far_after, 0);
}

TEST(Findings, JudgeATargetByTheLightBesideItsPulses) {
  FoldedMaker made = interleaved_maker();
  made.photons = 100;
  made.track.walk_ns = 0;
  const std::vector<double> times = made.train.segments.front().comb.times_ns;
  made.foreign = [&](auto& others, Random& random) {
    for (int n = 0; n < 2000; ++n) {
      others.emplace_back(1898 + times[random() % 40] + 4 * (drawn(random) - 0.5),
                          drawn(random) - 0.5);
    }
  };
  JudgedFrames judged{made};
  judged.visit(5, 3, [&](const Verdict& verdict) {
    EXPECT_FALSE(verdict.found.all().empty());
    ASSERT_TRUE(verdict.gain_beside_nats.has_value());
    EXPECT_LT(*verdict.gain_beside_nats, 0.4 * judged.maximum.gain_nats);
  });
}

// Teeth of foreign light that stand still beside what was taken for a target.
TEST(Findings, DoubtATargetAmongOtherLight) {
  FoldedMaker made = interleaved_maker();
  made.photons = 200;
  made.foreign = [](auto& others, Random& random) {
    for (int n = 0; n < 8000; ++n) {
      const double share = drawn(random) - 0.5;
      others.emplace_back(2.5 * static_cast<double>(random() % 1512) + 3.3 * share +
                              0.1 * std::normal_distribution<double>()(random),
                          share);
    }
  };
  JudgedFrames judged{made};
  judged.visit(5, 3, [&](const Verdict& verdict) {
    EXPECT_TRUE(verdict.found.has(FindingName::unmodelled_light));
    EXPECT_TRUE(verdict.is_doubtful);
  });
}

// Photons of another target outside of the map are no background. (They screened flat light in, in
// nearly all frames of several targets.)
TEST(Findings, KnowTheLightOfOtherTargetsOutsideOfTheMap) {
  FoldedMaker made = interleaved_maker();
  const DelayTrack other = {made.track.delay_ns + 44.7, made.track.walk_ns};
  const Comb& comb = made.train.segments.front().comb;
  made.foreign = [&](std::vector<std::pair<double, double>>& photons, Random& random) {
    std::uniform_int_distribution<std::size_t> pulse(0, comb.times_ns.size() - 1);
    std::uniform_real_distribution<double> share(-0.5, 0.5);
    std::normal_distribution<double> late_ns(0, finding_sigma_ns);
    std::poisson_distribution<int> count(made.photons);
    for (int n = count(random); n > 0; --n) {
      const double at = share(random);
      photons.emplace_back(comb.times_ns[pulse(random)] + other.at(at) + late_ns(random), at);
    }
  };
  JudgedFrames judged{made};
  likelihood::Model model = made.truth();
  model.add({other, made.signal_per_pulse()});
  constexpr int frames = 200;
  double squares = 0, degrees = 0;
  for (int n = 0; n < frames; ++n) {
    made.make(judged.frame, static_cast<std::uint64_t>(n));
    judged.findings.judge(judged.frame, model, 0, {2, false, 0, 0, 0});
    for (std::size_t row = 0; row < rows_with_directions; ++row) {
      if (finding_table()[row].name != FindingName::unmodelled_light) continue;
      squares += judged.findings.scores().rows[row].squares;
      degrees += judged.findings.scores().rows[row].degrees;
    }
  }
  EXPECT_NEAR(squares / degrees, 1, 5 * std::sqrt(2 / degrees));
}

TEST(Findings, AllocateNothing) {
  FoldedMaker made = interleaved_maker();
  made.sigma_ns = 0.13;
  JudgedFrames judged{made};
  judged.visit(1, 3, [](const Verdict&) {});
  const auto before = test::allocations.load();
  judged.findings.judge(judged.frame, judged.maximum.model, 0, {2, false, 0.005, 0.01, 0});
  EXPECT_EQ(test::allocations.load(), before);
}

// A pulse that is 4 % wider shows in one frame at 1.5 deviations, and in 60 frames at 11.
TEST(FindingSums, SayWhatNoSingleFrameShows) {
  for (const bool is_wide : {false, true}) {
    FoldedMaker made = interleaved_maker();
    made.sigma_ns = is_wide ? 0.104 : 0.1;
    JudgedFrames judged{made};
    FindingSums sums(judged.findings);
    judged.visit(60, 11, [&](const Verdict& verdict) {
      EXPECT_TRUE(verdict.found.all().empty());
      sums.add(judged.frame);
    });
    const FoundList all = sums.found();
    ASSERT_EQ(!all.all().empty(), is_wide);
    if (!is_wide) continue;
    EXPECT_EQ(all.all()[0].name, FindingName::pulse_width);
    EXPECT_NEAR(all.all()[0].value, 0.04, 4 * all.all()[0].std);
    sums.clear();
    EXPECT_TRUE(sums.found().all().empty());
  }
}

// A vibration whose phase changes from frame to frame.
TEST(FindingSums, AddTheGainsOfWhatChangesItsSign) {
  FoldedMaker made = interleaved_maker();
  double phase = 0;
  made.scene = [&](Photon& p, Random&) {
    p.offset_ns += 0.02 * std::sqrt(2.0) * std::sin(6.283 * 4.3 * p.share + phase);
  };
  JudgedFrames judged{made};
  FindingSums sums(judged.findings);
  for (int n = 0; n < 60; ++n, phase += 1) {
    judged.visit(1, 100 + static_cast<std::uint64_t>(n),
                 [&](const Verdict&) { sums.add(judged.frame); });
  }
  const FoundList all = sums.found();
  ASSERT_EQ(all.all().size(), 1U);
  EXPECT_EQ(all.all()[0].name, FindingName::vibration);
}

}  // namespace
}  // namespace splid::checks
