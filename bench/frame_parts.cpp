// Where the time of a frame goes, on [P]'s experiment: each part by itself, beside the least time
// that this processor needs for the part's passes over photons and cells. Prints the table
// docs/evidence/data/frame-parts.csv.
//
//   frame_parts    takes ten seconds

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "bench/thread_clock.hpp"
#include "estimator/checks/findings.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/fold/kernel_choice.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/search/delay_velocity_search.hpp"
#include "estimator/search/target_search.hpp"
#include "estimator/search/zoom.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double sigma_ns = 0.1;
constexpr double max_speed_mps = 150;

// The median time of a call, in us.
double median_us(const std::function<void()>& call) {
  constexpr int times = 301;
  std::vector<double> took;
  for (int n = 0; n < times; ++n) {
    const double begin = bench::thread_ms();
    call();
    took.push_back((bench::thread_ms() - begin) * 1e3);
  }
  std::nth_element(took.begin(), took.begin() + times / 2, took.end());
  return took[times / 2];
}

// What the processor takes at least for an element of each kind of pass, in ns.
struct Limits {
  double photon_moved;  // 8 bytes read and 20 written, from and to the second-level cache
  double increment;     // of a byte in the first-level cache, at a place read from memory
  double add;           // of two bytes to a third, in the first-level cache
  double entry;         // an exponential and a division
};

Limits measure_limits() {
  constexpr std::size_t count = 8192;
  std::vector<std::uint32_t> places(count);
  for (std::size_t i = 0; i < count; ++i) places[i] = static_cast<std::uint32_t>(i * 389 % 4096);
  std::vector<std::uint8_t> cells(4096), more(28 * count), moved(28 * count);
  std::vector<double> values(count, -0.3);
  const SearchKernels& kernels = best_search_kernels();
  Limits limits{};
  limits.photon_moved = 1e3 / count * median_us([&] {
                          std::memcpy(moved.data(), more.data(), 14 * count);
                          more[moved[5]] = 1;
                        });
  limits.increment = 1e3 / count * median_us([&] {
                       std::uint8_t* to = cells.data();
                       const std::uint32_t* from = places.data();
                       for (std::size_t i = 0; i < count; ++i) ++to[from[i]];
                     });
  // The three rows are in different lines of the cache.
  constexpr std::size_t row = 3072;
  std::uint8_t* rows = moved.data();
  limits.add = 1e3 / (64.0 * row) * median_us([&] {
                 for (int n = 0; n < 64; ++n) {
                   kernels.bytes.add(rows, rows + row + 64, rows + 2 * (row + 64), row);
                 }
               });
  limits.entry = 1e3 / count * median_us([&] {
                   for (double& value : values) value = -1 / (2 + std::exp(value));
                 });
  return limits;
}

struct Scene {
  std::string name;
  test::FrameMaker made;
};

class Parts {
 public:
  Parts(const Scene& scene, const Limits& limits)
      : scene_(scene),
        limits_(limits),
        photons_(scene.made.make(1)),
        shape_(make_gaussian(sigma_ns)),
        train_(scene.made.pattern),
        frame_(train_, photons_.photons_ps.size()) {
    frame_.fold(photons_.view(), train_);
    const double beta = scene.made.velocity_mps / 299792458.0;
    line_ = {2 * scene.made.distance_m / 0.299792458 / (1 + beta),
             2 * beta / (1 + beta) * frame_.length_ns};
  }

  void print() {
    FrameEstimator estimator(scene_.made.pattern, {}, {}, {}, 50, frame_.size());
    const double all = median_us([&] { estimator.estimate(photons_.view()); });
    std::printf("| %s | the whole frame | | %.0f | | |\n", scene_.name.c_str(), all);
    const double photons = static_cast<double>(frame_.size());
    row("fold: photons", photons, limits_.photon_moved,
        [&] { frame_.fold(photons_.view(), train_); });
    print_search("cells of 10 widths", 10);
    if (scene_.made.signal_per_pulse == 0) print_search("cells of 5 widths", 5);
    print_recheck();
    print_fit();
  }

 private:
  void row(const std::string& part, double elements, double limit_ns,
           const std::function<void()>& call) {
    row_of(part, elements, elements * limit_ns * 1e-3, call);
  }

  void row_of(const std::string& part, double elements, double least_us,
              const std::function<void()>& call) {
    const double us = median_us(call);
    std::printf("| %s | %s | %.3g | %.1f | %.1f | %.1f |\n", scene_.name.c_str(), part.c_str(),
                elements, us, least_us, us / least_us);
    std::fflush(stdout);
  }

  void print_search(const std::string& cells, double widths) {
    const SearchKernels& kernels = best_search_kernels();
    CombRows rows(train_, frame_.size(), kernels);
    const double walk_ns = 2 * max_speed_mps / 299792458.0 * frame_.length_ns;
    const SearchGrid grid =
        SearchGrid::cover(train_.circle_ns, widths * sigma_ns, walk_ns, rows.fitting_bins());
    std::vector<std::uint8_t> memory[3];
    for (auto& part : memory) part.resize(grid.cells());
    rows.load(frame_, 0, grid.slices);
    const auto found = rows.part_bins(grid);
    const std::vector<std::uint32_t> parts(found.begin(), found.end());
    const double pulses = parts.empty()
                              ? static_cast<double>(train_.segments[0].comb.times_ns.size())
                              : static_cast<double>(parts.size());
    const double counts = pulses * static_cast<double>(frame_.size());
    row(cells + ": counts of photons in the slices", counts, limits_.increment, [&] {
      rows.load(frame_, 0, grid.slices);
      if (parts.empty()) {
        rows.fill(grid, memory[0].data(), memory[1].data(), memory[2].data());
      }
      for (std::size_t k = 0; k < parts.size(); ++k) {
        rows.fill_period(grid, k, memory[k].data());
      }
    });
    const auto most = static_cast<std::size_t>(std::ceil(walk_ns / grid.bin_ns));
    double adds = 0;
    for (std::size_t half = 1; half < grid.slices; half *= 2) {
      const std::size_t lines = std::min(2 * half, most * 2 * half / grid.slices + 1);
      adds += 2.0 * static_cast<double>(grid.slices / (2 * half) * lines);
    }
    const double bins =
        std::accumulate(parts.begin(), parts.end(), parts.empty() ? grid.bins : 0.0);
    const std::string name = cells + ": sums along the lines";
    if (parts.empty()) {
      TaylorTree tree(kernels, {&grid, 1});
      row(name, adds * bins, limits_.add,
          [&] { add_up_circle(grid, memory[0].data(), most, tree); });
    } else {
      PartLines lines(kernels, {&grid, 1}, rows.part_copies());
      row(name, adds * bins, limits_.add, [&] { add_up_parts(grid, parts, memory, most, lines); });
    }
    DelayVelocitySearch search(train_, frame_.size(), {&grid, 1});
    row_of(cells + ": counts, sums and the best of all lines", counts + adds * bins,
           1e-3 * (counts * limits_.increment + adds * bins * limits_.add),
           [&] { found_ += search.run(frame_, grid, walk_ns).size(); });
    if (scene_.made.signal_per_pulse == 0) {
      print_zooms(cells, grid, search.run(frame_, grid, walk_ns));
    }
  }

  // Where nothing is significant, the best cells are zoomed into, and the likelihood is maximized
  // from the best spot.
  void print_zooms(const std::string& level, const SearchGrid& grid,
                   std::span<const SearchCell> cells) {
    cells = cells.first(std::min(cells.size(), TargetSearch::cells_tried(frame_.size())));
    const double width_ns = shape_->width_ns();
    const double reach_ns =
        std::max(1.5 * grid.bin_ns, TargetSearch::least_reach_widths * width_ns);
    const double about_ns = 2 * reach_ns + 4 * width_ns;
    const std::vector<CombWindow> windows = comb_windows(train_, -about_ns, about_ns);
    NearSet near(frame_.size(), frame_.size() * widest_overlap(windows));
    Zoom zoom(width_ns, 0);
    ZoomResult best;
    row(level + ": zooms into " + std::to_string(cells.size()) + " cells",
        static_cast<double>(cells.size() * frame_.size()), limits_.increment, [&] {
          for (const SearchCell& cell : cells) {
            near.collect(frame_, windows, train_, cell.line);
            const ZoomResult found = zoom.find(near, reach_ns, true);
            if (found.count > best.count) best = found;
          }
        });
    likelihood::Maximizer maximizer(*shape_, train_, frame_.size(), {});
    near.collect(frame_, comb_windows(train_, -2 * 10 * sigma_ns, 2 * 10 * sigma_ns), train_,
                 best.line);
    row(level + ": the maximum", static_cast<double>(near.entries()), limits_.entry,
        [&] { maximum_near(best.line, maximizer); });
  }

  // No line holds so many photons.
  static constexpr std::uint32_t too_many = 65534;

  void add_up_circle(const SearchGrid& grid, const std::uint8_t* rows, std::size_t most,
                     TaylorTree& tree) {
    const std::size_t step = TaylorTree::block_bins(grid, most);
    for (const int sign : {1, -1}) {
      for (std::size_t bin = 0; bin < grid.bins; bin += step) {
        tree.add_up(rows, grid, {bin, std::min(step, grid.bins - bin), most, sign});
        for (std::size_t j = 0; j <= most; ++j) found_ += tree.first_above(j, 0, too_many);
      }
    }
  }

  void add_up_parts(const SearchGrid& grid, const std::vector<std::uint32_t>& parts,
                    const std::vector<std::uint8_t>* rows, std::size_t most, PartLines& lines) {
    for (const int sign : {1, -1}) {
      lines.clear();
      for (std::size_t k = 0; k < parts.size(); ++k) {
        lines.add_up(rows[k].data(), grid, parts[k], most, sign);
      }
      for (std::size_t j = 0; j <= most; ++j) {
        lines.look_at(j);
        lines.visit_above(
            grid.bins, [] { return too_many; },
            [&](std::size_t, std::uint32_t photons) { found_ += photons; });
      }
    }
  }

  void print_recheck() {
    if (scene_.made.signal_per_pulse == 0) return;
    const SearchGrid grid =
        SearchGrid::cover(train_.circle_ns, 3 * sigma_ns, 0,
                          CombRows(train_, 0, best_search_kernels()).fitting_bins());
    DelayVelocitySearch search(train_, frame_.size(), {&grid, 1});
    row("a look at all delays of one walk", static_cast<double>(frame_.size() + grid.bins),
        limits_.increment, [&] { search.best_delays(frame_, line_.walk_ns, grid); });
  }

  likelihood::Maximum maximum_near(const DelayTrack& line, likelihood::Maximizer& maximizer) {
    maximizer.begin(frame_);
    return maximizer.maximize(likelihood::model_of(line), {likelihood::free_set(1, 2)});
  }

  void print_fit() {
    const auto photons = static_cast<double>(frame_.size());
    const std::vector<CombWindow> windows =
        comb_windows(train_, -2 * 10 * sigma_ns, 2 * 10 * sigma_ns);
    NearSet near(frame_.size(), frame_.size() * widest_overlap(windows));
    row("photons near a line, once", photons, limits_.increment,
        [&] { near.collect(frame_, windows, train_, line_); });
    if (scene_.made.signal_per_pulse == 0) return;
    likelihood::Maximizer maximizer(*shape_, train_, frame_.size(), {});
    const likelihood::Model at = maximum_near(line_, maximizer).model;
    likelihood::LogLikelihood likelihood(*shape_, train_, frame_.size(), {});
    likelihood.begin(frame_);
    likelihood::Model model = at;
    likelihood.collect(model, NearSet::gathered_from);
    likelihood::Point point;
    row("the likelihood and its derivatives, once", static_cast<double>(near.entries()),
        limits_.entry, [&] {
          model.targets[0].track.delay_ns += 1e-9;  // so that nothing is used again
          likelihood.evaluate(model, likelihood::free_set(1, 2), point);
          found_ += point.value > 0 ? 1 : 0;
        });
    const DelayTrack beside = {line_.delay_ns + 0.1, line_.walk_ns - 0.1};
    row("the maximum", static_cast<double>(near.entries()), limits_.entry,
        [&] { maximum_near(beside, maximizer); });
    checks::Findings findings(train_, *shape_, frame_.size());
    row("findings", photons, limits_.increment, [&] { findings.judge(frame_, at, 0, {}); });
  }

  const Scene& scene_;
  const Limits& limits_;
  test::FrameMaker::Frame photons_;
  std::unique_ptr<PulseShape> shape_;
  PulseTrain train_;
  FoldedFrame frame_;
  DelayTrack line_;
  std::size_t found_ = 0;  // keeps the compiler from leaving out what is timed
};

void run() {
  const Limits limits = measure_limits();
  std::printf("| what | the least, ns |\n|---|---|\n");
  std::printf("| to move 28 bytes, which a photon has in and out | %.2f |\n", limits.photon_moved);
  std::printf("| to count a photon in a byte of the first-level cache | %.2f |\n",
              limits.increment);
  std::printf("| to add two bytes of the first-level cache to a third | %.4f |\n", limits.add);
  std::printf("| an exponential and a division | %.1f |\n\n", limits.entry);
  std::printf("| scene | part | elements | us | least, us | times |\n|---|---|---|---|---|---|\n");
  Scene scenes[] = {{"interleaved", {}}, {"random", {}}, {"no target", {}}};
  for (Scene& scene : scenes) {
    const bool random = scene.name == "random";
    scene.made.pattern = random ? test::random_pattern(3780000, 40, 9000, 5)
                                : test::interleaved_pattern({180000, 189000}, 3780000);
    scene.made.velocity_mps = random ? -140 : 10;
    if (scene.name == "no target") scene.made.signal_per_pulse = 0;
    Parts(scene, limits).print();
  }
}

}  // namespace
}  // namespace splid

int main() { splid::run(); }
