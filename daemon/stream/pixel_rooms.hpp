#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/stream/frame.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Where the photons of the open frame go if the stream has several pixels: each pixel has a room of
// its own. Photons beyond a full room are counted and cost as much time as the others.
//
// Threads: the framer's. Errors: none.
class PixelRooms {
 public:
  // seen: photons that came. Those beyond the room are written behind it, over each other.
  struct Room {
    std::int64_t* first = nullptr;
    std::uint32_t seen = 0;
    std::uint32_t size = 0;

    // A tag that is a photon (1) or is not (0). Returns 1 for a photon without room.
    std::uint32_t take(std::int64_t time_ps, std::uint32_t is_photon) {
      const std::uint32_t surplus = seen >= size ? is_photon : 0;
      first[std::min(seen, size)] = time_ps;
      seen += is_photon;
      return surplus;
    }
    [[nodiscard]] std::uint32_t kept() const { return std::min(seen, size); }
    [[nodiscard]] std::uint64_t surplus() const { return seen - kept(); }
  };

  // pixels: 0 where the stream has no several pixels; then none of the calls below does anything.
  explicit PixelRooms(std::size_t pixels) : rooms_(pixels > 0 ? pixels + 1 : 0) {}

  [[nodiscard]] bool empty() const { return rooms_.empty(); }
  // The frame that begins. It outlives the calls up to the next open().
  void open(Frame& frame);
  // Makes room for tags from `tag` on, all of which may be of one pixel; returns the end of those
  // that it made room for. Only a room that may grow allocates.
  const Tag* make_room(const Tag* tag, const Tag* last);
  // One for each pixel, and one without space for tags that are no photons.
  [[nodiscard]] Room* rooms() { return rooms_.data(); }

  // Gives each pixel's part of the frame the photons in its room.
  void settle() const;
  // Gives each pixel's part what all pixels share, once the frame is complete.
  void share() const;

 private:
  std::vector<Room> rooms_;
  Frame* frame_ = nullptr;
  bool may_grow_ = false;
  std::int64_t no_photon_ = 0;
};

}  // namespace splid
