#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <span>
#include <string>
#include <vector>

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
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::byte>((record >> shift) & 0xFFU));
    }
  }
  return bytes;
}

// Photons of [P]'s pattern in T3 mode: one in six periods of 3.78 us, and an overflow each 1024.
std::vector<std::byte> t3_records() {
  std::mt19937 generator(1);
  const auto random = [&generator] { return static_cast<std::uint32_t>(generator()); };
  std::vector<std::byte> bytes;
  std::uint32_t sync = 0;
  for (std::size_t i = 0; i < record_count; ++i) {
    const bool is_overflow = sync >= 1024;
    const std::uint32_t record =
        is_overflow ? 0xFE000001U : (random() & 1U) << 25U | (random() & 0x7FFFU) << 10U | sync;
    sync = is_overflow ? sync - 1024 : sync + random() % 12;
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::byte>((record >> shift) & 0xFFU));
    }
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

void t3(benchmark::State& state) {
  decode_in_chunks(state, t3_records(),
                   PtuT3Decoder(RecordType::hydra_harp_v2_t3, 3.78e6, 128e-12));
}

BENCHMARK_CAPTURE(mix, hydra_harp_v2, RecordType::hydra_harp_v2, 1e-12);
BENCHMARK_CAPTURE(mix, hydra_harp_v1, RecordType::hydra_harp_v1, 1e-12);
BENCHMARK_CAPTURE(mix, pico_harp, RecordType::pico_harp, 4e-12);
BENCHMARK_CAPTURE(mix, fraction_of_a_ps, RecordType::generic, 3.90625e-12);

BENCHMARK(t3);

// Detections of two inputs and a sync at random places.
void qutag(benchmark::State& state) {
  std::mt19937 generator(1);
  std::vector<std::byte> bytes;
  const auto append = [&bytes](std::uint64_t value, unsigned count) {
    for (; count > 0; --count, value >>= 8U) bytes.push_back(static_cast<std::byte>(value & 0xFFU));
  };
  std::uint64_t time_ps = 340'000'000'000'000'000;
  for (std::size_t i = 0; i < record_count; ++i) {
    append(time_ps += generator() % 10'000'000, 8);
    append(1 + 2 * (generator() % 3), 2);
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
    sync += random() % 12;
    std::uint32_t record = (random() & 0xFFFU) << 16U | (random() & 1U) << 12U | sync % 4096;
    if (sync >= 4096) record |= 1U << 30U;
    sync %= 4096;
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::byte>(record >> shift & 0xFFU));
    }
  }
  decode_in_chunks(state, bytes, SpcDecoder(3.78e6, 12e-12));
}
BENCHMARK(spc);

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
