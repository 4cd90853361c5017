#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/replay/recording_info.hpp"
#include "tests/support/hdf5_maker.hpp"
#include "tests/support/program.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/temp_folder.hpp"

// Photon-HDF5 files through the built program, which reads them by a process of its own.

namespace splid::recording {
namespace {

using test::add_photon_facts;
using test::add_photons;
using test::ArrayForm;
using test::Hdf5Maker;
using test::PhotonArrays;
using test::write_photon_hdf5;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Times that rise by up to a microsecond, on inputs 0 and 1.
PhotonArrays many_photons(std::size_t count) {
  std::mt19937 generator(1);
  PhotonArrays arrays;
  std::int64_t time_ps = 0;
  for (std::size_t i = 0; i < count; ++i) {
    arrays.timestamps.push_back(time_ps += 1 + static_cast<std::int64_t>(generator() % 1'000'000));
    arrays.detectors.push_back(static_cast<std::uint8_t>(generator() % 2));
  }
  return arrays;
}

std::vector<Tag> photons_of(const PhotonArrays& arrays) {
  std::vector<Tag> tags;
  for (std::size_t i = 0; i < arrays.timestamps.size(); ++i) {
    tags.push_back(photon_tag(arrays.timestamps[i], arrays.detectors[i]));
  }
  return tags;
}

class PhotonHdf5Program : public ::testing::Test {
 protected:
  [[nodiscard]] std::string file() const { return folder_.path("made.hdf5"); }
  [[nodiscard]] std::string ptu() const { return folder_.path("converted.ptu"); }

  // The tags of the PTU that the file becomes; none where it is refused, and then nothing is left.
  std::vector<Tag> converted(const std::string& name) {
    std::filesystem::remove(ptu());
    const auto result = test::run_program({"convert", name, ptu()});
    said_ = result.err;
    exit_code_ = result.exit_code;
    EXPECT_FALSE(std::filesystem::exists(ptu() + ".part"));
    EXPECT_EQ(std::filesystem::exists(ptu()), exit_code_ == 0) << said_;
    return exit_code_ == 0 ? test::read_back(ptu()) : std::vector<Tag>{};
  }

  std::vector<Tag> converted(const PhotonArrays& arrays) {
    write_photon_hdf5(file(), arrays);
    return converted(file());
  }

  template <class Made>
  std::string refusal_of(const Made& made) {
    converted(made);
    EXPECT_EQ(exit_code_, 4) << said_;
    return said_;
  }

  test::TempFolder folder_;
  std::string said_;
  int exit_code_ = -1;
};

TEST_F(PhotonHdf5Program, TimestampsAreTimesInT2) {
  PhotonArrays arrays;
  arrays.timestamps = {3, 40, 41, 3'400'000'000'000'007};
  arrays.detectors = {0, 62, 63, 5};
  EXPECT_THAT(converted(arrays), ElementsAre(photon_tag(3, 0), photon_tag(40, 62),
                                             photon_tag(3'400'000'000'000'007, 5)));
  EXPECT_THAT(said_, AllOf(HasSubstr("1 photons are left out, since their detectors are not from"),
                           HasSubstr("T2 mode")));
  const RecordingHeader header = scan_recording(ptu()).header;
  EXPECT_FALSE(header.is_t3);
  EXPECT_EQ(header.text("HW_Type"), "Photon-HDF5");
}

TEST_F(PhotonHdf5Program, UnitsOfATimestampAreWholeWhereTheFileMeansSo) {
  PhotonArrays arrays;
  arrays.timestamps = {1'000'000'000'001, 1'000'000'000'003};
  // None of these is a whole number of ps as a double.
  for (const auto& [unit_s, unit_ps] : {std::pair{12.5e-9, 12'500}, {3e-12, 3}, {7e-12, 7}}) {
    arrays.unit_s = unit_s;
    EXPECT_THAT(converted(arrays), ElementsAre(photon_tag(1'000'000'000'001 * unit_ps, 0),
                                               photon_tag(1'000'000'000'003 * unit_ps, 0)));
  }
}

TEST_F(PhotonHdf5Program, CoarseTimesAreSaid) {
  PhotonArrays arrays;
  arrays.timestamps = {1};
  converted(arrays);
  EXPECT_THAT(said_, Not(HasSubstr("steps of")));
  arrays.unit_s = 12.5e-9;
  converted(arrays);
  EXPECT_THAT(said_, HasSubstr(file() + ": its times have steps of 12.5 ns"));
}

TEST_F(PhotonHdf5Program, WithNanotimesTimestampsCountSyncsInT3) {
  PhotonArrays arrays;
  arrays.timestamps = {2, 2, 7, 1'000'000};
  arrays.detectors = {0, 1, 0, 70};
  arrays.nanotimes = {5, 100, 0, 1};
  arrays.unit_s = 5e-6;
  arrays.laser_hz = 200'000;
  EXPECT_THAT(converted(arrays), ElementsAre(sync_tag(10'000'000), photon_tag(10'000'080, 0),
                                             photon_tag(10'001'600, 1), sync_tag(35'000'000),
                                             photon_tag(35'000'000, 0)));
  const RecordingHeader header = scan_recording(ptu()).header;
  EXPECT_TRUE(header.is_t3);
  EXPECT_NEAR(header.sync_period_s, 5e-6, 1e-20);
  EXPECT_EQ(header.resolution_s, 16e-12);
}

TEST_F(PhotonHdf5Program, TimestampsThatCountNoLaserPulsesAreRefused) {
  PhotonArrays arrays;
  arrays.timestamps = {2};
  arrays.nanotimes = {5};
  arrays.unit_s = 50e-9;
  EXPECT_THAT(refusal_of(arrays), AllOf(HasSubstr("no /photon_data/measurement_specs/laser_rep"),
                                        HasSubstr("add that number with h5py")));
  arrays.laser_hz = 19e6;
  EXPECT_THAT(refusal_of(arrays), HasSubstr("they count another clock than the laser's"));
  // One sync in four pulses.
  arrays.laser_hz = 80e6;
  EXPECT_THAT(converted(arrays), ElementsAre(sync_tag(100'000), photon_tag(100'080, 0)));
}

PhotonArrays counted_photons() {
  PhotonArrays arrays;
  arrays.timestamps = {2, 2, 7, 9};
  arrays.nanotimes = {5, 100, 0, 1};
  arrays.laser_hz = 1 / (arrays.unit_s = 5e-6);
  return arrays;
}

TEST_F(PhotonHdf5Program, NanotimesBeyondARecordGetCoarserSteps) {
  PhotonArrays arrays = counted_photons();
  arrays.step_s = 1e-12;
  arrays.bins = 65'536;
  arrays.nanotimes = {32'766, 0, 7, 8};
  const auto times_since = [&] {
    std::vector<std::int64_t> times_ps;
    for (const Tag& tag : converted(arrays)) {
      if (tag.kind == TagKind::photon) times_ps.push_back(tag.time_ps % 5'000'000);
    }
    return times_ps;
  };
  EXPECT_THAT(times_since(), ElementsAre(32'766, 0, 7, 8));
  EXPECT_THAT(said_, Not(HasSubstr("nanotimes")));
  arrays.nanotimes[0] = 32'767;
  EXPECT_THAT(times_since(), ElementsAre(32'768, 0, 8, 8));
  EXPECT_THAT(said_, HasSubstr("/photon_data/nanotimes goes up to 32767, and a T3 record of a PTU "
                               "to 32766: photons get steps of 2 ps instead of 1 ps"));
  arrays.nanotimes[0] = 65'535;
  EXPECT_THAT(times_since(), ElementsAre(65'535, 0, 6, 9));
  EXPECT_THAT(said_, HasSubstr("T3 mode, 0 tags lost"));
  EXPECT_EQ(scan_recording(ptu()).header.resolution_s, 3e-12);
}

// Those of a file with these rows, in T3.
TEST_F(PhotonHdf5Program, ValuesThatNoTagHasAreNamedWithTheirRow) {
  const auto refused = [this](const std::vector<std::int64_t>& timestamps,
                              const std::vector<std::int64_t>& nanotimes) {
    {
      Hdf5Maker maker(file());
      add_photon_facts(maker);
      PhotonArrays arrays = counted_photons();
      arrays.timestamps = timestamps;
      arrays.nanotimes.clear();
      add_photons(maker, arrays);
      if (!nanotimes.empty()) maker.array("photon_data/nanotimes", nanotimes);
      maker.number("photon_data/nanotimes_specs/tcspc_unit", 16e-12);
    }
    const std::string said = refusal_of(file());
    const std::string error = said.substr(said.find("splid: error: "));
    EXPECT_EQ(test::run_program({"check", file()}).err, error);
    return said;
  };
  EXPECT_THAT(refused({1, 2, 3}, {0, 5, -1}),
              HasSubstr(file() + ": /photon_data/nanotimes, row 2, is -1; it must be from 0 to"));
  EXPECT_THAT(refused({1, 2, 3}, {0, 4'294'967'296, 1}),
              HasSubstr("/photon_data/nanotimes, row 1, is 4294967296; it must be from 0 to"));
  EXPECT_THAT(refused({1, -2, 3}, {0, 5, 1}),
              HasSubstr("/photon_data/timestamps, row 1, is -2; it must be from 0 to"));
  EXPECT_THAT(refused({1, 2, 1'900'000'000'000}, {0, 5, 1}),
              HasSubstr("/photon_data/timestamps, row 2, is 1900000000000; it must be from 0 to"));
  EXPECT_THAT(refused({1, 9, 8}, {0, 5, 1}),
              HasSubstr("/photon_data/timestamps, row 2, is 8, and a row before it is 9: its "
                        "photons are not sorted by time, to 1 us; sort the rows"));
}

TEST_F(PhotonHdf5Program, PhotonsAreSortedWithinAMicrosecondAndNoFurther) {
  PhotonArrays arrays = many_photons(100'000);
  arrays.timestamps.insert(arrays.timestamps.begin() + 70'000, arrays.timestamps[69'999]);
  arrays.detectors.insert(arrays.detectors.begin() + 70'000, 1);
  std::vector<Tag> expected = photons_of(arrays);
  arrays.timestamps[70'000] -= 1'000'000;
  expected[70'000].time_ps -= 1'000'000;
  std::stable_sort(expected.begin(), expected.end(),
                   [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  EXPECT_TRUE(converted(arrays) == expected);
  --arrays.timestamps[70'000];
  EXPECT_THAT(refusal_of(arrays), HasSubstr("/photon_data/timestamps, row 70000, is "));
}

TEST_F(PhotonHdf5Program, AnArrayWhereANumberBelongsIsSaid) {
  for (const char* path :
       {"photon_data/measurement_specs/laser_repetition_rate",
        "photon_data/timestamps_specs/timestamps_unit", "photon_data/nanotimes_specs/tcspc_unit",
        "photon_data/nanotimes_specs/tcspc_num_bins"}) {
    PhotonArrays arrays = counted_photons();
    write_photon_hdf5(file(), arrays);
    {
      const hid_t made = H5Fopen(file().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
      H5Ldelete(made, path, H5P_DEFAULT);
      const hsize_t two = 2;
      const hid_t space = H5Screate_simple(1, &two, nullptr);
      H5Dclose(
          H5Dcreate2(made, path, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
      H5Sclose(space);
      H5Fclose(made);
    }
    EXPECT_THAT(refusal_of(file()), HasSubstr(file() + ": /" + path +
                                              " is an array of 2 values, and the format has "
                                              "one number there"));
  }
}

TEST_F(PhotonHdf5Program, AnyLayoutGivesTheSameTags) {
  PhotonArrays arrays = many_photons(200'001);
  const std::vector<Tag> expected = photons_of(arrays);
  for (const ArrayForm& form :
       {ArrayForm{}, ArrayForm{5000, -1, false, false}, ArrayForm{5000, 6, false, true},
        ArrayForm{70'000, -1, true, false}, ArrayForm::packed(999), ArrayForm::packed(200'001)}) {
    arrays.form = form;
    EXPECT_TRUE(converted(arrays) == expected) << form.chunk << " " << form.deflate;
  }
  arrays.form = ArrayForm::packed(999);
  write_photon_hdf5(file(), arrays, true);
  EXPECT_TRUE(converted(file()) == expected) << "of the newest form";
}

TEST_F(PhotonHdf5Program, IntegersOfAnyTypeAndOrderAreRead) {
  {
    Hdf5Maker maker(file());
    add_photon_facts(maker);
    maker.number("photon_data/timestamps_specs/timestamps_unit", 1e-12);
    const std::vector<std::int64_t> times = {1, 2, 1'000'000'000};
    const std::vector<std::int64_t> inputs = {-1, 7, 60};
    maker.write("photon_data/timestamps", H5T_STD_U32BE, H5T_NATIVE_INT64, {3}, times.data(), {});
    maker.write("photon_data/detectors", H5T_STD_I16BE, H5T_NATIVE_INT64, {3}, inputs.data(),
                ArrayForm::packed(2));
  }
  EXPECT_THAT(converted(file()), ElementsAre(photon_tag(2, 7), photon_tag(1'000'000'000, 60)));
}

TEST_F(PhotonHdf5Program, TextsOfH5pyAreRead) {
  {
    Hdf5Maker maker(file());
    maker.attribute("/", "format_name", "Photon-HDF5", true);
    maker.text("description", "first", true);
    PhotonArrays arrays;
    arrays.timestamps = {4};
    add_photons(maker, arrays);
  }
  EXPECT_THAT(converted(file()), ElementsAre(photon_tag(4, 0)));
}

TEST_F(PhotonHdf5Program, NoPhotonsAreNoTags) {
  EXPECT_THAT(converted(PhotonArrays{}), IsEmpty());
  EXPECT_EQ(exit_code_, 0) << said_;
}

TEST_F(PhotonHdf5Program, OfSeveralSpotsTheFirstIsRead) {
  {
    Hdf5Maker maker(file());
    add_photon_facts(maker);
    for (const char* group : {"photon_data0", "photon_data1", "photon_data2"}) {
      PhotonArrays arrays;
      arrays.timestamps = {group[11]};
      arrays.group = group;
      add_photons(maker, arrays);
    }
  }
  EXPECT_THAT(converted(file()), ElementsAre(photon_tag('0', 0)));
  EXPECT_THAT(said_, AllOf(HasSubstr("several spots"), HasSubstr("/photon_data0 is read"),
                           HasSubstr("rename its group")));
}

TEST_F(PhotonHdf5Program, WhatIsMissingIsNamed) {
  {
    Hdf5Maker maker(file());
    add_photon_facts(maker);
  }
  EXPECT_THAT(refusal_of(file()), HasSubstr("has no /photon_data,"));
  {
    Hdf5Maker maker(file());
    add_photon_facts(maker);
    maker.array<std::uint8_t>("photon_data/detectors", {1});
  }
  EXPECT_THAT(refusal_of(file()), HasSubstr("has no /photon_data/timestamps"));
  {
    Hdf5Maker maker(file());
    add_photon_facts(maker);
    maker.array<std::int64_t>("photon_data/timestamps", {1});
  }
  EXPECT_THAT(refusal_of(file()),
              HasSubstr("has no number /photon_data/timestamps_specs/timestamps_unit"));
  PhotonArrays arrays;
  arrays.timestamps = {1, 2, 3};
  arrays.detectors = {1, 2};
  EXPECT_THAT(refusal_of(arrays), HasSubstr("/photon_data/detectors has 2 values, and"));
  arrays.detectors.clear();
  for (const double unit_s : {0.0, 1e-13, 2.0, -1.0, 0.5}) {
    arrays.unit_s = unit_s;
    EXPECT_THAT(refusal_of(arrays), HasSubstr("timestamps_unit is ")) << unit_s;
  }
}

TEST_F(PhotonHdf5Program, OtherTypesAreRefused) {
  const auto make = [this](hid_t type, const std::vector<hsize_t>& extent) {
    Hdf5Maker maker(file());
    add_photon_facts(maker);
    maker.number("photon_data/timestamps_specs/timestamps_unit", 1e-12);
    const std::vector<std::int64_t> values(100, 1);
    maker.write("photon_data/timestamps", type, H5T_NATIVE_INT64, extent, values.data(), {});
  };
  make(H5T_STD_I64LE, {4});
  EXPECT_EQ(converted(file()).size(), 4U);
  for (const auto& [type, extent] : {std::pair{H5T_IEEE_F64LE, std::vector<hsize_t>{4}},
                                     {H5T_STD_I64LE, {4, 2}},
                                     {H5T_STD_I64LE, {}}}) {
    make(type, extent);
    EXPECT_THAT(refusal_of(file()),
                HasSubstr("/photon_data/timestamps is no row of whole numbers"));
  }
}

TEST_F(PhotonHdf5Program, ADamagedChunkIsNamedWithItsPlace) {
  PhotonArrays arrays = many_photons(100'000);
  arrays.form = {10'000, 1, false, false};
  {
    Hdf5Maker maker(file());
    add_photon_facts(maker);
    add_photons(maker, arrays);
    maker.replace_chunk("photon_data/detectors", 80'000, "nonsense");
  }
  EXPECT_THAT(refusal_of(file()), AllOf(HasSubstr(file()), HasSubstr("/photon_data/detectors"),
                                        HasSubstr("cannot be read from value 65536 on")));
}

TEST_F(PhotonHdf5Program, OtherHdf5FilesAreNamed) {
  { const Hdf5Maker maker(file()); }
  EXPECT_THAT(refusal_of(file()),
              AllOf(HasSubstr(file()), HasSubstr("is an HDF5 file, but not Photon-HDF5"),
                    HasSubstr("make a PTU of that")));
  {
    Hdf5Maker maker(file());
    maker.array<std::int64_t>("frames", {1});
    maker.attribute("frames", "schema", "splid.frame", true);
  }
  EXPECT_THAT(refusal_of(file()), HasSubstr("is a table of frames that splid wrote"));
}

TEST_F(PhotonHdf5Program, ANameThatLooksLikeAnOptionIsAName) {
  PhotonArrays arrays;
  arrays.timestamps = {7};
  const std::string made = folder_.path("--help");
  write_photon_hdf5(made, arrays);
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(std::filesystem::path(made).parent_path());
  const auto result = test::run_program({"check", "--", "--help"});
  std::filesystem::current_path(before);
  EXPECT_THAT(result.out, HasSubstr("a Photon-HDF5 recording, T2, 1 ps a tick")) << result.err;
}

TEST_F(PhotonHdf5Program, AReaderThatIsKilledIsAnErrorThatSaysSo) {
  write_photon_hdf5(file(), many_photons(200));
  // It lives for some 10 ms, so that it may be gone before it is found: then once more.
  std::string said;
  for (int tried = 0; tried < 50 && said.empty(); ++tried) {
    test::Program convert({"convert", file(), ptu(), "--force"});
    const std::string id = std::to_string(convert.id());
    const std::string children = "/proc/" + id + "/task/" + id + "/children";
    pid_t reader = 0;
    for (int looks = 0; looks < 20'000 && reader == 0; ++looks) {
      std::ifstream(children) >> reader;
    }
    if (reader != 0) ::kill(reader, SIGKILL);
    const auto result = convert.wait();
    if (result.exit_code == 4) said = result.err;
  }
  EXPECT_THAT(said, AllOf(HasSubstr("the HDF5 library ended after photon 0, by Killed"),
                          HasSubstr("damaged")));
}

// Each damage gives tags or an error with a sentence: nothing crashes or turns in a circle.
class DamagedPhotonHdf5 : public PhotonHdf5Program {
 protected:
  // How many of the files are refused.
  std::size_t refusals_of(const std::vector<std::string>& files) {
    std::size_t refusals = 0;
    for (const std::string& content : files) {
      converted(folder_.write("damaged.hdf5", content));
      EXPECT_TRUE(exit_code_ == 0 || exit_code_ == 4) << exit_code_ << " " << said_;
      EXPECT_TRUE(exit_code_ == 0 || said_.find("damaged.hdf5") != std::string::npos) << said_;
      refusals += exit_code_ == 0 ? 0 : 1;
    }
    return refusals;
  }

  static std::vector<std::string> damaged(const std::string& whole, unsigned files) {
    std::vector<std::string> all(files, whole);
    std::mt19937 generator(3);
    for (std::string& content : all) {
      for (unsigned flips = 1 + generator() % 4; flips > 0; --flips) {
        constexpr unsigned char values[] = {0, 1, 0x80, 0xFF};
        const std::size_t at = generator() % content.size();
        content[at] =
            static_cast<char>(generator() % 2 == 0 ? values[generator() % 4] : generator() & 0xFFU);
      }
    }
    return all;
  }
};

TEST_F(DamagedPhotonHdf5, CutGivesTagsOrAnError) {
  PhotonArrays arrays = many_photons(3000);
  arrays.form = ArrayForm::packed(512);
  write_photon_hdf5(file(), arrays);
  const std::string whole = test::file_text(file());
  std::vector<std::string> cut;
  for (std::size_t bytes = 8; bytes < whole.size(); bytes += whole.size() / test::times(40)) {
    cut.push_back(whole.substr(0, bytes));
  }
  EXPECT_GT(refusals_of(cut), cut.size() / 2);
}

TEST_F(DamagedPhotonHdf5, OfTheOldFormGivesTagsOrAnError) {
  PhotonArrays arrays = many_photons(400);
  arrays.form = ArrayForm::packed(64);
  arrays.nanotimes = std::vector<std::uint16_t>(400, 5);
  arrays.laser_hz = 1 / (arrays.unit_s = 5e-6);
  write_photon_hdf5(file(), arrays);
  EXPECT_GT(refusals_of(damaged(test::file_text(file()), test::times(150))), 0U);
}

TEST_F(DamagedPhotonHdf5, OfTheNewestFormGivesTagsOrAnError) {
  write_photon_hdf5(file(), many_photons(40), true);
  EXPECT_GT(refusals_of(damaged(test::file_text(file()), test::times(150))), 0U);
}

}  // namespace
}  // namespace splid::recording
