#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "protocol/photon_hdf5_decode.hpp"
#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_header.hpp"
#include "protocol/ptu_t3_decode.hpp"
#include "protocol/qutag_decode.hpp"
#include "protocol/spc_decode.hpp"

namespace splid {
namespace {

constexpr std::size_t record_count = 1 << 20;
// The number of tags that a driver hands out at a time. Design note: 256 KiB of tags stay in the
// second-level cache, as they do on their way through the ring.
constexpr std::size_t chunk_tags = 16'384;

void append(std::vector<std::byte>& bytes, std::uint64_t value, unsigned count) {
  for (; count > 0; --count, value >>= 8U) bytes.push_back(static_cast<std::byte>(value & 0xFFU));
}

// Records at random places, as in a recording: photons on two inputs, 5 % syncs, 6 % overflows.
std::vector<std::byte> mixed_records(bool with_counts) {
  std::mt19937 generator(1);
  const auto random = [&generator] { return static_cast<std::uint32_t>(generator()); };
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < record_count; ++i) {
    const std::uint32_t kind = random() % 100;
    std::uint32_t record = ((kind & 1U) << 25U) | (random() & 0x1FFFFFFU);
    if (kind < 6) record = 0xFE000000U | (with_counts ? 1 + random() % 3 : 0);
    if (kind >= 6 && kind < 11) record = 0x80000000U | (random() & 0x1FFFFFFU);
    append(bytes, record, 4);
  }
  return bytes;
}

// Photons of [P]'s pattern in T3 mode: one in six periods of 3.78 us, and an overflow each 1024
// syncs (PicoHarp: 65,536). In the dark there is one in 60 periods, so that every 17th record is an
// overflow.
constexpr std::uint32_t bright_syncs = 12;
constexpr std::uint32_t dark_syncs = 120;

std::vector<std::byte> t3_records(bool is_pico_harp, std::uint32_t most_syncs) {
  std::mt19937 generator(1);
  const auto random = [&generator] { return static_cast<std::uint32_t>(generator()); };
  const std::uint32_t syncs_in_overflow = is_pico_harp ? 65'536 : 1024;
  std::vector<std::byte> bytes;
  std::uint32_t sync = 0;
  for (std::size_t i = 0; i < record_count; ++i) {
    const bool is_overflow = sync >= syncs_in_overflow;
    std::uint32_t record = (random() & 1U) << 25U | (random() & 0x7FFFU) << 10U | sync;
    if (is_overflow) record = 0xFE000001U;
    if (is_pico_harp) {
      record = (1 + (random() & 1U)) << 28U | (random() & 0xFFFU) << 16U | sync;
      if (is_overflow) record = 0xF0000000U;
    }
    sync = is_overflow ? sync - syncs_in_overflow : sync + random() % most_syncs;
    append(bytes, record, 4);
  }
  return bytes;
}

template <class Decoder>
void decode_in_chunks(benchmark::State& state, std::span<const std::byte> records,
                      const Decoder& begun) {
  std::vector<Tag> tags(chunk_tags);
  for (auto _ : state) {
    Decoder decoder = begun;
    std::span<const std::byte> rest = records;
    while (rest.size() >= decoder.record_bytes()) {
      const auto progress = decoder.decode(rest, tags);
      benchmark::DoNotOptimize(tags.data());
      benchmark::ClobberMemory();
      rest = rest.subspan(progress.bytes);
    }
  }
  state.SetItemsProcessed(state.iterations() *
                          static_cast<std::int64_t>(records.size() / begun.record_bytes()));
}

void mix(benchmark::State& state, RecordType type, double resolution_s) {
  decode_in_chunks(state, mixed_records(type != RecordType::hydra_harp_v1),
                   PtuDecoder(type, resolution_s));
}

void t3(benchmark::State& state, RecordType type, double resolution_s, std::uint32_t most_syncs) {
  decode_in_chunks(state, t3_records(type == RecordType::pico_harp_t3, most_syncs),
                   PtuT3Decoder(type, 3.78e6, resolution_s));
}

BENCHMARK_CAPTURE(mix, hydra_harp_v2, RecordType::hydra_harp_v2, 1e-12);
BENCHMARK_CAPTURE(mix, hydra_harp_v1, RecordType::hydra_harp_v1, 1e-12);
BENCHMARK_CAPTURE(mix, pico_harp, RecordType::pico_harp, 4e-12);
BENCHMARK_CAPTURE(mix, fraction_of_a_ps, RecordType::generic, 3.90625e-12);

BENCHMARK_CAPTURE(t3, hydra_harp_v2, RecordType::hydra_harp_v2_t3, 128e-12, bright_syncs);
BENCHMARK_CAPTURE(t3, hydra_harp_v2_dark, RecordType::hydra_harp_v2_t3, 128e-12, dark_syncs);
BENCHMARK_CAPTURE(t3, pico_harp, RecordType::pico_harp_t3, 512e-12, bright_syncs);

// Detections of two inputs and a sync at random places.
void qutag(benchmark::State& state) {
  std::mt19937 generator(1);
  std::vector<std::byte> bytes;
  std::uint64_t time_ps = 340'000'000'000'000'000;
  for (std::size_t i = 0; i < record_count; ++i) {
    append(bytes, time_ps += generator() % 10'000'000, 8);
    append(bytes, 1 + 2 * (generator() % 3), 2);
  }
  decode_in_chunks(state, bytes, QutagDecoder());
}
BENCHMARK(qutag);

// Photons of [P]'s pattern: one in six periods, and the overflows that these make.
void spc(benchmark::State& state) {
  std::mt19937 generator(1);
  const auto random = [&generator] { return static_cast<std::uint32_t>(generator()); };
  std::vector<std::byte> bytes;
  std::uint32_t sync = 0;
  for (std::size_t i = 0; i < record_count; ++i) {
    sync += random() % bright_syncs;
    std::uint32_t record = (random() & 0xFFFU) << 16U | (random() & 1U) << 12U | sync % 4096;
    if (sync >= 4096) record |= 1U << 30U;
    sync %= 4096;
    append(bytes, record, 4);
  }
  decode_in_chunks(state, bytes, SpcDecoder(3.78e6, 12e-12));
}
BENCHMARK(spc);

// Photons of two detectors, one in six units of time, as the reader of Photon-HDF5 hands them on.
void photon_hdf5(benchmark::State& state, double unit_ps, std::optional<double> step_s) {
  std::mt19937 generator(1);
  std::vector<std::byte> bytes;
  std::uint64_t timestamp = 0;
  for (std::size_t i = 0; i < record_count; ++i) {
    append(bytes, timestamp += generator() % 12, 8);
    append(bytes, step_s ? generator() % 4096 : 0, 4);
    append(bytes, generator() & 1U, 4);
  }
  decode_in_chunks(state, bytes, PhotonHdf5Decoder(unit_ps, step_s));
}
BENCHMARK_CAPTURE(photon_hdf5, t2, 12'500.0, std::nullopt);
BENCHMARK_CAPTURE(photon_hdf5, t3, 3.78e6, 1e-9);

// What decoding is held against: a file of 256 MiB that the page cache holds is read, 1 MiB at a
// time, and nothing is done with it. Records of 4 bytes.
void reading(benchmark::State& state) {
  std::vector<char> piece(1U << 20U);
  std::FILE* const file = std::tmpfile();
  if (file == nullptr) return state.SkipWithError("no temporary file");
  for (int i = 0; i < 256; ++i) std::fwrite(piece.data(), 1, piece.size(), file);
  std::fflush(file);
  for (auto _ : state) {
    for (off_t at = 0;; at += static_cast<off_t>(piece.size())) {
      if (pread(fileno(file), piece.data(), piece.size(), at) <= 0) break;
      benchmark::ClobberMemory();
    }
  }
  std::fclose(file);
  state.SetItemsProcessed(state.iterations() * (std::int64_t{256} << 18U));
}
BENCHMARK(reading);

// The recording that SPLID_PTU names, decoded over and over.
void file(benchmark::State& state) {
  const char* name = std::getenv("SPLID_PTU");
  if (name == nullptr) {
    state.SkipWithError("set SPLID_PTU to a recording to measure it");
    return;
  }
  std::ifstream stream(name, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(stream), {}};
  const auto bytes = std::as_bytes(std::span(chars));
  const auto header = parse_ptu_header(bytes, true);
  decode_in_chunks(state, bytes.subspan(header->header_bytes),
                   PtuDecoder(header->record_type, header->resolution_s));
}
BENCHMARK(file);

}  // namespace
}  // namespace splid
