#include "protocol/recording_format.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/made_recording.hpp"
#include "tests/support/other_recordings.hpp"
#include "tests/support/t3_recording.hpp"

namespace splid {
namespace {

using test::hydra_harp_recording;
using test::pico_harp_recording;
using test::qutag_recording;
using test::spc_photon;
using test::spc_recording;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

RecordingHeader header_of(const std::string& file, const std::string& name = {},
                          std::string_view settings = {}) {
  return parse_recording_header(format_of(file, name).value(), bytes_of(file), true, settings)
      .value();
}

std::vector<Tag> tags_of(RecordDecoder& decoder, std::span<const std::byte> records,
                         std::size_t room = 1000) {
  std::vector<Tag> all;
  std::vector<Tag> block(room);
  for (;;) {
    const auto done = decoder.decode(records, block);
    all.insert(all.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(done.tags));
    records = records.subspan(done.bytes);
    if (done.tags == 0) return all;
  }
}

// All tags of a file, by blocks of `room` tags.
std::vector<Tag> read(const std::string& file, const std::string& name,
                      std::string_view settings = {}, std::size_t room = 1000) {
  const RecordingHeader header = header_of(file, name, settings);
  const auto decoder = make_decoder(header);
  return tags_of(*decoder, bytes_of(file).subspan(header.header_bytes), room);
}

std::string error_of(const std::string& file, const std::string& name = {},
                     std::string_view settings = {}) {
  return test::error_text([&] { (void)header_of(file, name, settings); });
}

TEST(RecordingFormat, IsToldByTheFirstBytesOrByTheName) {
  EXPECT_EQ(format_of("PQTTTR", "a.spc"), RecordingFormat::ptu);
  EXPECT_EQ(format_of("PicoHarp 300", ""), RecordingFormat::pico_harp);
  EXPECT_EQ(format_of("HydraHarp 400", ""), RecordingFormat::hydra_harp);
  EXPECT_EQ(format_of("\1\2", "folder/A.QUTAG"), RecordingFormat::qutag);
  EXPECT_EQ(format_of("\1\2", "a.spc"), RecordingFormat::becker_hickl);
  EXPECT_EQ(format_of("PQHISTO", "a.phu"), std::nullopt);
  EXPECT_EQ(format_of("", ""), std::nullopt);
  for (const std::string_view ending : recording_endings()) {
    EXPECT_TRUE(is_named_as_recording("a" + std::string(ending)));
  }
  EXPECT_FALSE(is_named_as_recording("a.phu"));
}

TEST(RecordingFormat, QutagsEventsArePhotonsOfTheirChannels) {
  const std::string file =
      qutag_recording({{-5, 1}, {340'000'000'000'000'007, 5}, {8, 63}, {9, 64}, {10, -1}, {11, 0}});
  for (const std::size_t room : {1U, 2U, 1000U}) {
    EXPECT_THAT(read(file, "a.qutag", {}, room),
                ElementsAre(photon_tag(-5, 1), photon_tag(340'000'000'000'000'007, 5),
                            photon_tag(8, 63), photon_tag(11, 0)));
  }
  const auto decoder = make_decoder(header_of(file, "a.qutag"));
  tags_of(*decoder, bytes_of(file).subspan(40));
  EXPECT_EQ(decoder->unknown_records(), 2U);
  EXPECT_EQ(decoder->reached_ps(), 11);
  EXPECT_THAT(error_of(std::string(39, '\1'), "a.qutag"), HasSubstr("byte 39"));
}

TEST(RecordingFormat, PicoHarpInT2ModeHasTicksOf4Ps) {
  const std::string file =
      pico_harp_recording(2, {1U << 28U | 5U, 0xF0000000U, 0U << 28U | 1U, 0xF0000002U});
  const RecordingHeader header = header_of(file);
  EXPECT_EQ(header.record_count, 4U);
  EXPECT_EQ(header.record_type, RecordType::pico_harp);
  EXPECT_EQ(header.text("HW_Type"), "PicoHarp 300");
  EXPECT_EQ(header.text("FileTime"), "23/11/26 10:11:12");
  EXPECT_EQ(header.text("File_Comment"), "a comment");
  EXPECT_EQ(header.integer("MeasDesc_AcquisitionTime"), 1500);
  EXPECT_FALSE(header.created_unix_s) << "a local time is no time of day";
  constexpr std::int64_t wrap = 210'698'240;
  EXPECT_THAT(read(file, ""), ElementsAre(photon_tag(20, 1), photon_tag(4 * (wrap + 1), 0),
                                          marker_tag(4 * wrap, 2)));
}

TEST(RecordingFormat, PicoHarpInT3ModeCountsSyncs) {
  const std::string file = pico_harp_recording(3, {2U << 28U | 100U << 16U | 3U}, 7);
  const RecordingHeader header = header_of(file);
  EXPECT_TRUE(header.is_t3);
  EXPECT_EQ(header.header_bytes, 728U + 28);
  EXPECT_DOUBLE_EQ(header.sync_period_s, 1e-5);
  EXPECT_DOUBLE_EQ(header.resolution_s, 8e-12);  // written as a float
  EXPECT_EQ(header.time_steps, 4096U);
  EXPECT_EQ(header.integer("HWSync_Divider"), 4);
  EXPECT_THAT(read(file, ""), ElementsAre(sync_tag(30'000'000), photon_tag(30'000'800, 2)));
}

// An overflow of version 1.0 has no count, and its clock wraps elsewhere.
TEST(RecordingFormat, HydraHarpHasTwoVersions) {
  const std::vector<std::uint32_t> t2 = {test::overflow_record(2), test::photon_record(1, 7)};
  EXPECT_THAT(read(hydra_harp_recording(2, "2.0", t2), ""),
              ElementsAre(photon_tag(2 * 33'554'432 + 7, 1)));
  EXPECT_THAT(read(hydra_harp_recording(2, "1.0", t2), ""),
              ElementsAre(photon_tag(33'552'000 + 7, 1)));
  const std::vector<std::uint32_t> t3 = {test::t3_overflow(2), test::t3_photon(1, 10, 3)};
  const RecordingHeader header = header_of(hydra_harp_recording(3, "2.0", t3));
  EXPECT_DOUBLE_EQ(header.sync_period_s, 5e-6);
  EXPECT_EQ(header.time_steps, 32'768U);
  EXPECT_THAT(read(hydra_harp_recording(3, "2.0", t3), ""),
              ElementsAre(sync_tag(2051 * 5'000'000LL), photon_tag(2051 * 5'000'000LL + 160, 1)));
  EXPECT_THAT(read(hydra_harp_recording(3, "1.0", t3), ""),
              ElementsAre(sync_tag(1027 * 5'000'000LL), photon_tag(1027 * 5'000'000LL + 160, 1)));
}

TEST(RecordingFormat, OldHeadersThatMakeNoSenseAreRefusedByTheirPlace) {
  EXPECT_THAT(error_of(pico_harp_recording(0, {})), HasSubstr("byte 348"));
  EXPECT_THAT(error_of(hydra_harp_recording(0, "2.0", {})), HasSubstr("Record again in T2"));
  EXPECT_THAT(error_of(hydra_harp_recording(2, "3.0", {})), HasSubstr("format version 3.0"));
  const auto broken = [](std::string file, std::size_t at, std::uint32_t value) {
    return error_of(test::OldHeader(0).text(0, "").with({}) +
                    file.replace(at, 4, test::OldHeader(4).integer(0, value).with({})));
  };
  EXPECT_THAT(broken(pico_harp_recording(3, {}), 704, 0), HasSubstr("a sync rate of 0 Hz"));
  EXPECT_THAT(broken(pico_harp_recording(2, {}), 16, 0x00302E31), HasSubstr("format version 1.0"));
  EXPECT_THAT(broken(pico_harp_recording(2, {}), 332, 64), HasSubstr("records of 64 bits"));
  EXPECT_THAT(broken(pico_harp_recording(2, {}), 724, 0xFFFFFFFF), HasSubstr("byte 724"));
  EXPECT_THAT(broken(pico_harp_recording(3, {}), 584, 0x7FC00000), HasSubstr("the resolution"));
  EXPECT_THAT(broken(hydra_harp_recording(2, "2.0", {}), 664, 1000), HasSubstr("1000 inputs"));
  for (const int mode : {2, 3}) {
    EXPECT_THAT(broken(hydra_harp_recording(mode, "1.0", {}), 356, 0x7FF00000),
                AllOf(HasSubstr("byte 352"), HasSubstr("the resolution")));
  }
}

// A PTU whose one photon, of input 1, comes 6 steps late.
std::string ptu_of(RecordType type, double step_ps) {
  const bool is_pico_harp = type == RecordType::pico_harp || type == RecordType::pico_harp_t3;
  const unsigned input_at = is_pico_harp ? 28 : 25;
  const unsigned time_at = !is_t3(type) ? 0 : is_pico_harp ? 16 : 10;
  test::T3Recording file;
  file.type = type;
  file.sync_period_s = is_t3(type) ? 5e-6 : step_ps * 1e-12;
  file.resolution_s = step_ps * 1e-12;
  file.records = {1U << input_at | 6U << time_at};
  std::string bytes = file.bytes();
  test::set_ptu_tag(bytes, "Measurement_Mode", std::int64_t{is_t3(type) ? 3 : 2});
  return bytes;
}

TEST(RecordingFormat, EveryFormatAndVersionHasTheStepsOfItsHeader) {
  using Make = std::function<std::string(double step_ps)>;
  std::vector<std::pair<std::string, Make>> formats;
  for (const auto type :
       {0x00010203U, 0x00010204U, 0x00010205U, 0x00010206U, 0x00010207U, 0x01010204U, 0x00010303U,
        0x00010304U, 0x00010305U, 0x00010306U, 0x00010307U, 0x01010304U}) {
    formats.emplace_back("PTU " + std::to_string(type), [type](double step_ps) {
      return ptu_of(static_cast<RecordType>(type), step_ps);
    });
  }
  for (const char* version : {"1.0", "2.0"}) {
    formats.emplace_back(std::string("ht2 ") + version, [version](double step_ps) {
      return hydra_harp_recording(2, version, {test::photon_record(1, 6)}, step_ps);
    });
    formats.emplace_back(std::string("ht3 ") + version, [version](double step_ps) {
      return hydra_harp_recording(3, version, {test::t3_photon(1, 6, 0)}, step_ps);
    });
  }
  formats.emplace_back("pt3", [](double step_ps) {
    return pico_harp_recording(3, {1U << 28U | 6U << 16U}, 0, static_cast<float>(step_ps));
  });
  for (const auto& [name, make] : formats) {
    for (const double step_ps : {0.5, 3.0}) {
      const std::string file = make(step_ps);
      EXPECT_NEAR(header_of(file).resolution_s / (step_ps * 1e-12), 1, 1e-12) << name;
      const auto tags = read(file, "");
      ASSERT_FALSE(tags.empty()) << name;
      EXPECT_EQ(tags.back(), photon_tag(static_cast<std::int64_t>(6 * step_ps), 1)) << name;
      EXPECT_EQ(tags.size(), header_of(file).is_t3 ? 2U : 1U) << name;
    }
  }
}

// Its settings are beside it.
TEST(RecordingFormat, BeckerHicklHasTheStepsOfItsSettings) {
  const std::string file = spc_recording(100, {spc_photon(0, 4095 - 6, 1)});
  for (const int gain : {2, 4}) {
    const std::string settings =
        "#SP [SP_TAC_R,F,6.5536e-08]\n#SP [SP_TAC_G,I," + std::to_string(gain) + "]\n";
    EXPECT_THAT(read(file, "a.spc", settings),
                ElementsAre(sync_tag(0), photon_tag(6 * 16 / gain, 1)));
  }
}

// Their headers have the steps of histograms, which T2 knows nothing of.
TEST(RecordingFormat, PicoHarpsInT2ModeHaveTheirOwnStepsAndSaySo) {
  const std::vector<std::uint32_t> records = {1U << 28U | 6U};
  for (const float step_ps : {4.0F, 8.0F}) {
    const std::string file = pico_harp_recording(2, records, 0, step_ps);
    EXPECT_THAT(read(file, ""), ElementsAre(photon_tag(24, 1)));
    EXPECT_THAT(header_of(file).warning, step_ps == 4 ? HasSubstr("") : HasSubstr("of 0.008 ns"));
    EXPECT_EQ(header_of(file).warning.empty(), step_ps == 4);
  }
}

// As a recorder writes it that counts in 32 bits.
TEST(RecordingFormat, ANegativeRecordCountIsNone) {
  const auto replaced = [](std::string file, std::size_t at, std::string_view bytes) {
    return header_of(file.replace(at, bytes.size(), bytes)).record_count;
  };
  constexpr std::string_view negative = "\x8f\x26\xff\xff\xff\xff\xff\xff";
  const std::size_t count_at = 696 + 2 * 20 + 16;
  for (const int mode : {2, 3}) {
    EXPECT_EQ(header_of(pico_harp_recording(mode, {5})).record_count, 1U);
    EXPECT_EQ(replaced(pico_harp_recording(mode, {5}), 720, negative.substr(0, 4)), 0U);
    EXPECT_EQ(header_of(hydra_harp_recording(mode, "2.0", {5})).record_count, 1U);
    EXPECT_EQ(replaced(hydra_harp_recording(mode, "2.0", {5}), count_at, negative), 0U);
  }
}

TEST(RecordingFormat, EveryShorterHeaderNeedsMoreOrIsCut) {
  const std::string pico = pico_harp_recording(2, {}, 3);
  const std::string hydra = hydra_harp_recording(2, "2.0", {});
  const std::string qutag = qutag_recording({});
  for (const auto& [file, name] : {std::pair(pico, ""), {hydra, ""}, {qutag, "a.qutag"}}) {
    const RecordingFormat format = format_of(file, name).value();
    for (std::size_t length = 0; length < file.size(); ++length) {
      const auto prefix = bytes_of(file).first(length);
      EXPECT_FALSE(parse_recording_header(format, prefix, false)) << length;
      EXPECT_THROW((void)parse_recording_header(format, prefix, true), Error) << length;
    }
    EXPECT_TRUE(parse_recording_header(format, bytes_of(file), false));
  }
}

TEST(RecordingFormat, BeckerHicklCountsItsMacroTimeAsSyncs) {
  const std::string file = spc_recording(
      100, {spc_photon(3, 4095, 2), spc_photon(3, 4000, 1),
            test::spc_overflow | spc_photon(1, 0, 15), test::spc_overflow | test::spc_invalid | 3U,
            test::spc_marker | test::spc_invalid | 4U << 12U | 5U,
            test::spc_marker | test::spc_invalid, test::spc_invalid | spc_photon(6, 12, 3)});
  const RecordingHeader header = header_of(file, "a.spc", test::spc_settings);
  EXPECT_TRUE(header.is_t3);
  EXPECT_DOUBLE_EQ(header.sync_period_s, 1e-8);
  EXPECT_DOUBLE_EQ(header.resolution_s, 8e-12);
  constexpr std::int64_t sync_ps = 10'000;
  constexpr std::int64_t fifth = 4 * 4096 * sync_ps;  // after four overflows
  for (const std::size_t room : {1U, 3U, 1000U}) {
    EXPECT_THAT(
        read(file, "a.spc", test::spc_settings, room),
        ElementsAre(sync_tag(3 * sync_ps), photon_tag(3 * sync_ps, 2),
                    photon_tag(3 * sync_ps + 95 * 8, 1), sync_tag(4097 * sync_ps),
                    photon_tag(4097 * sync_ps + 4095 * 8, 15), sync_tag(fifth + 5 * sync_ps),
                    marker_tag(fifth + 5 * sync_ps, 4), sync_tag(fifth + 6 * sync_ps),
                    Tag{fifth + 6 * sync_ps, 1, TagKind::missed, {3, 0, 0}}));
  }
  const auto decoder = make_decoder(header);
  tags_of(*decoder, bytes_of(file).subspan(4));
  EXPECT_EQ(decoder->unknown_records(), 1U);
  EXPECT_EQ(decoder->overflow_records(), 1U);
  EXPECT_EQ(decoder->saturated_photons(), 1U);
}

TEST(RecordingFormat, BeckerHicklTellsOfLostPhotons) {
  const std::string file =
      spc_recording(100, {spc_photon(3, 4095, 2), test::spc_gap | spc_photon(9, 4095, 2)});
  EXPECT_THAT(
      read(file, "a.spc", test::spc_settings),
      ElementsAre(sync_tag(30'000), photon_tag(30'000, 2), Tag{30'000, 0, TagKind::loss_begin, {}},
                  Tag{90'000, -1, TagKind::loss_end, {}}, sync_tag(90'000), photon_tag(90'000, 2)));
}

// The photon before came later after the same sync.
TEST(RecordingFormat, BeckerHicklsLossesEndWhereTheyBeginAtTheEarliest) {
  const std::string file =
      spc_recording(100, {spc_photon(3, 4000, 2), test::spc_gap | spc_photon(3, 4095, 2)});
  EXPECT_THAT(
      read(file, "a.spc", test::spc_settings),
      ElementsAre(sync_tag(30'000), photon_tag(30'760, 2), Tag{30'760, 0, TagKind::loss_begin, {}},
                  Tag{30'760, -1, TagKind::loss_end, {}}, photon_tag(30'000, 2)));
}

TEST(RecordingFormat, BeckerHicklNeedsItsSettings) {
  const std::string file = spc_recording(100, {});
  EXPECT_THAT(error_of(file, "a.spc"), HasSubstr("same name with .set"));
  EXPECT_THAT(error_of(file, "a.spc", "#SP [SP_TAC_R,F,x]"), HasSubstr("save the settings"));
  EXPECT_THAT(error_of(file, "a.spc", "#SP [SP_TAC_R,F,1e9]\n#SP [SP_TAC_G,I,1]"),
              HasSubstr("1e-15 to 1e-3 s"));
  EXPECT_THAT(error_of(spc_recording(0, {}), "a.spc", test::spc_settings), HasSubstr("0 ns"));
  EXPECT_THAT(error_of("abc", "a.spc", test::spc_settings), HasSubstr("3 bytes"));
}

// Whatever the bytes, pieces give the same tags, and nothing is read past the end.
TEST(RecordingFormat, DamagedRecordsAreDecodedAlikeInPieces) {
  std::mt19937_64 random(7);
  for (const auto& [start, name] : {std::pair(qutag_recording({}), "a.qutag"),
                                    {spc_recording(100, {}), "a.spc"},
                                    {pico_harp_recording(2, {}), ""},
                                    {pico_harp_recording(3, {}), ""},
                                    {hydra_harp_recording(2, "1.0", {}), ""},
                                    {hydra_harp_recording(3, "2.0", {}), ""}}) {
    std::string file = start;
    for (int i = 0; i < 4001; ++i) file += static_cast<char>(random());
    const auto whole = read(file, name, test::spc_settings, 100'000);
    EXPECT_FALSE(whole.empty());
    EXPECT_EQ(read(file, name, test::spc_settings, 7), whole);
  }
}

// Where there is room for two tags alone, each record is decoded by itself; else photons in a row
// are decoded together.
TEST(RecordingFormat, RunsOfPhotonsAreDecodedAsOneByOne) {
  std::mt19937 random(7);
  struct Case {
    std::string start;
    std::string name;
    std::uint32_t photons;  // bits that a photon may have
    std::uint32_t others;   // bits of a record that may be anything
  };
  for (const auto& [start, name, photons, others] :
       {Case{spc_recording(100, {}), "a.spc", 0x4FFFFFFFU, 0xFFFFFFFFU},
        {pico_harp_recording(3, {}), "", 0x7FFFFFFFU, 0xFFFFFFFFU},
        {pico_harp_recording(3, {}), "", 0x7FFF0003U, 0xF0000003U},
        {hydra_harp_recording(3, "1.0", {}), "", 0x7FFFFFFFU, 0xFE0003FFU},
        {hydra_harp_recording(3, "2.0", {}), "", 0x7FFFFC01U, 0xFFFFFFFFU}}) {
    std::string file = start;
    for (int i = 0; i < 20'000; ++i) {
      const auto record = static_cast<std::uint32_t>(random());
      test::append_little_endian(file, record & (random() % 40 == 0 ? others : photons), 4);
    }
    const auto alone = read(file, name, test::spc_settings, 2);
    EXPECT_GT(alone.size(), 18'000U);
    EXPECT_EQ(read(file, name, test::spc_settings, 100'000), alone) << name;
  }
}

}  // namespace
}  // namespace splid
