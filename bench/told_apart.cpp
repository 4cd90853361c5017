// How often two targets can be told from one whose pulse is not what the configuration says, by any
// method: the table docs/evidence/data/told-apart.csv.
//
//   told_apart [FRAMES]     by default 20,000 frames for each row, which takes a minute
//
// What two targets of known values leave in a frame is compared with what one pulse would leave
// that is as like that as can be. The ratio of their likelihoods is the most powerful test between
// them (Neyman and Pearson): at a given rate of single pulses that are taken for two, none finds
// more of the two, and an estimator, which must find the values too, finds fewer.

#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

namespace splid {
namespace {

// [P]'s experiment, as bench/targets has it: 40 pulses in 3780 ns, for 50 ms.
constexpr double sigma_ns = 0.1;
constexpr double pulses = 50e6 / 3780 * 40;
constexpr double experiment_photons = 13.5e-4 * pulses;
constexpr double background_a_width = 1.75e-4 * sigma_ns * pulses;
constexpr double widths_per_mps = 2 / 0.299792458 * 0.05 / sigma_ns;  // of range walk in a frame

// Photons are counted by their offset from a pulse's time, in pulse widths, and by their place in
// the frame.
constexpr double first_widths = -10, bin_widths = 0.125;
constexpr std::size_t offsets = 320;

// What is seen of one target.
struct Light {
  double offset_widths = 0;  // at mid-frame
  double walk_widths = 0;    // over the frame
  double photons = 0;
  double wide = 1;        // times the configured pulse
  double late_share = 0;  // of its light, by an exponential delay
  double late_widths = 1;
};

double normal_integral(double x) { return std::erfc(-x / std::sqrt(2.0)) / 2; }

// The part of a pulse that has come up to an offset from its time.
double come_by(const Light& light, double offset_widths) {
  const double x = offset_widths / light.wide;
  const double at_once = normal_integral(x);
  if (light.late_share == 0) return at_once;
  const double a = light.wide / light.late_widths;
  const double late = at_once - std::exp(a * a / 2 - a * x) * normal_integral(x - a);
  return (1 - light.late_share) * at_once + light.late_share * late;
}

// The photons to expect in each cell. One place is enough where nothing moves in the others' view.
using Expectation = std::vector<double>;

Expectation expect(const std::vector<Light>& lights, std::size_t places) {
  const double n = static_cast<double>(places);
  Expectation cells(offsets * places, background_a_width * bin_widths / n);
  for (const Light& light : lights) {
    for (std::size_t place = 0; place < places; ++place) {
      const double s = (static_cast<double>(place) + 0.5) / n - 0.5;
      const double middle = light.offset_widths + light.walk_widths * s;
      double before = come_by(light, first_widths - middle);
      for (std::size_t i = 0; i < offsets; ++i) {
        const double end = first_widths + static_cast<double>(i + 1) * bin_widths;
        const double come = come_by(light, end - middle);
        cells[place * offsets + i] += light.photons / n * (come - before);
        before = come;
      }
    }
  }
  return cells;
}

// By how many nats, on average, what `truth` makes is likelier to be made by it than by `other`.
double nats_between(const Expectation& truth, const Expectation& other) {
  double nats = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    nats += truth[i] * std::log(truth[i] / other[i]) - truth[i] + other[i];
  }
  return nats;
}

// What a pulse that is not two targets' may be.
enum class Freedom { configured, wider, wider_with_tail };

// The one pulse whose light is most like that of some targets.
struct Nearest {
  const Expectation& truth;
  std::size_t places;
  Freedom freedom;

  static constexpr unsigned parameters = 6;

  // x: offset, range walk, and the logarithms of photons, width, share and delay of a tail.
  [[nodiscard]] Light light_of(const double* x) const {
    Light light = {x[0], x[1], std::exp(x[2])};
    if (freedom != Freedom::configured) light.wide = std::exp(x[3]);
    if (freedom == Freedom::wider_with_tail) {
      light.late_share = std::exp(x[4]);
      light.late_widths = std::exp(x[5]);
    }
    return light;
  }
  static double evaluate(unsigned, const double* x, double*, void* of) {
    const auto& self = *static_cast<const Nearest*>(of);
    return nats_between(self.truth, expect({self.light_of(x)}, self.places));
  }
  [[nodiscard]] Light find(double photons) {
    const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> optimiser(
        nlopt_create(NLOPT_LN_SBPLX, parameters), nlopt_destroy);
    const double least[] = {-6, -6, std::log(photons / 2), 0, std::log(1e-4), -0.7};
    const double most[] = {6, 6, std::log(photons * 2), std::log(3.0), std::log(0.9), 2.1};
    nlopt_set_lower_bounds(optimiser.get(), least);
    nlopt_set_upper_bounds(optimiser.get(), most);
    nlopt_set_min_objective(optimiser.get(), evaluate, this);
    nlopt_set_ftol_abs(optimiser.get(), 1e-4);
    nlopt_set_maxeval(optimiser.get(), 3000);
    Light best;
    double fewest_nats = 1e300;
    for (const double late : {0.0, 0.7, 1.4}) {
      double x[] = {0, 0, std::log(photons), 0.02, std::log(0.05), late};
      double nats = 0;
      if (nlopt_optimize(optimiser.get(), x, &nats) < 0) std::abort();
      if (nats < fewest_nats) best = light_of(x);
      fewest_nats = std::min(fewest_nats, nats);
      if (freedom != Freedom::wider_with_tail) break;
    }
    return best;
  }
};

// The share of the frames of `truth` that the most powerful test tells from those of `other`, of
// which it takes no more than each of `rates` for one of `truth`.
//
// Design note: a frame is likelier by exp(L) where L is its log-likelihood ratio, so that the
// frames of `truth` that are drawn also say how often those of `other` exceed a ratio: the sum of
// exp(-L) over the drawn ones that do.
template <std::size_t count>
std::array<double, count> told_apart(const Expectation& truth, const Expectation& other,
                                     const std::array<double, count>& rates, int frames) {
  std::vector<double> nats_of(truth.size());
  double less = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    nats_of[i] = std::log(truth[i] / other[i]);
    less += truth[i] - other[i];
  }
  std::mt19937_64 random(1);
  std::poisson_distribution<int> photons(std::accumulate(truth.begin(), truth.end(), 0.0));
  std::discrete_distribution<std::size_t> cell(truth.begin(), truth.end());
  std::vector<double> nats(static_cast<std::size_t>(frames), -less);
  for (double& of_frame : nats) {
    for (int n = photons(random); n > 0; --n) of_frame += nats_of[cell(random)];
  }
  std::sort(nats.rbegin(), nats.rend());
  std::array<double, count> shares{};
  double taken = 0;
  for (const double of_frame : nats) {
    taken += std::exp(-of_frame) / frames;
    for (std::size_t k = 0; k < count; ++k) shares[k] += taken <= rates[k] ? 1.0 / frames : 0;
  }
  return shares;
}

struct Scene {
  const char* name;
  Light first, second;
};

void run(const Scene& scene, Freedom freedom, const char* name, int frames) {
  const bool part = scene.first.walk_widths != scene.second.walk_widths;
  const std::size_t places = part ? 40 : 1;
  const Expectation two = expect({scene.first, scene.second}, places);
  Nearest nearest = {two, places, freedom};
  const Light one = nearest.find(scene.first.photons + scene.second.photons);
  const Expectation other = expect({one}, places);
  const auto shares = told_apart(two, other, std::array{1e-3, 3e-2}, frames);
  std::printf("| %s | %s | %.2f |", scene.name, name, one.wide);
  if (one.late_share > 1e-3) {
    std::printf(" %.0f %% by %.2f ns", 100 * one.late_share, one.late_widths * sigma_ns);
  }
  std::printf(" | %.1f | %.1f %% | %.1f %% |\n", nats_between(two, other), 100 * shares[0],
              100 * shares[1]);
  std::fflush(stdout);
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  using splid::Freedom;
  const int frames = argc > 1 ? std::atoi(argv[1]) : 20000;
  constexpr double n = splid::experiment_photons;
  const auto parting = [&](double mps) {
    const double half = mps * splid::widths_per_mps / 2;
    return std::pair{splid::Light{0, -half, n}, splid::Light{0, half, n}};
  };
  std::printf(
      "| scene | taken for | times as wide | late | nats | told apart, 0.1 %% wrong | 3 %% wrong "
      "|\n"
      "|---|---|---|---|---|---|---|\n");
  const std::array<std::pair<const char*, double>, 4> velocities = {{{"two, 0.7 m/s apart", 0.7},
                                                                     {"two, 1 m/s apart", 1},
                                                                     {"two, 1.2 m/s apart", 1.2},
                                                                     {"two, 1.4 m/s apart", 1.4}}};
  for (const auto& [name, mps] : velocities) {
    const auto [a, b] = parting(mps);
    splid::run({name, a, b}, Freedom::configured, "the configured pulse", frames);
    splid::run({name, a, b}, Freedom::wider, "a wider pulse", frames);
  }
  const splid::Light bright = {0, 0, 4 * n};
  const auto weak = [&](double at) { return splid::Light{at, 0, n / 5}; };
  constexpr const char* with_tail = "a wider pulse with a tail";
  splid::run({"two, 3 widths apart", {0, 0, n}, {3, 0, n}}, Freedom::wider_with_tail, with_tail,
             frames);
  splid::run({"1:20, 3 widths before", bright, weak(-3)}, Freedom::wider_with_tail, with_tail,
             frames);
  splid::run({"1:20, 3 widths behind", bright, weak(3)}, Freedom::wider_with_tail, with_tail,
             frames);
  splid::run({"1:20, 4 widths behind", bright, weak(4)}, Freedom::wider_with_tail, with_tail,
             frames);
}
