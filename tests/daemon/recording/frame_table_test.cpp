#include "daemon/recording/frame_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/frame_columns.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/python_program.hpp"
#include "tests/support/small_disk.hpp"

namespace splid::recording {
namespace {

using nlohmann::json;
using test::file_text;
using ::testing::HasSubstr;

const TableFacts table_facts{"splid 1.2.3", R"({"a":1})", R"({"b":2})", "my.ptu"};

FrameMessage frame(std::uint64_t sequence) {
  FrameMessage message;
  message.sequence = sequence;
  message.status = FrameStatus::ok;
  message.distance_m = 0.1 * static_cast<double>(sequence);
  return message;
}

std::string python_reads(std::vector<std::string> arguments) {
  const test::ProgramResult read =
      test::python("tests/support/python/read_table.py", arguments).wait();
  EXPECT_EQ(read.exit_code, 0) << read.err;
  return read.out;
}

TEST(FrameTable, H5pyReadsWhatWasFlushedAtAnyMoment) {
  const test::TempFolder folder;
  const std::string file = folder.path("a.h5");
  FrameTable table(file, table_facts, false);
  std::vector<std::string> copies;
  const auto copy = [&] {
    copies.push_back(folder.path(std::to_string(copies.size()) + ".h5"));
    std::filesystem::copy_file(file, copies.back());
  };
  copy();
  table.flush();
  copy();
  table.add(frame(0));
  copy();
  table.flush();
  copy();
  for (std::uint64_t i = 1; i < 1000; ++i) table.add(frame(i));
  table.flush();
  table.add(frame(1000));
  copy();
  EXPECT_EQ(table.rows(), 1000U);
  copies.insert(copies.begin(), "rows");
  EXPECT_EQ(python_reads(copies), "0\n0\n0\n1\n1000\n");
  const std::string frames = python_reads({"frames", file});
  const auto last = json_value(frames.substr(frames.rfind('\n', frames.size() - 2) + 1));
  EXPECT_EQ(last["sequence"], 999);
  EXPECT_EQ(last["distance_m"], 0.1 * 999);
  EXPECT_EQ(last["status"], "ok");
  EXPECT_EQ(last["valid"], true);
}

TEST(FrameTable, HoldsItsFacts) {
  const test::TempFolder folder;
  const std::string file = folder.path("a.h5");
  const std::string large = "\"" + std::string(300'000, 'x') + "\"";  // an attribute holds 64 KiB
  FrameTable table(
      file, {table_facts.program, large, table_facts.pattern_json, table_facts.recording}, false);
  auto read = json_value(python_reads({"facts", file}));
  EXPECT_EQ(read["recording_sha256"], "");
  table.write_checksum(std::string(64, 'e'));
  read = json_value(python_reads({"facts", file}));
  EXPECT_EQ(read["recording_sha256"], std::string(64, 'e'));
  EXPECT_EQ(read["program"], "splid 1.2.3");
  EXPECT_EQ(read["recording"], "my.ptu");
  EXPECT_EQ(read["configuration"].get<std::string>().size(), 300'000U);
  EXPECT_EQ(read["pattern"]["b"], 2);
  EXPECT_EQ(read["units"]["distance_m"], "m");
  EXPECT_EQ(read["units"]["sync_drift_ppm"], "ppm");
  EXPECT_EQ(read["units"]["status"], "");
  EXPECT_EQ(read["units"].size(), frame_columns().size());
}

// The file as a kill leaves it between any two of the writes of a flush().
// Whoever writes heads finds the fields that change by comparing two heads; were there a time of
// day in a head, two of them that are made on either side of a full second would differ in it.
TEST(TableHead, HoldsNoTimeOfDay) {
  const std::string before = make_hdf5_head(table_facts).bytes;
  std::this_thread::sleep_for(std::chrono::milliseconds{1100});
  EXPECT_TRUE(make_hdf5_head(table_facts).bytes == before);
}

TEST(TableHead, ATableThatIsHalfExtendedIsReadAsItWasBefore) {
  const test::TempFolder folder;
  const TableHead head = make_hdf5_head(table_facts);
  std::string rows;
  for (std::uint64_t i = 0; i < 3; ++i) append_frame_row(frame(i), rows);
  const auto with = [&](std::string bytes, const TableHead::Field& field, std::uint64_t count) {
    const std::uint64_t value = field.value(count);
    std::memcpy(&bytes[field.at], &value, sizeof value);
    return bytes;
  };
  const auto with_piece = [&](std::string bytes, std::uint64_t count) {
    const TableHead::Piece piece = head.of_rows(count);
    return bytes.replace(piece.at, piece.bytes.size(), piece.bytes);
  };
  std::vector<std::string> files = {"rows"};
  const auto add = [&](const std::string& bytes) {
    files.push_back(folder.write(std::to_string(files.size()), bytes + rows));
  };
  // The first rows come in one piece, after the file's end.
  add(head.bytes);
  std::string grown = with(head.bytes, head.fields.front(), 1);
  add(grown);
  grown = with_piece(grown, 1);
  add(grown);
  std::string expected = "0\n0\n1\n";
  // Further rows come field by field: the fourth is the number of rows.
  ASSERT_EQ(head.fields.size(), 5U);
  for (std::size_t written = 1; written <= 5; ++written) {
    grown = with(grown, head.fields[written - 1], 3);
    add(grown);
    expected += written < 4 ? "1\n" : "3\n";
  }
  EXPECT_EQ(python_reads(files), expected);
}

TEST(FrameTable, TextHasItsFactsBesideIt) {
  const test::TempFolder folder;
  const std::string file = folder.path("a.csv");
  FrameTable table(file, table_facts, false);
  table.add(frame(7));
  table.flush();
  EXPECT_EQ(file_text(file), frame_csv_head() + frame_csv_row(frame(7)));
  table.write_checksum("abc");
  const auto beside = json_value(file_text(facts_file_of(file)));
  EXPECT_EQ(beside["recording_sha256"], "abc");
  EXPECT_EQ(beside["configuration"]["a"], 1);
}

TEST(FrameTable, NeverWritesOverWhatIsThereUnlessItMay) {
  const test::TempFolder folder;
  const std::string file = folder.write("a.h5", "mine");
  EXPECT_THAT(test::error_text([&] { FrameTable(file, table_facts, false); }),
              HasSubstr("the file exists; give another name, or --force"));
  EXPECT_EQ(file_text(file), "mine");
  FrameTable(file, table_facts, true);
  EXPECT_EQ(python_reads({"rows", file}), "0\n");
  EXPECT_THAT(test::error_text([&] { FrameTable(folder.path("none/a.h5"), table_facts, false); }),
              HasSubstr("cannot be made: No such file"));
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.h5.part")));
  std::filesystem::create_directory(folder.path("b.csv"));
  EXPECT_THAT(test::error_text([&] { FrameTable(folder.path("b.csv"), table_facts, true); }),
              HasSubstr("is no file but a folder"));
  EXPECT_THAT(test::error_text([&] { FrameTable(folder.path("a.txt"), table_facts, true); }),
              HasSubstr("ends in .h5 (HDF5) or in .csv (text)"));
}

TEST(FrameTable, OnAFullDiskTheRowsWrittenBeforeStay) {
  const test::SmallDisk disk(4);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  for (const char* name : {"a.h5", "a.csv"}) {
    FrameTable table(disk.path(name), table_facts, false);
    table.add(frame(0));
    table.flush();
    disk.fill_but(0);
    for (std::uint64_t i = 1; i < 1000; ++i) table.add(frame(i));
    EXPECT_THAT(test::error_text([&] { table.flush(); }),
                HasSubstr("No space left on device after 1 frames; these can be read"));
    EXPECT_EQ(table.give_up(), 999U);
    disk.clear();
    table.add(frame(1000));
    table.flush();
    EXPECT_EQ(table.rows(), 2U);
  }
  EXPECT_EQ(python_reads({"rows", disk.path("a.h5")}), "2\n");
  EXPECT_EQ(file_text(disk.path("a.csv")),
            frame_csv_head() + frame_csv_row(frame(0)) + frame_csv_row(frame(1000)));
}

}  // namespace
}  // namespace splid::recording
