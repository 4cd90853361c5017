#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/tags16.hpp"
#include "tests/support/tags16_block.hpp"

namespace splid {
namespace {

constexpr std::uint32_t block_count = 100;
// The size of what a driver reads, and hands out, at a time; see recording_decode_bench.cpp.
constexpr std::size_t chunk_bytes = 262'144;
constexpr std::size_t chunk_tags = 16'384;

// Photons on three inputs.
std::vector<std::byte> blocks(std::int64_t tags_a_block) {
  std::vector<std::byte> bytes;
  for (std::uint32_t i = 0; i < block_count; ++i) {
    const std::int64_t begin_ps = i * tags_a_block * 100;
    test::Tags16Block block{i, begin_ps, begin_ps + tags_a_block * 100, {}};
    for (std::int64_t k = 0; k < tags_a_block; ++k) {
      block.records.push_back({begin_ps + k * 100, static_cast<std::int32_t>(k % 3)});
    }
    test::append_block(block, bytes);
  }
  return bytes;
}

void decode(benchmark::State& state) {
  const std::vector<std::byte> bytes = blocks(state.range(0));
  std::vector<Tag> tags(chunk_tags);
  for (auto _ : state) {
    Tags16Decoder decoder;
    std::span<const std::byte> rest = bytes;
    for (bool full = false; full || !rest.empty();) {
      const auto progress = decoder.decode(rest.first(std::min(rest.size(), chunk_bytes)), tags);
      benchmark::DoNotOptimize(tags.data());
      benchmark::ClobberMemory();
      rest = rest.subspan(progress.bytes);
      full = progress.tags == tags.size();
    }
  }
  state.SetItemsProcessed(state.iterations() * block_count * state.range(0));
}
BENCHMARK(decode)->ArgName("tags_a_block")->Arg(100)->Arg(10'000);

}  // namespace
}  // namespace splid
