#include <algorithm>

#include "daemon/stream/framer.hpp"

// The framer's way for most tags: runs of photons and syncs within the open frame, taken without a
// branch for each tag. All other tags go through Framer::take().
namespace splid {
namespace {

constexpr std::size_t least_sync_room = 256;  // with less, runs would be too short to gain by

}  // namespace

void Framer::push_in_time(std::span<const Tag> tags) {
  const Tag* tag = tags.data();
  const Tag* const last = tag + tags.size();
  while (tag != last) {
    if (frame_ != nullptr && !suspect_) {
      tag = !rooms_.empty()    ? take_run_of_pixels(tag, last)
            : surplus_from_ps_ ? take_run<false>(tag, last)
                               : take_run<true>(tag, last);
      if (tag == last) break;
    }
    take(*tag++);
  }
}

// The hot loop: stores the photons and syncs of the open frame, and skips tags on channels that are
// not used. Where the frame has no more room for photons (keeps_photons is false), it only counts
// these. Nothing in it depends on whether a tag is a photon or a sync, since no processor can guess
// which comes next.
template <bool keeps_photons>
const Tag* Framer::take_run(const Tag* tag, const Tag* last) {
  // The first sync of a stream places the frame's start, and a sync without room is lost: such
  // syncs end the run.
  std::int64_t no_sync = 0;
  const std::span<std::int64_t> sync_room = frame_->syncs_ps.room();
  const bool takes_syncs = ends_ != Ends::neither && sync_room.size() >= least_sync_room;
  if (takes_syncs) last = tag + std::min<std::size_t>(last - tag, sync_room.size());
  const std::span<std::int64_t> photon_room = frame_->photons_ps.room();
  if (keeps_photons) last = tag + std::min<std::size_t>(last - tag, photon_room.size());

  const Tag* const first = tag;
  const Roles most = takes_syncs ? role_sync : role_photon;
  const std::uint64_t start = frame_->start_ps;
  const std::uint64_t length = static_cast<std::uint64_t>(limit_ps_) - start;
  std::int64_t* const first_photon = photon_room.data();
  std::int64_t* const first_sync = takes_syncs ? sync_room.data() : &no_sync;
  std::int64_t* photon = first_photon;
  std::int64_t* sync = first_sync;
  std::size_t surplus = 0;
  for (; tag != last; ++tag) {
    const Roles roles = channels_.roles(*tag);
    if (roles > most || static_cast<std::uint64_t>(tag->time_ps) - start >= length) break;
    *sync = tag->time_ps;
    sync += roles >> 1;
    if constexpr (keeps_photons) {
      *photon = tag->time_ps;
      photon += roles & role_photon;
    } else {
      surplus += roles & role_photon;
    }
  }
  const auto photons = static_cast<std::size_t>(photon - first_photon);
  const auto syncs = static_cast<std::size_t>(sync - first_sync);
  frame_->photons_ps.grow(photons);
  frame_->syncs_ps.grow(syncs);
  totals_.photons += photons;
  totals_.syncs += syncs;
  surplus_photons_ += surplus;
  totals_.surplus += surplus;
  lose(surplus);
  if (keeps_photons && !frame_->photons_of_input.empty()) count_inputs(first, tag);
  run_ended(photons + syncs + surplus, static_cast<std::size_t>(tag - first), tag);
  return tag;
}

// The same for several pixels, each with a room of its own. A full room costs what another does.
const Tag* Framer::take_run_of_pixels(const Tag* tag, const Tag* last) {
  std::int64_t no_sync = 0;
  const std::span<std::int64_t> sync_room = frame_->syncs_ps.room();
  const bool takes_syncs = ends_ != Ends::neither && sync_room.size() >= least_sync_room;
  if (takes_syncs) last = tag + std::min<std::size_t>(last - tag, sync_room.size());
  last = rooms_.make_room(tag, last);

  const Tag* const first = tag;
  const Roles most = takes_syncs ? role_sync : role_photon;
  const std::uint64_t start = frame_->start_ps;
  const std::uint64_t length = static_cast<std::uint64_t>(limit_ps_) - start;
  PixelRooms::Room* const rooms = rooms_.rooms();
  std::int64_t* const first_sync = takes_syncs ? sync_room.data() : &no_sync;
  std::int64_t* sync = first_sync;
  std::size_t photons = 0;
  std::size_t surplus = 0;
  for (; tag != last; ++tag) {
    const Roles roles = channels_.roles(*tag);
    if (roles > most || static_cast<std::uint64_t>(tag->time_ps) - start >= length) break;
    *sync = tag->time_ps;
    sync += roles >> 1;
    const std::uint32_t is_photon = roles & role_photon;
    surplus += rooms[channels_.input(*tag)].take(tag->time_ps, is_photon);
    photons += is_photon;
  }
  const auto syncs = static_cast<std::size_t>(sync - first_sync);
  frame_->syncs_ps.grow(syncs);
  totals_.photons += photons - surplus;
  totals_.syncs += syncs;
  totals_.surplus += surplus;
  lose(surplus);
  run_ended(photons + syncs, static_cast<std::size_t>(tag - first), tag);
  return tag;
}

// Counts the photons of a run by their input.
void Framer::count_inputs(const Tag* tag, const Tag* last) {
  for (; tag != last; ++tag) {
    frame_->photons_of_input[channels_.input(*tag)] += channels_.roles(*tag) & role_photon;
  }
}

void Framer::run_ended(std::size_t used, std::size_t taken, const Tag* next) {
  if (taken == 0) return;
  totals_.events += taken;
  totals_.ignored += taken - used;
  backward_run_ = beyond_run_ = 0;
  last_ps_ = next[-1].time_ps;
  frame_->arrival_ns = arrival_ns_;
}

}  // namespace splid
