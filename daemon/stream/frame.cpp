#include "daemon/stream/frame.hpp"

#include <algorithm>

namespace splid {
namespace {

std::int64_t joined_count(std::int64_t a, std::int64_t b) {
  if (a < 0 && b < 0) return -1;
  return std::max<std::int64_t>(a, 0) + std::max<std::int64_t>(b, 0);
}

}  // namespace

Frame::Frame(const FrameCapacity& capacity)
    : photons_ps(capacity.pixels > 0 ? 0 : capacity.photons,
                 capacity.pixels > 0 ? 0 : capacity.most_photons),
      syncs_ps(capacity.syncs),
      markers(capacity.markers),
      losses(capacity.losses) {
  for (std::size_t i = 0; i < capacity.pixels; ++i) {
    pixels.push_back(std::make_unique<Frame>(
        FrameCapacity{capacity.photons, 0, 0, capacity.losses, capacity.most_photons}));
  }
}

std::size_t Frame::photon_count() const {
  std::size_t count = photons_ps.size();
  for (const auto& pixel : pixels) count += pixel->photons_ps.size();
  return count;
}

std::span<const std::int64_t> Frame::densest_photons() const {
  std::span<const std::int64_t> most = photons_ps.view();
  for (const auto& pixel : pixels) {
    if (pixel->photons_ps.size() > most.size()) most = pixel->photons_ps.view();
  }
  return most;
}

void Frame::share_with(Frame& pixel, std::uint64_t surplus, std::uint64_t surplus_of_all) const {
  pixel.sequence = sequence;
  pixel.start_ps = start_ps;
  pixel.end_ps = end_ps;
  pixel.losses.clear();
  for (const Loss& loss : losses.view()) pixel.losses.push(loss);
  pixel.lost_tags = lost_tags - surplus_of_all + surplus;
  pixel.uncounted_losses = uncounted_losses;
  pixel.seen_fraction = seen_fraction;
  pixel.sync = sync;
  pixel.scan = scan;
  pixel.arrival_ns = arrival_ns;
  if (surplus == 0) return;
  const std::int64_t from_ps = pixel.photons_ps.empty() ? start_ps : pixel.photons_ps.back() + 1;
  pixel.add_loss(from_ps, end_ps, static_cast<std::int64_t>(surplus));
  pixel.settle_losses();
}

void Frame::add_loss(std::int64_t loss_begin_ps, std::int64_t loss_end_ps, std::int64_t count) {
  loss_begin_ps = std::max(loss_begin_ps, start_ps);
  if (loss_begin_ps >= loss_end_ps) return;
  if (losses.push({loss_begin_ps, loss_end_ps, count})) return;
  Loss& last = losses.back();
  last.begin_ps = std::min(last.begin_ps, loss_begin_ps);
  last.end_ps = std::max(last.end_ps, loss_end_ps);
  last.count = joined_count(last.count, count);
}

void Frame::settle_losses() {
  std::sort(losses.begin(), losses.end(),
            [](const Loss& a, const Loss& b) { return a.begin_ps < b.begin_ps; });
  std::size_t kept = 0;
  std::int64_t unseen_ps = 0;
  for (const Loss& loss : losses.view()) {
    const std::int64_t loss_end_ps = std::min(loss.end_ps, end_ps);
    if (loss.begin_ps >= loss_end_ps) continue;
    if (kept == 0 || loss.begin_ps > losses[kept - 1].end_ps) {
      losses[kept++] = {loss.begin_ps, loss_end_ps, loss.count};
      unseen_ps += loss_end_ps - loss.begin_ps;
      continue;
    }
    Loss& last = losses[kept - 1];
    last.count = joined_count(last.count, loss.count);
    unseen_ps += std::max<std::int64_t>(loss_end_ps - last.end_ps, 0);
    last.end_ps = std::max(last.end_ps, loss_end_ps);
  }
  losses.resize(kept);
  seen_fraction = 1 - static_cast<double>(unseen_ps) / static_cast<double>(end_ps - start_ps);
}

}  // namespace splid
