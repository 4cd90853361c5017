// What the findings say of scenes that the model has and of scenes that it does not have, and what
// they cost. Prints the shares of frames in which each finding is named.
//
//   findings [FRAMES]     by default 1000
#include "estimator/checks/findings.hpp"

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "bench/thread_clock.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/folded_maker.hpp"

namespace {

using namespace splid;
using test::FoldedMaker;
using Photon = FoldedMaker::Photon;

constexpr double sigma = 0.1;

Pattern interleaved() {
  Pattern pattern;
  PatternSegment segment;
  segment.period_ps = 3'780'000;
  for (std::int64_t t = 0; t < 3'780'000; t += 9000) {
    if (t % 180'000 != 0 && t % 189'000 != 0) continue;
    segment.pulse_times_ps.push_back(static_cast<double>(t));
    segment.amplitudes.push_back(1);
  }
  pattern.segments.push_back(segment);
  pattern.unambiguous_delay_ps = 3'780'000;
  return pattern;
}

Pattern random_pattern(std::size_t pulses, double period_ps) {
  Pattern pattern;
  PatternSegment segment;
  segment.period_ps = period_ps;
  std::mt19937_64 random(3);
  const double cell = period_ps / static_cast<double>(pulses);
  for (std::size_t p = 0; p < pulses; ++p) {
    segment.pulse_times_ps.push_back(
        (static_cast<double>(p) + 0.7 * std::uniform_real_distribution<double>(0, 1)(random)) *
        cell);
    segment.amplitudes.push_back(1);
  }
  pattern.segments.push_back(segment);
  pattern.unambiguous_delay_ps = period_ps;
  return pattern;
}

struct Said {
  int named[finding_names] = {}, first[finding_names] = {};
  int no_gain_beside = 0, any = 0, fitted = 0, doubtful = 0, far = 0, far_after = 0;
  double fit_us = 0, judge_us = 0, least_us = 1e9;
  double squares[checks::rows_with_directions] = {}, mean_score[checks::rows_with_directions] = {};
  double value = 0;
};

Said run(const FoldedMaker& made, int frames, std::uint64_t seed, std::size_t terms = 2) {
  FoldedFrame frame(made.train, 400000);
  const auto shape = make_gaussian(sigma);
  likelihood::Maximizer maximizer(*shape, made.train, 400000, {1, 1, false});
  checks::Findings findings(made.train, *shape, 400000);
  Said said;
  for (int n = 0; n < frames; ++n) {
    made.make(frame, seed * 1000003 + static_cast<std::uint64_t>(n));
    maximizer.begin(frame);
    const auto t0 = bench::thread_ms();
    const auto maximum = maximizer.maximize(made.truth(), {likelihood::free_set(1, terms)});
    const auto t1 = bench::thread_ms();
    if (!maximum.has_covariance) continue;
    ++said.fitted;
    const auto& c = maximum.covariance;
    const checks::Verdict& verdict =
        findings.judge(frame, maximum.model, 0,
                       {terms, false, std::sqrt(c(0, 0)), std::sqrt(c(1, 1)), std::sqrt(c(2, 2))});
    const double us = 1e3 * (bench::thread_ms() - t1);
    said.judge_us += us;
    said.least_us = std::min(said.least_us, us);
    said.fit_us += 1e3 * (t1 - t0);
    for (const auto& f : verdict.found.all()) ++said.named[static_cast<std::size_t>(f.name)];
    if (!verdict.found.all().empty()) {
      ++said.first[static_cast<std::size_t>(verdict.found.all()[0].name)];
      said.value += verdict.found.all()[0].value;
      ++said.any;
    }
    said.no_gain_beside += verdict.gain_beside_nats && *verdict.gain_beside_nats < 25 ? 1 : 0;
    said.doubtful += verdict.is_doubtful ? 1 : 0;
    const double off =
        maximum.model.targets[0].track.at_mid_frame_ns() - made.track.at_mid_frame_ns();
    const double sd = std::sqrt(c(0, 0));
    said.far += std::abs(off) > 5 * sd ? 1 : 0;
    said.far_after += std::abs(off) > 5 * std::hypot(std::max(sd, verdict.wider.least_delay_ns),
                                                     verdict.wider.off_delay_ns)
                          ? 1
                          : 0;
    for (std::size_t r = 0; r < checks::rows_with_directions; ++r) {
      const auto& s = findings.scores().rows[r];
      if (s.degrees == 0) continue;
      said.squares[r] += s.squares / s.degrees;
      if (s.information[0] > 0) said.mean_score[r] += s.score[0] / std::sqrt(s.information[0]);
    }
  }
  return said;
}

void print(const char* scene, const Said& said, int frames) {
  std::printf("%-28s any %6.2f %% ", scene, 100.0 * said.any / frames);
  for (std::size_t k = 0; k < finding_names; ++k) {
    if (said.named[k] == 0) continue;
    std::printf(" %s %.1f(%.1f)", checks::to_string(static_cast<FindingName>(k)),
                100.0 * said.named[k] / frames, 100.0 * said.first[k] / frames);
  }
  std::printf(
      " | value %.4g, doubt %d, far %d -> %d, fitted %d, fit %.0f us, judge %.1f us, least %.1f "
      "us; doubt beside %d\n",
      said.value / std::max(1, said.any), said.doubtful, said.far, said.far_after, said.fitted,
      said.fit_us / frames, said.judge_us / frames, said.least_us, said.no_gain_beside);
  std::fflush(stdout);
}

void print_statistics(const Said& said) {
  std::printf("    mean squares a degree, mean score:");
  for (std::size_t r = 0; r < checks::rows_with_directions; ++r) {
    std::printf("  %.3f %+.2f", said.squares[r] / said.fitted, said.mean_score[r] / said.fitted);
  }
  std::printf("\n");
}

// Scenes that differ from [P]'s by one change each.
struct Scenes {
  FoldedMaker plain;
  int frames;

  void power(const char* name, const std::function<void(FoldedMaker&)>& change) const {
    FoldedMaker made = plain;
    change(made);
    print(name, run(made, frames, 9), frames);
  }
  void of_light(const char* name, std::function<void(Photon&, std::mt19937_64&)> scene) const {
    power(name, [&](FoldedMaker& made) { made.scene = scene; });
  }
};

// Of the model: whatever is named is a false alarm. Ends with a Markdown table of their number.
void print_plain(const FoldedMaker& plain, int frames) {
  std::string rows;
  for (const double photons : {20.0, 50.0, 100.0, 300.0, 713.0, 5000.0}) {
    for (const double background : {1e-5, 1.75e-4, 1e-3}) {
      if (background > 5e-4 && photons < 100) continue;
      FoldedMaker made = plain;
      made.photons = photons, made.background_per_ns = background;
      const Said said = run(made, frames, 7);
      char name[64];
      std::snprintf(name, sizeof name, "plain %g, %g", photons, background);
      print(name, said, frames);
      print_statistics(said);
      std::snprintf(name, sizeof name, "| %g | %g | %d | %d |\n", photons, background, frames,
                    said.any);
      rows += name;
    }
  }
  std::printf("\n| photons | b, /ns | frames | with a finding |\n|---|---|---|---|\n%s\n",
              rows.c_str());
  FoldedMaker made(random_pattern(1000, 100e6));
  made.track.delay_ns = 30000;
  print("plain, random 1000", run(made, frames, 8), frames);
}

void print_pulses(const Scenes& scenes) {
  scenes.power("width 1.3", [](auto& m) { m.sigma_ns = 1.3 * sigma; });
  scenes.of_light("tail 30 %, 2 widths", [](Photon& p, auto& r) {
    if (r() % 10 < 3) p.offset_ns += std::exponential_distribution<double>(1 / (2 * sigma))(r);
  });
  for (const double share : {0.1, 0.2}) {
    for (const double widths : {3.0, 5.0}) {
      char name[64];
      std::snprintf(name, sizeof name, "%g %% at %g widths", 100 * share, widths);
      scenes.of_light(name, [=](Photon& p, auto& r) {
        if (std::uniform_real_distribution<double>(0, 1)(r) < share) p.offset_ns += widths * sigma;
      });
    }
  }
  scenes.of_light("half at 2 widths",
                  [](Photon& p, auto& r) { p.offset_ns += r() % 3 == 0 ? 2 * sigma : 0; });
}

void print_paths(const Scenes& scenes) {
  scenes.of_light("P2 of 1 width",
                  [](Photon& p, auto&) { p.offset_ns += sigma * (3 * p.u() * p.u() - 1) / 2; });
  scenes.of_light("P3 of 1 width", [](Photon& p, auto&) {
    p.offset_ns += sigma * (5 * p.u() * p.u() - 3) * p.u() / 2;
  });
  scenes.of_light("P2 of 4 widths",
                  [](Photon& p, auto&) { p.offset_ns += 4 * sigma * (3 * p.u() * p.u() - 1) / 2; });
  for (const double turns : {3.2, 6.3}) {
    char name[64];
    std::snprintf(name, sizeof name, "vibration 0.5 widths, %g turns", turns);
    scenes.of_light(name, [=](Photon& p, auto&) {
      p.offset_ns += 0.5 * std::sqrt(2.0) * sigma * std::sin(6.2832 * turns * p.share + 1);
    });
  }
}

void print_light(const Scenes& scenes) {
  scenes.of_light("a third dark", [](Photon& p, auto&) { p.is_seen = p.share > -1.0 / 6; });
  scenes.power("amplitudes 32 % off", [](auto& m) {
    for (int k = 0; k < 40; ++k) m.amplitudes.push_back(1 + 0.32 * 1.414 * std::sin(2.4 * k));
  });
  scenes.power("half of the pulses dark", [](auto& m) {
    for (int k = 0; k < 40; ++k) m.amplitudes.push_back(k % 2);
  });
  scenes.of_light("slab 0.4 m", [](Photon& p, auto& r) {
    p.offset_ns += std::uniform_real_distribution<double>(-1.33, 1.33)(r);
  });
  scenes.of_light("slab 1 m", [](Photon& p, auto& r) {
    p.offset_ns += std::uniform_real_distribution<double>(-3.3, 3.3)(r);
  });
  scenes.of_light("edge of 5 cm, crossing", [](Photon& p, auto& r) {
    if (std::uniform_real_distribution<double>(-0.5, 0.5)(r) < p.share) p.offset_ns += 0.333;
  });
}

// A smooth return of every pulse, and no target: what is called a target moves with nothing.
void print_fog(const Scenes& scenes) {
  for (const double counts : {0.1, 0.02}) {
    char name[64];
    std::snprintf(name, sizeof name, "fog alone, %g a pulse", counts);
    scenes.power(name, [=](auto& m) {
      m.photons = 0.02 * counts * 529000, m.track.walk_ns = 0;
      const std::vector<double> times = m.train.segments.front().comb.times_ns;
      m.foreign = [=](auto& others, auto& r) {
        for (int n = 0; n < 529000 * counts; ++n) {
          others.emplace_back(
              1898 - 150 + times[r() % times.size()] + std::gamma_distribution<double>(2, 130)(r),
              std::uniform_real_distribution<double>(-0.5, 0.5)(r));
        }
      };
    });
  }
}

// Teeth every 2.5 ns of the pattern, which drift against it; what is called a target drifts too.
void print_lasers(const Scenes& scenes) {
  for (const double photons : {0.0, 200.0}) {
    scenes.power(photons > 0 ? "laser at 80 MHz, and target" : "laser at 80 MHz alone",
                 [=](auto& m) {
                   m.photons = photons > 0 ? photons : 1;
                   m.track.delay_ns = 1900;
                   m.foreign = [](auto& others, auto& r) {
                     for (int n = 0; n < 8000; ++n) {
                       const double share = std::uniform_real_distribution<double>(-0.5, 0.5)(r);
                       others.emplace_back(12.5 * static_cast<double>(r() % 4000000) + 3.3 * share +
                                               sigma * std::normal_distribution<double>()(r),
                                           share);
                     }
                   };
                 });
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 1000;
  const Scenes scenes = {FoldedMaker(interleaved()), std::min(frames, 400)};
  print_plain(scenes.plain, frames);
  print_pulses(scenes);
  print_paths(scenes);
  print_light(scenes);
  print_fog(scenes);
  print_lasers(scenes);
  FoldedMaker made(random_pattern(1000, 100e6));
  made.track.delay_ns = 30000, made.sigma_ns = 1.3 * sigma;
  print("random, width 1.3", run(made, scenes.frames, 9), scenes.frames);
  return 0;
}
