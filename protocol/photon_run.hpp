#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/counted_syncs.hpp"
#include "protocol/record_decoder.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Runs of records that all are photons, in formats that count syncs. Most of a recording is made of
// such runs, and in them nothing needs to be asked of a record but whether its sync is a new one.
//
// Layout, of a format's photons:
//   is_other(record)               is no photon, or does more than a photon
//   wraps(record)                  syncs by which the record moves their number on
//   sync(record), ticks(record)    since the last such move, and since the sync
//   meaning(record)                of its tag; out of a table, since one that is put together is
//                                  waited for
//   untimed(record)                the same, where its ticks are the most that a record holds
//
// Design note: the records of a run are looked at once more than others, and are written in 0.6 of
// the time. A wrong guess of whether a run is one costs as much as a few records; that is why runs
// are not shorter, and a run of 64 is too seldom one.
inline constexpr std::size_t run_records = 16;

template <class Layout>
bool is_photon_run(const std::byte* in) {
  std::uint32_t others = 0;
  for (std::size_t i = 0; i < run_records; ++i) {
    others |= Layout::is_other(little_endian_32(in + 4 * i)) ? 1U : 0U;
  }
  return others == 0;
}

// What a photon's tag is made of beside its record.
struct PhotonTimes {
  CountedSyncs clock;
  double tick_ps;            // of a photon's time since its sync
  std::uint64_t most_ticks;  // a photon so late may have come at any later time
};

struct PhotonRun {
  std::size_t tags = 0;         // written, at most two a record
  std::uint64_t base = 0;       // as given, moved on
  std::uint64_t told = 0;       // number of the last sync
  std::uint64_t saturated = 0;  // photons
};

// base: number of the sync at the last overflow. told: number of the last sync that became a tag.
template <class Layout>
PhotonRun write_photon_run(const std::byte* in, const PhotonTimes& times, std::uint64_t base,
                           std::uint64_t told, Tag* out) {
  PhotonRun run{0, base, told, 0};
  for (std::size_t i = 0; i < run_records; ++i) {
    const std::uint32_t record = little_endian_32(in + 4 * i);
    run.base += Layout::wraps(record);
    const std::uint64_t syncs = run.base + Layout::sync(record);
    const std::int64_t sync_ps = times.clock.time_ps(syncs);
    write_tag(out[run.tags], sync_ps, {0, TagKind::sync, {}});
    run.tags += syncs != run.told ? 1 : 0;
    run.told = syncs;
    const std::uint64_t ticks = Layout::ticks(record);
    const std::int64_t since_ps = CountedSyncs::rounded(
        static_cast<double>(static_cast<std::int64_t>(ticks)) * times.tick_ps);
    const auto at_ps = static_cast<std::int64_t>(static_cast<std::uint64_t>(sync_ps) +
                                                 static_cast<std::uint64_t>(since_ps));
    const bool is_saturated = ticks == times.most_ticks;
    run.saturated += is_saturated ? 1 : 0;
    write_tag(out[run.tags++], at_ps,
              is_saturated ? Layout::untimed(record) : Layout::meaning(record));
  }
  return run;
}

}  // namespace splid
