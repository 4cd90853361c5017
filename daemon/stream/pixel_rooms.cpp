#include "daemon/stream/pixel_rooms.hpp"

namespace splid {

void PixelRooms::open(Frame& frame) {
  if (empty()) return;
  frame_ = &frame;
  may_grow_ = false;
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
    FixedArray<std::int64_t>& photons = frame.pixels[i]->photons_ps;
    photons.clear();
    rooms_[i] = {photons.begin(), 0, static_cast<std::uint32_t>(photons.capacity() - 1)};
    may_grow_ = may_grow_ || photons.may_grow();
  }
  rooms_.back() = {&no_photon_, 0, 0};
}

const Tag* PixelRooms::make_room(const Tag* tag, const Tag* last) {
  constexpr std::ptrdiff_t most_tags = 1024;
  if (!may_grow_) return last;
  last = tag + std::min(last - tag, most_tags);
  for (std::size_t i = 0; i < frame_->pixels.size(); ++i) {
    Room& room = rooms_[i];
    const std::size_t needed = room.seen + static_cast<std::size_t>(last - tag);
    if (needed <= room.size) continue;
    FixedArray<std::int64_t>& photons = frame_->pixels[i]->photons_ps;
    photons.resize(room.kept());
    while (needed >= photons.capacity() && photons.enlarge()) {
    }
    room.first = photons.begin();
    room.size = static_cast<std::uint32_t>(photons.capacity() - 1);
  }
  return last;
}

void PixelRooms::settle() const {
  if (empty()) return;
  for (std::size_t i = 0; i < frame_->pixels.size(); ++i) {
    frame_->pixels[i]->photons_ps.resize(rooms_[i].kept());
  }
}

void PixelRooms::share() const {
  if (empty()) return;
  std::uint64_t surplus_of_all = 0;
  for (std::size_t i = 0; i < frame_->pixels.size(); ++i) surplus_of_all += rooms_[i].surplus();
  for (std::size_t i = 0; i < frame_->pixels.size(); ++i) {
    frame_->share_with(*frame_->pixels[i], rooms_[i].surplus(), surplus_of_all);
  }
}

}  // namespace splid
