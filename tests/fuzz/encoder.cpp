#include <cmath>

#include "daemon/stream/encoder_join.hpp"
#include "protocol/encoder_batch.hpp"
#include "tests/fuzz/fuzz.hpp"

// Lines of an encoder's counts: refused, or read, and then the same after they were written again.
// Then any batches and frames of markers in turn: a position, if there is one, is finite.

namespace splid::test::fuzz_encoder {
namespace {

void check_lines(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = std::min(text.find('\n'), text.size());
    const auto batch = parse_encoder_line(text.substr(0, length));
    text.remove_prefix(std::min(length + 1, text.size()));
    if (!batch) continue;
    must(batch->first_index >= 0, "an index is not negative");
    must(!batch->overrun || batch->counts.empty(), "an overrun has no counts");
    must(parse_encoder_line(to_encoder_line(*batch)) == batch, "a batch comes back");
  }
}

EncoderBatch some_batch(FuzzInput& input, std::int64_t& index) {
  EncoderBatch batch;
  const auto how = input.take<std::uint8_t>();
  if (how >= 240) index = how < 248 ? 0 : input.take<std::int64_t>() & INT64_MAX;
  batch.overrun = how == 239;
  batch.first_index = index;
  for (std::size_t i = how % 16; i > 0; --i) {
    batch.counts.push_back((how & 16U) != 0 ? input.take<std::int64_t>()
                                            : input.take<std::int8_t>());
  }
  if (index <= INT64_MAX - 16) index += static_cast<std::int64_t>(batch.counts.size());
  return batch;
}

// Of 50 ms or so, with markers about 1 ms apart, in order or not.
void take_frame(FuzzInput& input, std::int64_t& start_ps, EncoderJoin& join) {
  constexpr std::int64_t ms = 1'000'000'000;
  const auto how = input.take<std::uint8_t>();
  constexpr std::int64_t furthest_ps = INT64_MAX - (std::int64_t{1} << 54);
  if (how >= 250) start_ps = std::clamp(input.take<std::int64_t>(), -furthest_ps, furthest_ps);
  const std::int64_t end_ps = std::min(start_ps + (1 + how % 64) * ms, furthest_ps + 100 * ms);
  std::vector<std::int64_t> markers_ps;
  std::vector<Loss> losses;
  std::int64_t at_ps = start_ps;
  for (auto left = input.take<std::uint8_t>() % 64; left > 0; --left) {
    at_ps += ms + input.take<std::int8_t>() * (how < 200 ? 1 : ms / 50);
    if (at_ps >= start_ps && at_ps < end_ps) markers_ps.push_back(at_ps);
  }
  if (how % 8 == 7) losses.push_back({start_ps, start_ps + ms / 2, -1});
  join.take_frame(start_ps, end_ps, markers_ps, losses);
  start_ps = end_ps;
}

void check_join(FuzzInput input) {
  EncoderJoin join(EncoderScale{}, input.take<std::uint8_t>() % 2 == 0);
  std::int64_t index = 0;
  std::int64_t start_ps = 0;
  while (!input.empty()) {
    if (input.take<std::uint8_t>() % 2 == 0) {
      join.take_counts(some_batch(input, index));
    } else {
      take_frame(input, start_ps, join);
    }
    const auto position = join.position();
    must(
        !position || (std::isfinite(position->distance_m) && std::isfinite(position->velocity_mps)),
        "a position is finite");
    must(!position || !join.waits(), "who has a position does not wait for it");
    must(!position || join.fault().empty(), "a broken join has no position");
  }
}

}  // namespace
}  // namespace splid::test::fuzz_encoder

SPLID_FUZZ_TARGET(encoder) {
  splid::test::fuzz_encoder::check_lines(splid::test::as_text(data, size));
  splid::test::fuzz_encoder::check_join({data, size});
  return 0;
}
