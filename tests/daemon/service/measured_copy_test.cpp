#include "daemon/service/measured_copy.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>
#include <vector>

#include "tests/support/daemon_scene.hpp"
#include "tests/support/full_table.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

// A recording goes on where its frames cannot be made, also one of a source that waits for room.
//
// Not under asan: with a full table the sanitizer opens no pipe, with which it looks whether memory
// can be read, and takes each object for an invalid one.
TEST(MeasuredCopy, ThatFailsHoldsNoRecordingUp) {
  const test::TempFolder folder;
  Config config = scene_config(0);
  config.record.frames = RecordFrames::csv;
  std::optional<test::FullTable> full(std::in_place, ::getpid());
  MeasuredCopy copy(config, SourceInfo{"a replay", false, {}}, folder.path("a.ptu"));
  std::vector<Tag> tags(4 * static_cast<std::size_t>(config.pipeline.ring_capacity_tags));
  for (std::size_t i = 0; i < tags.size(); ++i) {
    tags[i] = sync_tag(static_cast<std::int64_t>(i) * 3'780'000);
  }
  copy.take(tags);
  full.reset();
  EXPECT_ANY_THROW((void)copy.finish({}));
}

}  // namespace
}  // namespace splid
