#include <limits>
#include <optional>
#include <tuple>

#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_encode.hpp"
#include "protocol/ptu_header.hpp"
#include "tests/fuzz/fuzz.hpp"

// Tags into records and back: what was not rejected comes out again, sorted, and the count of
// rejected and reported tags is that of the losses; the losses stand in the header as they were.

namespace splid::test::fuzz_ptu_round_trip {
namespace {

// 20 s are 4,700 overflow records, so that a thousand such gaps do not take the time of the run.
std::vector<Tag> without_long_gaps(const std::vector<Tag>& tags) {
  constexpr std::uint64_t longest_ps = 20'000'000'000'000;
  std::vector<Tag> kept;
  std::optional<std::int64_t> latest_ps;
  for (const Tag& tag : tags) {
    const std::int64_t from_ps = latest_ps.value_or(tag.time_ps);
    const auto ahead_ps =
        static_cast<std::uint64_t>(tag.time_ps) - static_cast<std::uint64_t>(from_ps);
    if (tag.time_ps > from_ps && ahead_ps > longest_ps) continue;
    kept.push_back(tag);
    latest_ps = std::max(from_ps, tag.time_ps);
    if (tag.kind == TagKind::clock_break) latest_ps.reset();
  }
  return kept;
}

struct Sums {
  std::uint64_t events = 0;
  std::uint64_t reported = 0;
  bool clock_broke = false;
};

Sums sums_of(const std::vector<Tag>& tags) {
  Sums sums;
  for (const Tag& tag : tags) {
    if (is_event(tag.kind)) ++sums.events;
    const bool counts = tag.kind == TagKind::loss_end || tag.kind == TagKind::missed;
    if (counts && tag.value > 0) sums.reported += static_cast<std::uint64_t>(tag.value);
    sums.clock_broke = sums.clock_broke || tag.kind == TagKind::clock_break;
  }
  return sums;
}

void check_events(const std::vector<Tag>& given, const std::vector<Tag>& read, bool clock_broke) {
  must(std::is_sorted(read.begin(), read.end(),
                      [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }),
       "records are sorted");
  if (clock_broke) return;  // times are other ones then
  const auto less = [](const Tag& a, const Tag& b) {
    return std::tuple(a.time_ps, a.kind, a.value) < std::tuple(b.time_ps, b.kind, b.value);
  };
  // A sync's value says nothing and is not recorded.
  std::vector<Tag> left = given;
  std::erase_if(left, [](const Tag& tag) { return !is_event(tag.kind); });
  std::sort(left.begin(), left.end(), less);
  std::vector<Tag> got = read;
  std::sort(got.begin(), got.end(), less);
  must(std::includes(left.begin(), left.end(), got.begin(), got.end(), less),
       "what is read was given");
}

void check_losses(const PtuEncoder& encoder) {
  PtuFacts facts;
  facts.origin_ps = 0;
  facts.inputs = encoder.inputs();
  facts.losses = encoder.losses().losses(encoder.now_ps());
  const auto header = parse_ptu_header(make_ptu_header(facts), true);
  must(header->inputs.text() == facts.inputs.text(), "inputs are kept");
  std::int64_t before_ps = std::numeric_limits<std::int64_t>::min();
  for (const Loss& loss : header->losses) {
    must(loss.begin_ps >= before_ps && loss.end_ps >= loss.begin_ps, "losses are sorted");
    before_ps = loss.begin_ps;
  }
  must(header->losses.size() <= facts.losses.size(), "losses are joined, never split");
}

void check(FuzzInput input) {
  const auto piece = 1 + input.below_or(300);
  const std::vector<Tag> tags = without_long_gaps(fuzz_tags(input, 1000));
  const std::int64_t origin_ps = tags.empty() ? 0 : tags.front().time_ps;
  PtuEncoder encoder(origin_ps);
  std::vector<std::byte> records;
  for (std::size_t at = 0; at < tags.size(); at += piece) {
    encoder.encode(std::span(tags).subspan(at, std::min(piece, tags.size() - at)), records);
  }
  encoder.flush(records);
  must(records.size() == 4 * encoder.records(), "records are counted");

  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-12, origin_ps, encoder.inputs());
  std::vector<Tag> read(records.size() / 4 + 1);
  read.resize(decoder.decode(records, read).tags);
  const Sums sums = sums_of(tags);
  must(read.size() + encoder.rejected() == sums.events, "each event is a record or rejected");
  must(encoder.losses().lost_tags() == encoder.rejected() + sums.reported,
       "what is rejected is a loss");
  check_events(tags, read, sums.clock_broke);
  check_losses(encoder);
}

}  // namespace
}  // namespace splid::test::fuzz_ptu_round_trip

SPLID_FUZZ_TARGET(ptu_round_trip) {
  splid::test::fuzz_ptu_round_trip::check({data, size});
  return 0;
}
