#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/pace.hpp"
#include "drivers/replay/loss_list.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "drivers/source.hpp"
#include "drivers/tag_writer.hpp"

// drivers/replay/ plays a recording again. Read this header first, then recording_reader.hpp, which
// reads the tags of a file of any format, and recording_info.hpp, which sums a file up.

namespace splid {

// A recording played again. JSON: `source` with the driver "replay".
struct ReplayOptions : SourceOptions {
  std::string recording;  // PTU, T2 or T3 mode
  double speed = 0;       // recorded time per real time; 0: as fast as possible

  void describe(OptionVisitor& visitor) override;
  // A recording has 64 channels, whose inputs may have any number.
  [[nodiscard]] std::optional<InputRange> inputs() const override {
    return InputRange{least_pixel_input, most_pixel_input, 64};
  }
  [[nodiscard]] std::optional<OptionFault> start_fault() const override;
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
};

// The tags of a recording, with the losses that its header lists in their places, and a heartbeat
// at the end. No tag is dropped, and the tags are the same at any speed.
//
// Threads, timeouts: as TagSource. Errors: Error(Fault::data) with the file and the byte offset.
// The constructor throws it for a header that cannot be used.
class ReplaySource : public TagSource {
 public:
  ReplaySource(const ReplayOptions& options, const SourceContext& context);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;

 private:
  bool run_directly(TagSink& sink, const std::stop_token& stop);
  bool run_in_slices(TagSink& sink, const std::stop_token& stop);
  bool put_before(std::int64_t time_ps, TagWriter& out, const std::stop_token& stop);
  bool put(const Tag& tag, TagWriter& out, const std::stop_token& stop);
  bool await(std::int64_t time_ps, TagWriter& out, const std::stop_token& stop);
  void end(TagSink& sink);

  double speed_;
  RecordingReader reader_;
  LossList losses_;
  std::vector<Tag> block_;
  Pace pace_{0};
  std::int64_t first_ps_ = 0;
  std::int64_t slice_end_ps_ =
      std::numeric_limits<std::int64_t>::min();  // end of the recorded time that may go out now
  bool started_ = false;
  std::int64_t reached_ps_;  // latest time so far
};

}  // namespace splid
