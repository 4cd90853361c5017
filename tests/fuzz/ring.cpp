#include "daemon/stream/ring.hpp"

#include "tests/fuzz/fuzz.hpp"

// A live source's tags into a ring that its consumer empties now and then: every event comes out or
// is in the count of a loss, counts that the source itself gave go on, what comes out is what went
// in, and no clock break is swallowed without another.

namespace splid::test::fuzz_ring {
namespace {

struct Sums {
  std::uint64_t events = 0;
  std::uint64_t reported = 0;
  bool clock_broke = false;

  void add(const Tag& tag) {
    if (is_event(tag.kind)) ++events;
    const bool counts = tag.kind == TagKind::loss_end || tag.kind == TagKind::missed;
    if (counts && tag.value > 0) reported += static_cast<std::uint64_t>(tag.value);
    clock_broke = clock_broke || tag.kind == TagKind::clock_break;
  }
};

void drain(TagRing& ring, std::size_t most, std::vector<Tag>& out) {
  while (most > 0) {
    const auto some = ring.peek();
    if (some.empty()) return;
    const std::size_t count = std::min(most, some.size());
    out.insert(out.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(count));
    ring.consume(count);
    most -= count;
  }
}

void check(FuzzInput input) {
  TagRing ring(std::size_t{256} << input.below_or(2));
  DroppingSink sink(ring, {});
  FuzzTags source(input);
  Sums given;
  std::vector<Tag> out;
  // 28 losses of 2^31 - 1 tags are what a full ring can tell of.
  constexpr std::uint64_t most_reported = std::uint64_t{1} << 33U;
  while (!input.empty()) {
    const std::size_t wanted = 1 + input.take<std::uint8_t>();
    const std::span<Tag> room = sink.claim(wanted);
    must(!room.empty() && room.size() <= wanted, "a live source gets room at once");
    const std::size_t count = std::min(room.size(), input.below_or(256));
    const Tag repeated = source.next();
    for (std::size_t i = 0; i < count; ++i) {
      room[i] = i % 8 == 0 ? source.next() : repeated;
      if (given.reported > most_reported && !is_event(room[i].kind)) room[i] = sync_tag(0);
      given.add(room[i]);
    }
    sink.publish(count);
    must(ring.fill() <= ring.capacity(), "a ring holds what it can");
    if (input.take<std::uint8_t>() % 4 == 0) drain(ring, input.below_or(1024), out);
  }
  sink.finish();
  drain(ring, SIZE_MAX, out);
  must(ring.ended(), "a ring ends when it is closed and empty");

  Sums got;
  for (const Tag& tag : out) got.add(tag);
  must(got.events + sink.dropped_tags() == given.events, "each event comes out or is dropped");
  must(got.reported == given.reported + sink.dropped_tags(), "what is dropped is reported");
  must(got.clock_broke == given.clock_broke, "a clock break is passed on");
  must((sink.drops() > 0) || sink.dropped_tags() == 0, "drops are counted");
}

}  // namespace
}  // namespace splid::test::fuzz_ring

SPLID_FUZZ_TARGET(ring) {
  splid::test::fuzz_ring::check({data, size});
  return 0;
}
