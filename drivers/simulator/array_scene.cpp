#include "drivers/simulator/array_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

namespace splid::simulator {
namespace {

constexpr std::uint64_t crosstalk_stream = 6;

bool by_time(const Tag& a, const Tag& b) {
  if (a.time_ps != b.time_ps) return a.time_ps < b.time_ps;
  return a.kind != b.kind ? a.kind < b.kind : a.value < b.value;
}

bool is_later(const Tag& a, const Tag& b) { return by_time(b, a); }

// Appends what is put to a list that is the caller's.
class ListSink : public TagSink {
 public:
  explicit ListSink(std::vector<Tag>& tags) : tags_(tags) {}
  std::span<Tag> claim(std::size_t max_count) override {
    used_ = tags_.size();
    tags_.resize(used_ + max_count);
    return std::span(tags_).subspan(used_);
  }
  void publish(std::size_t count) override { tags_.resize(used_ + count); }

 private:
  std::vector<Tag>& tags_;
  std::size_t used_ = 0;
};

// The syncs and markers of a scene, without its light.
Options without_light(Options options) {
  options.array = {};
  options.scanner = {};
  options.more_targets.clear();
  options.fog = {};
  options.foreign = {};
  options.detection.signal_per_pulse = 0;
  options.ambient_per_s = 0;
  options.dark_per_s = 0;
  options.sync.near_photons_only = false;
  return options;
}

}  // namespace

Crosstalk::Crosstalk(const Options& options)
    : probability_(options.array.crosstalk_probability),
      mean_ps_(options.array.crosstalk_ns * 1e3),
      dead_time_ps_(std::llround(options.detector.dead_time_ns * 1e3)),
      first_input_(static_cast<int>(options.photon_input)),
      columns_(static_cast<int>(options.array.columns)),
      rows_(static_cast<int>(options.array.rows)),
      random_(static_cast<std::uint64_t>(options.seed), crosstalk_stream),
      dead_until_ps_(static_cast<std::size_t>(columns_ * rows_),
                     std::numeric_limits<std::int64_t>::min()) {}

void Crosstalk::add(std::vector<Tag>& photons, std::int64_t until_ps) {
  taken_.clear();
  for (auto next = photons.begin();;) {
    const std::int64_t photon_ps =
        next != photons.end() ? next->time_ps : std::numeric_limits<std::int64_t>::max();
    if (!waiting_.empty() && waiting_.front().time_ps < std::min(until_ps, photon_ps)) {
      const Tag crosstalk = waiting_.front();
      std::pop_heap(waiting_.begin(), waiting_.end(), is_later);
      waiting_.pop_back();
      take(crosstalk);
    } else if (next != photons.end()) {
      take(*next++);
    } else {
      break;
    }
  }
  photons.swap(taken_);
}

void Crosstalk::take(const Tag& photon) {
  const int pixel = photon.value - first_input_;
  std::int64_t& dead_until_ps = dead_until_ps_[static_cast<std::size_t>(pixel)];
  if (photon.time_ps < dead_until_ps) return;
  dead_until_ps = photon.time_ps + dead_time_ps_;
  taken_.push_back(photon);
  if (random_.uniform() >= probability_) return;
  const int other = neighbour(pixel, random_.uniform());
  if (other < 0) return;
  const std::int64_t wait_ps = std::llround(mean_ps_ * random_.exponential());
  waiting_.push_back(photon_tag(photon.time_ps + wait_ps, first_input_ + other));
  std::push_heap(waiting_.begin(), waiting_.end(), is_later);
}

// One of the pixels beside, above and below, each as likely; -1 where there is none.
int Crosstalk::neighbour(int pixel, double chance) const {
  const int column = pixel % columns_;
  const int row = pixel / columns_;
  std::array<int, 4> near{};
  std::size_t count = 0;
  if (column > 0) near[count++] = pixel - 1;
  if (column + 1 < columns_) near[count++] = pixel + 1;
  if (row > 0) near[count++] = pixel - columns_;
  if (row + 1 < rows_) near[count++] = pixel + columns_;
  if (count == 0) return -1;
  return near[static_cast<std::size_t>(chance * static_cast<double>(count))];
}

ArrayScene::ArrayScene(const Pattern& pattern, const Options& options)
    : clock_(pattern, without_light(options)),
      first_input_(static_cast<std::int32_t>(options.photon_input)),
      start_ps_(options.start_ps),
      near_photons_only_(options.sync.near_photons_only),
      crosstalk_(options) {
  for (const ArrayPixel& pixel : array_pixels(options)) {
    pixels_.emplace_back(pattern, pixel.scene, Scene::Part::photons);
    delays_ps_.push_back(std::llround(pixel.delay_ps));
  }
}

bool ArrayScene::write_until(std::int64_t until_ps, TagWriter& out) {
  until_ps += start_ps_;
  collect(until_ps);
  const auto before = [&](const Tag& tag) { return tag.time_ps < until_ps; };
  const auto end = std::partition_point(tags_.begin(), tags_.end(), before);
  for (auto tag = tags_.begin(); tag != end; ++tag) {
    if (!put(*tag, out)) return false;
  }
  tags_.erase(tags_.begin(), end);
  return true;
}

// Adds all events before until_ps to tags_, and those that a cable delays beyond it.
void ArrayScene::collect(std::int64_t until_ps) {
  photons_.clear();
  {
    ListSink sink(photons_);
    TagWriter writer(sink);
    for (Scene& pixel : pixels_) pixel.write_until(until_ps - start_ps_, writer);
    writer.publish();
  }
  if (crosstalk_.any()) {
    std::sort(photons_.begin(), photons_.end(), by_time);
    crosstalk_.add(photons_, until_ps);
  }
  for (Tag photon : photons_) {
    photon.time_ps += delays_ps_[static_cast<std::size_t>(photon.value - first_input_)];
    tags_.push_back(photon);
  }
  ListSink sink(tags_);
  TagWriter writer(sink);
  clock_.write_until(until_ps - start_ps_, writer);
  writer.publish();
  std::sort(tags_.begin(), tags_.end(), by_time);
}

bool ArrayScene::put(const Tag& tag, TagWriter& out) {
  if (tag.kind == TagKind::photon) photon_since_sync_ = true;
  if (tag.kind == TagKind::sync && near_photons_only_) {
    if (!std::exchange(photon_since_sync_, false)) return true;
  }
  return out.put(tag);
}

}  // namespace splid::simulator
