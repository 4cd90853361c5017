#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/replay/recording_info.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "protocol/frame_json.hpp"
#include "tests/support/hdf5_maker.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/made_recording.hpp"
#include "tests/support/other_recordings.hpp"
#include "tests/support/program.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/t3_recording.hpp"

// Recordings of other formats through the built program: looked at, measured and converted.

namespace splid {
namespace {

using test::run_program;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

bool earlier(const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }

class ConvertProgram : public ::testing::Test {
 protected:
  ConvertProgram() {
    config = folder.write("config.json",
                          R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator",)"
                          R"("pace":"max"},"pattern":{"file":")" SPLID_SOURCE_DIR
                          R"(/config/patterns/interleaved-180-189.json"})" +
                              std::string(test::small_ring) + "}");
  }

  std::string simulated() {
    std::string file = folder.path("simulated.ptu");
    EXPECT_EQ(run_program({"simulate", "--config", config, "--seconds", "0.3", "--output", file})
                  .exit_code,
              0);
    return file;
  }

  // The frames of a recording as JSON, without how long they took.
  std::vector<std::string> frames(const std::string& file) {
    std::istringstream lines(
        run_program({"replay", file, "--config", config, "--no-publish", "--json"}).out);
    std::vector<std::string> all;
    for (std::string line; std::getline(lines, line);) {
      FrameMessage frame = frame_from_json(line);
      frame.compute_ms.reset();
      frame.latency_ms.reset();
      all.push_back(to_json(frame));
    }
    return all;
  }

  test::TempFolder folder;
  std::string config;
};

TEST_F(ConvertProgram, AT2RecordingKeepsItsTagsAndItsFrames) {
  const std::string ptu = simulated();
  const std::string converted = folder.path("converted.ptu");
  const auto result = run_program({"convert", ptu, converted});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("T2 mode, 0 tags lost"));
  EXPECT_EQ(test::read_back(converted), test::read_back(ptu));
  EXPECT_EQ(frames(converted), frames(ptu));
  EXPECT_FALSE(std::filesystem::exists(converted + ".part"));
}

// A scene whose photons come on an input without a channel of its own, recorded, measured and
// converted.
TEST_F(ConvertProgram, AnyInputIsMeasuredAgainAndConverted) {
  std::string text = test::file_text(config);
  text.replace(text.find(R"("pace":"max")"), 12, R"("pace":"max","photon_input":0)");
  text.insert(text.size() - 1, R"(,"channels":{"photon":[0]})");
  config = folder.write("input-0.json", text);
  const std::string ptu = simulated();
  const std::vector<std::string> of_ptu = frames(ptu);
  ASSERT_GE(of_ptu.size(), 5U);
  EXPECT_THAT(of_ptu.front(), HasSubstr(R"("status":"ok")"));
  const auto checked = run_program({"check", ptu});
  EXPECT_THAT(checked.out, HasSubstr("input 0 "));
  EXPECT_THAT(checked.out, HasSubstr("CHANNEL:INPUT: 62:0"));
  const std::string converted = folder.path("converted.ptu");
  const auto result = run_program({"convert", ptu, converted});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("T2 mode, 0 tags lost"));
  EXPECT_EQ(test::read_back(converted), test::read_back(ptu));
  EXPECT_EQ(frames(converted), of_ptu);
}

TEST_F(ConvertProgram, EachOf64InputsKeepsItsChannel) {
  std::string bytes = test::recording(PtuFacts(), {});
  for (int input = 0; input < 64; ++input) {
    const std::uint32_t record =
        test::photon_record(input, 1000 + static_cast<std::uint32_t>(input));
    bytes.append(reinterpret_cast<const char*>(&record), sizeof record);
  }
  const std::string ptu = folder.write("inputs.ptu", bytes);
  const std::string converted = folder.path("converted.ptu");
  const auto result = run_program({"convert", ptu, converted});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("T2 mode, 0 tags lost"));
  EXPECT_EQ(test::read_back(converted), test::read_back(ptu));
  EXPECT_EQ(test::read_back(converted).size(), 64U);
  EXPECT_EQ(scan_recording(converted).header.text("Splid_Inputs"), "");
}

TEST_F(ConvertProgram, AT3RecordingStaysT3) {
  const std::vector<std::uint32_t> records = test::as_t3(test::read_back(simulated()), 128);
  const std::string ht3 =
      folder.write("a.ht3", test::hydra_harp_recording(3, "2.0", records, 128, 264'550));
  const std::string converted = folder.path("a.ptu");
  const auto result = run_program({"convert", ht3, converted});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("T3 mode"));
  const RecordingInfo info = scan_recording(converted);
  EXPECT_TRUE(info.header.is_t3);
  EXPECT_EQ(info.header.record_count, info.records);
  EXPECT_EQ(info.header.text("HW_Type"), "HydraHarp 400");
  EXPECT_EQ(test::read_back(converted), test::read_back(ht3));
  const auto of_ht3 = frames(ht3);
  ASSERT_GE(of_ht3.size(), 5U);
  EXPECT_THAT(of_ht3.front(), HasSubstr(R"("status":"ok")"));
  EXPECT_EQ(frames(converted), of_ht3);
}

// The numbers of a recording's syncs, times since them in steps of 16 ps, and inputs, as
// Photon-HDF5 has them.
test::PhotonArrays as_photon_hdf5(const std::string& t3_file) {
  constexpr std::int64_t period_ps = 1'000'000'000;
  RecordingReader reader(
      t3_file, [](const std::string&) {}, static_cast<double>(period_ps));
  test::PhotonArrays arrays;
  arrays.step_s = reader.header().resolution_s;
  const auto step_ps = static_cast<std::int64_t>(std::llround(arrays.step_s * 1e12));
  std::vector<Tag> block(4096);
  while (const std::size_t count = reader.read(block)) {
    for (const Tag& tag : std::span(block).first(count)) {
      if (tag.kind != TagKind::photon) continue;
      arrays.timestamps.push_back(tag.time_ps / period_ps);
      arrays.nanotimes.push_back(static_cast<std::uint16_t>(tag.time_ps % period_ps / step_ps));
      arrays.detectors.push_back(static_cast<std::uint8_t>(tag.value));
    }
  }
  arrays.unit_s = reader.header().sync_period_s;
  arrays.laser_hz = 1 / arrays.unit_s;
  arrays.bins = 32'768;
  arrays.form = test::ArrayForm::packed(1000);
  return arrays;
}

TEST_F(ConvertProgram, PhotonHdf5GivesTheFramesOfItsTwin) {
  test::T3Recording t3;
  t3.records = test::as_t3(test::read_back(simulated()), 128);
  const std::string ptu = folder.write("a.ptu", t3.bytes());
  const std::string hdf5 = folder.path("a.hdf5");
  test::write_photon_hdf5(hdf5, as_photon_hdf5(ptu));
  const std::string converted = folder.path("b.ptu");
  const auto result = run_program({"convert", hdf5, converted});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(test::read_back(converted), test::read_back(ptu));
  const auto of_ptu = frames(ptu);
  ASSERT_GE(of_ptu.size(), 5U);
  EXPECT_THAT(of_ptu.front(), HasSubstr(R"("status":"ok")"));
  EXPECT_EQ(frames(converted), of_ptu);
}

TEST_F(ConvertProgram, InputsKeepTheirNumbersAndLossesTheirPlace) {
  PtuFacts facts = test::counted(3);
  facts.losses = {{500, 900, 7}};
  facts.created_unix_s = 1'700'000'000;
  facts.instrument = "a tagger";
  const std::string file = folder.write(
      "a.ptu",
      test::recording(facts, {test::photon_record(0, 5), test::photon_record(62, 2'000'000),
                              test::marker_record(3, 3'000'000)}));
  const std::string converted = folder.path("b.ptu");
  ASSERT_EQ(run_program({"convert", file, converted}).exit_code, 0);
  EXPECT_EQ(test::read_back(converted), test::read_back(file));
  const RecordingHeader header = scan_recording(converted).header;
  EXPECT_THAT(header.losses, ElementsAre(Loss{500, 900, 7}));
  EXPECT_EQ(header.text("HW_Type"), "a tagger");
  const double at_zero_s = *header.created_unix_s - static_cast<double>(header.origin_ps) * 1e-12;
  EXPECT_NEAR(at_zero_s, 1'700'000'000, 1e-5);
}

TEST_F(ConvertProgram, LostPhotonsOfASpcAreLossesOfThePtu) {
  folder.write("a.set", std::string(test::spc_settings));
  const std::string spc = folder.write(
      "a.spc", test::spc_recording(37'800, {test::spc_photon(3, 4095, 2),
                                            test::spc_gap | test::spc_photon(9, 1000, 2)}));
  const std::string converted = folder.path("b.ptu");
  const auto result = run_program({"convert", spc, converted});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(scan_recording(converted).header.losses,
              ElementsAre(Loss{3 * 3'780'000, 9 * 3'780'000, -1}));
  EXPECT_EQ(test::read_back(converted).size(), 4U);
  EXPECT_THAT(result.err, HasSubstr("0 tags lost; losses of an unknown number of tags: 1\n"));
}

TEST_F(ConvertProgram, TheLossesOfAT3HeaderAreCounted) {
  test::T3Recording t3;
  t3.records = {test::t3_photon(1, 10, 3)};
  std::string bytes = t3.bytes();
  constexpr std::string_view losses = "500:900:7 1000:1000:5 2000:3000:-1";
  bytes.replace(bytes.find("Splid_Losses") + 48, losses.size(), losses);
  const auto result = run_program({"convert", folder.write("a.ptu", bytes), folder.path("b.ptu")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err,
              HasSubstr("T3 mode, 12 tags lost; losses of an unknown number of tags: 1"));
}

// Of which nobody knows the time. For readers that take the largest time for a time like any other,
// they are photons of their input too.
TEST_F(ConvertProgram, UntimedPhotonsStayOnTheirInputs) {
  constexpr std::uint32_t latest = 32'767;
  // Formats have largest times of their own.
  const auto without_untimed_times = [](const std::string& file) {
    std::vector<Tag> tags = test::read_back(file);
    for (Tag& tag : tags) {
      if (tag.kind == TagKind::missed) tag.time_ps = 0;
    }
    return tags;
  };
  const auto is_kept = [&](const std::string& name, const std::string& content) {
    const std::string file = folder.write(name, content);
    const std::string converted = folder.path("converted.ptu");
    const auto result = run_program({"convert", file, converted, "--force"});
    EXPECT_THAT(result.err, HasSubstr("2 records in")) << name;
    EXPECT_THAT(result.err, HasSubstr(", T3 mode, 0 tags lost\n")) << name;
    EXPECT_EQ(without_untimed_times(converted), without_untimed_times(file)) << name;
    std::string records;
    for (const std::uint32_t record :
         {test::t3_photon(3, latest, 5), test::t3_photon(1, 2'000, 6)}) {
      test::append_little_endian(records, record, 4);
    }
    EXPECT_TRUE(test::file_text(converted).ends_with(records)) << name;
  };
  test::T3Recording t3;
  t3.records = {test::t3_photon(3, latest, 5), test::t3_photon(1, 2'000, 6)};
  is_kept("a.ptu", t3.bytes());
  is_kept("a.ht3", test::hydra_harp_recording(3, "1.0", t3.records));
  is_kept("a.pt3", test::pico_harp_recording(
                       3, {3U << 28U | 4095U << 16U | 5U, 1U << 28U | 2'000U << 16U | 6U}));
  folder.write("a.set", std::string(test::spc_settings));
  is_kept("a.spc", test::spc_recording(37'800, {test::spc_invalid | test::spc_photon(5, 7, 3),
                                                test::spc_photon(6, 4095 - 2'000, 1)}));
}

TEST_F(ConvertProgram, ADividedSyncStaysSo) {
  const std::string file =
      folder.write("a.pt2", test::pico_harp_recording(2, {1U << 28U | 5U, 7U}));
  ASSERT_EQ(run_program({"convert", file, folder.path("a.ptu")}).exit_code, 0);
  EXPECT_EQ(scan_recording(folder.path("a.ptu")).header.integer("HWSync_Divider"), 4);
}

TEST_F(ConvertProgram, TagsThatAPtuCannotHoldAtTheirTimesAreRefused) {
  const auto refused = [&](std::vector<test::QutagEvent> events) {
    const std::string file = folder.write("a.qutag", test::qutag_recording(events));
    const auto result = run_program({"convert", file, folder.path("a.ptu")});
    EXPECT_EQ(result.exit_code, 4) << result.err;
    EXPECT_THAT(result.err, HasSubstr(file + ": tag "));
    EXPECT_THAT(result.err, HasSubstr("splid replay measures the recording itself"));
    EXPECT_FALSE(std::filesystem::exists(folder.path("a.ptu")));
    EXPECT_FALSE(std::filesystem::exists(folder.path("a.ptu.part")));
    return result.err;
  };
  constexpr std::int64_t day_ps = 86'400'000'000'000'000;
  constexpr std::int64_t turn_ps = std::int64_t{1} << 48U;
  // The clock was set; a photon that is late, by much and by just too much; the end of 48 bits.
  EXPECT_THAT(refused({{12'000'000'000, 1}, {12'000'000'005, 5}, {1'000'000, 1}, {1'000'009, 5}}),
              HasSubstr("tag 3, at 1000000 ps, is 11,999,000,005 ps before a tag that precedes"));
  EXPECT_THAT(refused({{3'000'000'000, 1}, {1'000'000'000, 1}, {3'000'000'001, 5}}),
              HasSubstr("tag 2, at 1000000000 ps, is 2,000,000,000 ps before"));
  EXPECT_THAT(refused({{7'000'000, 1}, {5'999'999, 1}}), HasSubstr("is 1,000,001 ps before"));
  EXPECT_THAT(refused({{turn_ps - 5, 1}, {3, 5}, {9, 1}}),
              HasSubstr("tag 2, at 3 ps, is 281,474,976,710,648 ps before"));
  EXPECT_THAT(refused({{5, 1}, {day_ps + 6, 5}}),
              HasSubstr("is 86,400,000,000,000,001 ps after all tags that precede it"));
  // Both sides.
  for (const auto& events :
       {std::vector<test::QutagEvent>{{7'000'000, 1}, {6'000'000, 1}}, {{5, 1}, {day_ps + 5, 5}}}) {
    const std::string file = folder.write("a.qutag", test::qutag_recording(events));
    const auto result = run_program({"convert", file, folder.path("b.ptu"), "--force"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(test::read_back(folder.path("b.ptu")).size(), 2U);
  }
}

TEST_F(ConvertProgram, TagsUnsortedWithinAMicrosecondGiveTheSameFrames) {
  std::mt19937 generator(1);
  std::multimap<std::int64_t, test::QutagEvent> in_disorder;
  for (const Tag& tag : test::read_back(simulated())) {
    const auto input = static_cast<std::int16_t>(tag.kind == TagKind::sync ? 5 : 1);
    in_disorder.insert({tag.time_ps + static_cast<std::int64_t>(generator() % 1'000'000),
                        test::QutagEvent{tag.time_ps, input}});
  }
  std::vector<test::QutagEvent> events;
  for (const auto& [came_ps, event] : in_disorder) events.push_back(event);
  config = folder.write("qutag.json",
                        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator"},)"
                        R"("channels":{"photon":[1],"sync":5},"pattern":{"file":")" SPLID_SOURCE_DIR
                        R"(/config/patterns/interleaved-180-189.json"}})");
  const std::string qutag = folder.write("a.qutag", test::qutag_recording(events));
  const std::string converted = folder.path("b.ptu");
  const auto result = run_program({"convert", qutag, converted});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::vector<Tag> sorted = test::read_back(qutag);
  EXPECT_FALSE(std::is_sorted(sorted.begin(), sorted.end(), earlier));
  std::stable_sort(sorted.begin(), sorted.end(), earlier);
  EXPECT_EQ(test::read_back(converted), sorted);
  // But for the last digits of sums, which depend on the order, and the time of day.
  const auto measured = [&](const std::string& file) {
    std::vector<std::string> all;
    for (const std::string& line : frames(file)) {
      const FrameMessage frame = frame_from_json(line);
      all.push_back(fmt::format("{} {} {} {:.9g}", frame.start_ps, frame.photons.value_or(0),
                                frame.sync->count, frame.distance_m.value_or(0)));
    }
    return all;
  };
  const auto of_qutag = measured(qutag);
  ASSERT_GE(of_qutag.size(), 5U);
  EXPECT_EQ(measured(converted), of_qutag);
}

// Of PicoHarps, whose records count to 65,536 syncs, and those of a PTU to 1,024.
TEST_F(ConvertProgram, ASyncThatGoesBackFurtherThanT3CountsIsRefused) {
  const auto photon = [](std::uint32_t sync) { return 1U << 28U | 100U << 16U | sync; };
  const auto convert = [&](const std::vector<std::uint32_t>& records) {
    const std::string file = folder.write("a.pt3", test::pico_harp_recording(3, records));
    return run_program({"convert", file, folder.path("b.ptu"), "--force"});
  };
  EXPECT_EQ(convert({photon(1025), photon(1024)}).exit_code, 0);
  EXPECT_EQ(test::read_back(folder.path("b.ptu")), test::read_back(folder.path("a.pt3")));
  const auto result = convert({photon(1025), photon(1023)});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("a.pt3: 1 of its tags have a sync before that of an earlier"));
}

TEST_F(ConvertProgram, APipeIsSaidToBeOne) {
  const std::string pipe = folder.path("a.ptu");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"check", pipe},
        {"convert", pipe, folder.path("b.ptu")},
        {"replay", pipe, "--config", config, "--no-publish"}}) {
    const auto result = run_program(arguments);
    EXPECT_EQ(result.exit_code, 4) << arguments.front();
    EXPECT_THAT(result.err, HasSubstr(pipe + ": is a pipe or a device, which can be read only "
                                             "once"))
        << arguments.front();
  }
}

TEST_F(ConvertProgram, SettingsInCapitalsAreFound) {
  folder.write("A.SET", std::string(test::spc_settings));
  const std::string spc =
      folder.write("A.SPC", test::spc_recording(100, {test::spc_photon(1, 1, 1)}));
  EXPECT_THAT(run_program({"check", spc}).out, HasSubstr("T3, 8 ps a tick"));
  folder.write("A.set", "[SP_TAC_R,F,1.31072e-07] [SP_TAC_G,I,2]");
  EXPECT_THAT(run_program({"check", spc}).out, HasSubstr("T3, 16 ps a tick"));
}

TEST_F(ConvertProgram, CheckSaysWhatEachIs) {
  const auto check = [&](const std::string& name, const std::string& content) {
    const auto result = run_program({"check", folder.write(name, content)});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  EXPECT_THAT(check("a.qutag", test::qutag_recording({{5, 1}, {9, 5}})),
              AllOf(HasSubstr("a quTAG recording, T2, 1 ps a tick"), HasSubstr("input 5")));
  EXPECT_THAT(check("a.pt2", test::pico_harp_recording(2, {5})),
              HasSubstr("a PicoHarp recording (.pt2, .pt3), T2, record type 0x00010203, 4 ps"));
  EXPECT_THAT(check("a.ht3", test::hydra_harp_recording(3, "1.0", {5})),
              AllOf(HasSubstr("a HydraHarp recording (.ht2, .ht3), T3, record type 0x00010304"),
                    HasSubstr("as the header has it")));
  folder.write("a.set", std::string(test::spc_settings));
  EXPECT_THAT(check("a.spc", test::spc_recording(100, {test::spc_photon(1, 1, 1)})),
              HasSubstr("a Becker & Hickl recording (.spc), T3, 8 ps a tick"));
  test::PhotonArrays arrays;
  arrays.timestamps = {5, 9};
  arrays.detectors = {1, 5};
  test::write_photon_hdf5(folder.path("a.hdf5"), arrays);
  EXPECT_THAT(run_program({"check", folder.path("a.hdf5")}).out,
              AllOf(HasSubstr("a Photon-HDF5 recording, T2, 1 ps a tick"), HasSubstr("input 5")));
  const auto alone = run_program({"check", folder.write("b.spc", test::spc_recording(100, {}))});
  EXPECT_EQ(alone.exit_code, 4);
  EXPECT_THAT(alone.err, HasSubstr("the same name with .set"));
}

TEST_F(ConvertProgram, ATableOfFramesIsToldFromARecording) {
  const std::string table = folder.path("frames.h5");
  ASSERT_EQ(
      run_program({"replay", simulated(), "--config", config, "--no-publish", "--output", table})
          .exit_code,
      0);
  const auto result = run_program({"check", table});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("frames.h5: is a table of frames that splid wrote"));
  const auto replayed = run_program({"replay", table, "--config", config, "--no-publish"});
  EXPECT_EQ(replayed.exit_code, 4);
  EXPECT_THAT(replayed.err, HasSubstr("is an HDF5 file: a table of frames, Photon-HDF5 or"));
}

TEST_F(ConvertProgram, MistakesAreSaidAndLeaveNothingBehind) {
  const std::string ptu = simulated();
  const auto said = [&](const std::vector<std::string>& arguments, int exit_code) {
    const auto result = run_program(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    return result.err;
  };
  EXPECT_THAT(said({"convert", ptu, ptu, "--force"}, 2), HasSubstr("is the recording itself"));
  EXPECT_THAT(said({"convert", ptu, folder.path("a.txt")}, 2), HasSubstr("end its name in .ptu"));
  EXPECT_THAT(said({"convert", folder.path("none.pt2"), folder.path("a.ptu")}, 4),
              HasSubstr("cannot open the recording"));
  EXPECT_THAT(said({"convert", config, folder.path("a.ptu")}, 4),
              HasSubstr("is a splid configuration, but a recording is expected"));
  EXPECT_THAT(said({"convert", ptu, "/nonexistent/a.ptu"}, 3), HasSubstr("/nonexistent"));
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.ptu")));
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.ptu.part")));
  const std::string there = folder.write("there.ptu", "something");
  said({"convert", ptu, there}, 2);
  EXPECT_EQ(test::file_text(there), "something");
  EXPECT_EQ(run_program({"convert", ptu, there, "--force"}).exit_code, 0);
  EXPECT_EQ(test::read_back(there), test::read_back(ptu));
}

// The same stream, by the instrument's own program and re-encoded with its syncs as sync records.
TEST_F(ConvertProgram, ARealQutagFileIsItsTwin) {
  const auto real = test::real_recording_path("qutag_sync.qutag");
  if (!std::filesystem::exists(real)) GTEST_SKIP() << real << " is not there";
  const std::string converted = folder.path("a.ptu");
  ASSERT_EQ(run_program({"convert", real.string(), converted}).exit_code, 0);
  const std::vector<Tag> tags = test::read_back(converted);
  std::vector<Tag> twin = test::read_back(test::real_recording_path("qutag_sync_t2.ptu").string());
  ASSERT_EQ(tags.size(), 211'773U);
  const std::int64_t shift_ps = tags.front().time_ps - twin.front().time_ps;
  for (Tag& tag : twin) {
    tag.time_ps += shift_ps;
    if (tag.kind == TagKind::sync) tag = photon_tag(tag.time_ps, 5);
  }
  EXPECT_EQ(tags, twin);
}

}  // namespace
}  // namespace splid
