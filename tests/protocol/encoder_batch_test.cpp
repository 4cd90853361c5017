#include "protocol/encoder_batch.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

TEST(EncoderBatch, ALineAndBack) {
  for (const EncoderBatch& batch :
       {EncoderBatch{0, {0}}, EncoderBatch{1, {-1, 2}},
        EncoderBatch{9'223'372'036'854'775'807, {9'223'372'036'854'775'807, -5}},
        EncoderBatch{0, {}, true}}) {
    EXPECT_EQ(parse_encoder_line(to_encoder_line(batch)), batch) << to_encoder_line(batch);
  }
  EXPECT_EQ(to_encoder_line({7, {5, -6}}), "7,5,-6\n");
  EXPECT_EQ(to_encoder_line({7, {5}, true}), "overrun\n7,5\n");
  EXPECT_EQ(to_encoder_line({}), "");
}

TEST(EncoderBatch, BlanksAndRemarks) {
  EXPECT_EQ(parse_encoder_line(" 4 , 5,\t6 \r"), (EncoderBatch{4, {5, 6}}));
  EXPECT_EQ(parse_encoder_line(" overrun\r"), (EncoderBatch{0, {}, true}));
  EXPECT_EQ(parse_encoder_line(""), EncoderBatch{});
  EXPECT_EQ(parse_encoder_line("# counts of the rail"), EncoderBatch{});
}

TEST(EncoderBatch, LinesThatAreNone) {
  for (const char* line : {"4", "4,", ",5", "-1,5", "4,5,", "4;5", "4,5.0", "index,count",
                           "4,9223372036854775808", "overrun,4"}) {
    EXPECT_EQ(parse_encoder_line(line), std::nullopt) << line;
  }
}

}  // namespace
}  // namespace splid
