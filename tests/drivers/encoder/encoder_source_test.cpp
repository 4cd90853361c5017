#include "drivers/encoder/encoder_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>

#include "drivers/simulator/simulator_options.hpp"
#include "protocol/error.hpp"
#include "tests/support/bridge_server.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<EncoderBatch> all(EncoderSource& source) {
  std::vector<EncoderBatch> batches;
  for (EncoderBatch batch; source.next(batch);) batches.push_back(batch);
  return batches;
}

// The next batch, for ten seconds at most.
std::optional<EncoderBatch> await(EncoderSource& source) {
  EncoderBatch batch;
  for (int i = 0; i < 2'000; ++i) {
    if (source.next(batch)) return batch;
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  return std::nullopt;
}

// Sentences from another thread.
struct Warnings {
  std::function<void(const std::string&)> taker() {
    return [this](const std::string& sentence) {
      const std::lock_guard lock(mutex);
      text += sentence + "\n";
    };
  }
  bool wait(const std::string& words) {
    for (int i = 0; i < 2'000; ++i) {
      {
        const std::lock_guard lock(mutex);
        if (text.find(words) != std::string::npos) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
    return false;
  }
  std::mutex mutex;
  std::string text;
};

TEST(EncoderFile, LinesInTheirOrder) {
  const test::TempFolder folder;
  const auto source =
      open_encoder_file(folder.write("counts.csv", "# a rail\n0,5,6\n\noverrun\n9,7\n10,8,9"));
  // The last line has no end: whoever wrote it may have been stopped in the middle of a number.
  EXPECT_THAT(all(*source), ElementsAre(EncoderBatch{0, {5, 6}}, EncoderBatch{0, {}, true},
                                        EncoderBatch{9, {7}}));
  EXPECT_FALSE(source->live());
}

TEST(EncoderFile, MayBeginWithAByteOrderMark) {
  const test::TempFolder folder;
  for (const char* text : {"\xef\xbb\xbf# a rail\r\n0,5\r\n",
                           "\xef\xbb\xbf"
                           "0,5\n"}) {
    const auto source = open_encoder_file(folder.write("counts.csv", text));
    EXPECT_THAT(all(*source), ElementsAre(EncoderBatch{0, {5}}));
  }
}

TEST(EncoderFile, WhatIsWrongHasItsPlace) {
  const test::TempFolder folder;
  const std::string file = folder.write("counts.csv", "0,5\n1;6\n");
  const auto source = open_encoder_file(file);
  EXPECT_EQ(error_text([&] { all(*source); }),
            file + ": line 2: \"1;6\" is not FIRST_INDEX,COUNT[,COUNT...] nor overrun");
  EXPECT_THAT(error_text([&] { open_encoder_file(folder.path("none.csv")); }),
              HasSubstr("none.csv: cannot open the encoder's counts: No such file"));
}

// Else every frame would go without its reference, and without a word.
TEST(EncoderFile, WithoutCountsIsNone) {
  const test::TempFolder folder;
  const char* expected = "the encoder's counts are whole lines of FIRST_INDEX,COUNT[,COUNT...]";
  EXPECT_THAT(error_text([&] { open_encoder_file(folder.path("")); }),
              ::testing::AllOf(HasSubstr("is no file but a folder"), HasSubstr(expected)));
  for (const char* text : {"", "# encoder of a.ptu: index of the first count, counts\n", "0,1"}) {
    EXPECT_THAT(error_text([&] { open_encoder_file(folder.write("empty.csv", text)); }),
                ::testing::AllOf(HasSubstr("empty.csv: holds no counts; "), HasSubstr(expected)));
  }
}

TEST(EncoderSocket, LinesHoweverTheyAreCut) {
  test::BridgeServer server;
  Warnings warnings;
  const auto source = open_encoder_socket(server.address(), warnings.taker());
  EXPECT_TRUE(source->live());
  ASSERT_TRUE(server.accept());
  server.send(std::string("# hello\n0,1,"));
  std::this_thread::sleep_for(std::chrono::milliseconds{50});
  server.send(std::string("2\noverrun\n7,3\n"));
  EXPECT_EQ(await(*source), (EncoderBatch{0, {1, 2}}));
  EXPECT_EQ(await(*source), (EncoderBatch{0, {}, true}));
  EXPECT_EQ(await(*source), (EncoderBatch{7, {3}}));
}

TEST(EncoderSocket, ConnectsAnewAndSaysWhy) {
  test::BridgeServer server;
  Warnings warnings;
  const auto source = open_encoder_socket(server.address(), warnings.taker());
  ASSERT_TRUE(server.accept());
  server.send(std::string("0,1\nnonsense\n"));
  EXPECT_EQ(await(*source), (EncoderBatch{0, {1}}));
  EXPECT_TRUE(warnings.wait("\"nonsense\" is not FIRST_INDEX,COUNT"));
  ASSERT_TRUE(server.accept());
  server.send(std::string("1,"));
  server.hang_up();
  EXPECT_TRUE(warnings.wait("the other side closed the connection"));
  ASSERT_TRUE(server.accept());
  server.send(std::string("5,6\n"));
  EXPECT_EQ(await(*source), (EncoderBatch{5, {6}}));
}

TEST(EncoderSocket, GarbageIsFollowedByAPause) {
  test::BridgeServer server;
  Warnings warnings;
  const auto source = open_encoder_socket(server.address(), warnings.taker());
  ASSERT_TRUE(server.accept());
  const auto begin = std::chrono::steady_clock::now();
  server.send(std::string("nonsense\n"));
  ASSERT_TRUE(server.accept());
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds{500});
}

// What nobody takes does not fill the memory.
TEST(EncoderSocket, SoManyCountsWaitAndNoMore) {
  test::BridgeServer server;
  Warnings warnings;
  const auto source = open_encoder_socket(server.address(), warnings.taker());
  ASSERT_TRUE(server.accept());
  std::string counts;
  for (int i = 0; i < 500'000; ++i) counts += ",1";
  for (int index = 0; index < 10; ++index) server.send(std::to_string(index) + counts + "\n");
  server.send(std::string("10,1\nend\n"));
  ASSERT_TRUE(warnings.wait("\"end\" is not FIRST_INDEX"));
  std::vector<std::int64_t> indices;
  for (const EncoderBatch& batch : all(*source)) indices.push_back(batch.first_index);
  EXPECT_THAT(indices, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 10));
}

TEST(SimulatedEncoder, CountsTheTruePlaceToTheNearest) {
  simulator::Options scene;
  scene.encoder_rate_hz = 1'000;
  scene.encoder_start_s = 0.5;
  scene.target.motion = simulator::MotionKind::linear;
  scene.target.distance_m = 100;
  scene.target.velocity_mps = 2;
  EncoderOptions options;
  options.offset_m = 90;
  options.m_per_count = -0.25;
  const auto source = open_encoder(options, &scene, {});
  ASSERT_NE(source, nullptr);
  for (std::int64_t index = 0; index < 500;) {
    EncoderBatch batch;
    ASSERT_TRUE(source->next(batch));
    EXPECT_EQ(batch.first_index, index);
    for (const std::int64_t count : batch.counts) {
      const double true_m = 100 + 2 * (0.5 + static_cast<double>(index) / 1'000);
      EXPECT_LE(std::abs(90 - 0.25 * static_cast<double>(count) - true_m), 0.125 + 1e-9);
      ++index;
    }
  }
}

TEST(Encoder, ThereIsNoneWhereNothingAsksForOne) {
  simulator::Options scene;
  EXPECT_EQ(open_encoder({}, &scene, {}), nullptr);
  EXPECT_EQ(open_encoder({}, nullptr, {}), nullptr);
}

}  // namespace
}  // namespace splid
