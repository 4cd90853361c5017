#include "daemon/stream/framer.hpp"

#include <memory>

#include "tests/fuzz/fuzz.hpp"

// Any stream of tags through the framer, pushed in pieces: the sums of FramerTotals close with what
// is in the frames, frames do not overlap but after the clock was set anew, and all that is in one
// is within it.

namespace splid::test::fuzz_framer {
namespace {

constexpr FrameCapacity small_room{64, 64, 16, 8};

bool inside(const Frame& frame, std::int64_t time_ps) {
  return time_ps >= frame.start_ps && time_ps < frame.end_ps;
}

// Looks at each frame when it is closed.
class CheckedFrames final : public FrameSink {
 public:
  Frame& open() override {
    must(!is_open_, "a frame is closed before the next");
    is_open_ = true;
    return frame_;
  }
  void close() override {
    must(is_open_, "an open frame is closed");
    is_open_ = false;
    check_frame();
    must(frame_.sequence == frames, "frames are counted");
    ++frames;
    photons += frame_.photons_ps.size();
    syncs += frame_.syncs_ps.size();
    markers += frame_.markers.size();
    lost += frame_.lost_tags;
    // A frame of a clock at the end of its range stands there, wherever the frame before was.
    if (frame_.seen_fraction == 0) return;
    if (framer != nullptr && resets_ == framer->totals().resets && frames > 1) {
      must(frame_.start_ps >= end_ps_, "frames do not overlap");
    }
    resets_ = framer->totals().resets;
    end_ps_ = frame_.end_ps;
  }

  const Framer* framer = nullptr;
  std::uint64_t frames = 0, photons = 0, syncs = 0, markers = 0, lost = 0;

 private:
  void check_frame() const {
    must(frame_.start_ps < frame_.end_ps, "a frame ends after it starts");
    must(frame_.seen_fraction >= 0 && frame_.seen_fraction <= 1, "a fraction is from 0 to 1");
    for (const std::int64_t t : frame_.photons_ps.view()) must(inside(frame_, t), "photon inside");
    for (const std::int64_t t : frame_.syncs_ps.view()) must(inside(frame_, t), "sync inside");
    for (const MarkerTag& m : frame_.markers.view())
      must(inside(frame_, m.time_ps), "marker inside");
    std::int64_t from_ps = frame_.start_ps;
    for (const Loss& loss : frame_.losses.view()) {
      must(loss.begin_ps >= from_ps && loss.end_ps > loss.begin_ps, "losses are sorted, apart");
      from_ps = loss.end_ps;
    }
    must(from_ps <= frame_.end_ps, "losses are clipped");
    const SyncFit& sync = frame_.sync;
    must(sync.count == frame_.syncs_ps.size() && sync.spurious <= sync.count, "syncs are counted");
  }

  Frame frame_{small_room};
  bool is_open_ = false;
  std::uint64_t resets_ = 0;
  std::int64_t end_ps_ = 0;
};

ChannelOptions some_channels(unsigned choice) {
  ChannelOptions options;
  options.sync = (choice & 1U) != 0 ? "marker:2" : "sync";
  options.encoder = (choice & 2U) != 0 ? "" : "marker:1";
  options.photon = (choice & 4U) != 0 ? std::vector<std::string>{"1", "-3", "marker:4"}
                                      : std::vector<std::string>{"1"};
  return options;
}

FramerOptions some_options(FuzzInput& input) {
  constexpr double periods_ps[] = {100e6, 3'780'000, 1e9, 12'345.678, 1e12};
  FramerOptions options;
  options.period_ps = periods_ps[input.below_or(4)];
  options.length_ms = std::max(0.1, static_cast<double>(input.take<std::uint8_t>()));
  // As the configuration has it.
  options.length_ms = std::max(options.length_ms, 3 * options.period_ps * 1e-9);
  options.drift = static_cast<DriftMethod>(input.take<std::uint8_t>() % 3);
  options.max_syncs = small_room.syncs;
  return options;
}

void check(FuzzInput input) {
  const ChannelMap channels(some_channels(input.take<std::uint8_t>()));
  const FramerOptions options = some_options(input);
  const std::size_t piece = 1 + input.take<std::uint8_t>();
  const std::vector<Tag> tags = fuzz_tags(input, 20'000);
  CheckedFrames frames;
  Framer framer(options, channels, frames);
  frames.framer = &framer;
  for (std::size_t at = 0; at < tags.size(); at += piece) {
    framer.push(std::span(tags).subspan(at, std::min(piece, tags.size() - at)), 1);
  }
  framer.finish();

  const FramerTotals& t = framer.totals();
  const auto events =
      std::count_if(tags.begin(), tags.end(), [](const Tag& tag) { return is_event(tag.kind); });
  must(t.events == static_cast<std::uint64_t>(events), "each event is counted once");
  must(t.events == t.photons + t.syncs + t.markers - t.shared + t.ignored + t.late + t.surplus,
       "events are in frames, ignored, late or surplus");
  must(t.photons == frames.photons && t.syncs == frames.syncs && t.markers == frames.markers,
       "what is in frames is counted");
  must(t.late + t.surplus + t.reported == frames.lost + t.unplaced,
       "what is lost is in a frame's count");
  must(t.frames == frames.frames, "frames are counted");
}

}  // namespace
}  // namespace splid::test::fuzz_framer

SPLID_FUZZ_TARGET(framer) {
  splid::test::fuzz_framer::check({data, size});
  return 0;
}
