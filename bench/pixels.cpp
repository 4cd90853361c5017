// Measures what an array of pixels costs: [P]'s light in each pixel, or a tenth of it, in frames of
// 50 ms. Prints a table of thread times for a frame of all pixels, and how many cores 20 frames a
// second take:
//
//   pixels    takes a minute on an idle core

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "bench/thread_clock.hpp"
#include "estimator/array/pixel_track.hpp"
#include "estimator/array/rigid_scene.hpp"
#include "tests/support/pixel_field.hpp"

namespace splid {
namespace {

constexpr double frames_a_second = 20;
constexpr std::size_t most_photons = 20'000;
constexpr int repeats = 7;

test::FrameMaker plate(double light) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 1.2;
  made.signal_per_pulse *= light;
  made.background_per_ns *= light;
  return made;
}

// Frames that follow each other, with the estimates of each pixel alone.
class Array {
 public:
  Array(std::size_t pixels, double light, FindingsWanted findings = FindingsWanted::on)
      : field_(pixels, plate(light)),
        estimator_(plate(light).pattern, {}, {}, {.findings = findings}, 50, most_photons),
        estimates_(pixels) {
    estimator_.leave_out_recent_findings();
    for (std::size_t k = 0; k < pixels; ++k) tracks_.emplace_back(k);
  }

  void next() { views_ = field_.next(++seed_); }
  // Thread times of a frame, ms.
  double search() {
    const double begin_ms = bench::thread_ms();
    for (std::size_t k = 0; k < views_.size(); ++k) estimates_[k] = estimator_.estimate(views_[k]);
    return bench::thread_ms() - begin_ms;
  }
  double follow() {
    const double begin_ms = bench::thread_ms();
    for (std::size_t k = 0; k < views_.size(); ++k) {
      tracks_[k].begin_frame({});
      estimates_[k] = estimator_.estimate(views_[k], &tracks_[k].track());
    }
    return bench::thread_ms() - begin_ms;
  }
  double share(array::RigidScene& scene) {
    std::vector<int> bodies(views_.size());
    const double begin_ms = bench::thread_ms();
    scene.estimate({views_, estimates_, bodies});
    return bench::thread_ms() - begin_ms;
  }
  [[nodiscard]] std::size_t size() const { return views_.size(); }
  [[nodiscard]] const std::vector<array::PixelDirection>& directions() const {
    return field_.directions();
  }
  [[nodiscard]] double photons() const {
    double sum = 0;
    for (const FrameView& view : views_) sum += static_cast<double>(view.photons_ps.size());
    return sum;
  }
  [[nodiscard]] double ok_share() const {
    const auto ok = std::count_if(estimates_.begin(), estimates_.end(), [](const Estimate& one) {
      return one.status == FrameStatus::ok;
    });
    return static_cast<double>(ok) / static_cast<double>(estimates_.size());
  }

 private:
  test::PixelField field_;
  FrameEstimator estimator_;
  std::vector<array::PixelTrack> tracks_;
  std::vector<FrameView> views_;
  std::vector<Estimate> estimates_;
  std::uint64_t seed_ = 0;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void print_row(const char* what, const Array& array, double light, double frame_ms) {
  std::printf("| %zu | %g | %.1f | %s | %.1f | %.3f | %.2f | %.1f |\n", array.size(), light,
              array.photons() * frames_a_second * 1e-6, what, frame_ms,
              frame_ms / static_cast<double>(array.size()), frame_ms * frames_a_second * 1e-3,
              100 * array.ok_share());
  std::fflush(stdout);
}

void print_followed(std::size_t pixels, double light, FindingsWanted findings, const char* what) {
  Array array(pixels, light, findings);
  std::vector<double> times_ms;
  array.next();
  array.follow();
  for (int n = 0; n < repeats; ++n) {
    array.next();
    times_ms.push_back(array.follow());
  }
  print_row(what, array, light, median(times_ms));
}

void print_rows(std::size_t pixels, double light) {
  print_followed(pixels, light, FindingsWanted::off, "followed, `findings` `off`");
  print_followed(pixels, light, FindingsWanted::on, "followed");
  Array array(pixels, light);
  array.next();
  std::vector<double> searched, shared;
  array::RigidScene scene(plate(light).pattern, {}, {}, {}, 50, most_photons, array.directions());
  for (int n = 0; n < repeats; ++n) {
    searched.push_back(array.search());
    shared.push_back(array.share(scene));
  }
  array.search();
  print_row("searched whole", array, light, median(searched));
  array.share(scene);
  print_row("`rigid`, beside that", array, light, median(shared));
}

}  // namespace
}  // namespace splid

int main() {
  std::printf(
      "| pixels | of [P]'s light | M photons/s | how | ms a frame | ms a pixel | cores | ok, %% |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const std::size_t pixels : {16, 64, 128, 256}) splid::print_rows(pixels, 1);
  for (const std::size_t pixels : {64, 256, 1024}) splid::print_rows(pixels, 0.1);
}
