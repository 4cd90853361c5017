#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/batch/batch_list.hpp"
#include "daemon/recording/table_head.hpp"

namespace splid::batch {

// What all frames of an output folder are measured by.
struct Facts {
  std::string program;       // name and version
  std::string config_json;   // as config_to_json() writes the configuration as it was read
  std::string pattern_json;  // as to_json() writes it
  std::uint64_t slice_frames = 0;
};

// How far a recording has come.
struct SliceHead {
  std::uint64_t number = 0;
  std::uint64_t frames = 0;
  std::uint64_t rows = 0;  // of several pixels each frame has as many
};

// The files in the output folder of a batch. Each is written beside its place and then renamed, so
// that a batch may be killed at any moment, and several shards may write at once.
//
//   batch.json                what the frames are measured by, and the recordings
//   NAME.h5                   the table of a recording that is finished
//   summary.csv               a line for each recording, or for each of its pixels
//   slices/NAME/              of a recording, until its table is made:
//     facts.json                what stands beside the frames in the table
//     000012.slice              frames 12,000 to 12,999, as rows of the table
//     part-BEGIN-END.json       that part of the recording is measured
//     end.json                  how many frames the recording has
//     sha256.json               the recording's checksum
//     failure.json              why it could not be measured
//     summary.json              its lines of the summary, once the table is made; stays
//
// Each of the files below slices/ but failure.json has a key, which says by what and of what it was
// made. A file with another key is as good as none.
//
// Threads: one for each recording. Errors: Error(Fault::device) where a file cannot be written.
class Folder {
 public:
  explicit Folder(std::string folder) : folder_(std::move(folder)) {}

  // Makes the folder, or goes on in it where it has frames measured by the same facts; recordings
  // that it does not know yet are added to those that it knows. Errors: Error(Fault::usage) where
  // its frames were measured by others, and where it is a folder of other things.
  void begin(const Facts& facts, const std::vector<Recording>& recordings) const;
  // The recordings of all batches in the folder, in their order. Errors: Error(Fault::usage) where
  // there was no batch.
  [[nodiscard]] std::vector<Recording> recordings() const;

  // The key of a recording's files: by its length and its first 64 KiB, where a PTU has the time
  // and the name that it was given, and by the batch's facts. Errors: Error(Fault::data) where the
  // recording cannot be read.
  static std::string key_of(const Facts& facts, const Recording& recording);

  // A small JSON file of a recording: the texts that stand in it, by name. Absent where it is not
  // there, is damaged or, with a key that is not empty, has another key.
  using Members = std::map<std::string, std::string>;
  [[nodiscard]] std::optional<Members> read(const Recording& recording, const std::string& file,
                                            const std::string& key) const;
  void write(const Recording& recording, const std::string& file, const Members& members) const;

  // The summary's lines of a recording whose table is made; absent where it is not. key: of the
  // recording; empty: any.
  [[nodiscard]] std::optional<std::string> finished(const Recording& recording,
                                                    const std::string& key) const;

  // The slices that are there and whole, by number.
  [[nodiscard]] std::vector<SliceHead> slices(const Recording& recording,
                                              const std::string& key) const;
  // The rows of one of them. Errors: Error(Fault::device) where it cannot be read any more.
  [[nodiscard]] std::string slice_rows(const Recording& recording, const SliceHead& slice) const;
  // slice: its number and frames.
  void write_slice(const Recording& recording, const std::string& key, const SliceHead& slice,
                   const std::string& rows) const;

  // Where the finished table of a recording is, and where it is being made.
  [[nodiscard]] std::string table_file(const Recording& recording) const;
  [[nodiscard]] std::string new_table_file(const Recording& recording) const;
  // The table takes its place.
  void keep_table(const Recording& recording) const;
  // Removes what is not needed once the table is made, which is all but summary.json.
  void remove_slices(const Recording& recording) const;
  [[nodiscard]] std::string summary_file() const { return folder_ + "/summary.csv"; }

  [[nodiscard]] const std::string& path() const { return folder_; }

 private:
  [[nodiscard]] std::string folder_of(const Recording& recording) const {
    return folder_ + "/slices/" + recording.name;
  }
  [[nodiscard]] std::string slice_file(const Recording& recording, std::uint64_t number) const;

  std::string folder_;
};

inline constexpr const char* facts_of_table = "facts.json";
inline constexpr const char* end_of_recording = "end.json";
inline constexpr const char* checksum_of_recording = "sha256.json";
inline constexpr const char* failure_of_recording = "failure.json";
inline constexpr const char* summary_of_recording = "summary.json";

}  // namespace splid::batch
