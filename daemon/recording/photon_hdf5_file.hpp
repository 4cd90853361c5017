#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/photon_hdf5_decode.hpp"
#include "protocol/recording_header.hpp"

namespace splid::recording {

class Hdf5Handle;

// A Photon-HDF5 file, whose arrays of timestamps, detectors and nanotimes are read side by side.
//
//  - Without nanotimes it is a recording in T2 mode, its times in units of timestamps_unit.
//  - With nanotimes it is one in T3 mode: the timestamps count syncs, which come every
//    timestamps_unit, and nanotimes are in steps of tcspc_unit. That timestamps do count laser
//    pulses is told by laser_repetition_rate, of which timestamps_unit must be one or several
//    periods. A file that does not tell is refused: its photons have no place in a pattern.
//  - A nanotime beyond what a T3 record holds makes the steps of all coarser, with a warning.
//  - Times that go back by more than 1 us, and times and nanotimes that no tag can have, are
//  errors.
//  - The format knows no markers, and no sync but these. Of several spots the first is read.
//
// The HDF5 library reads it, which crashes or never returns on a few of many damaged files
// (version 1.10.8: 4 of 9,000). So this is for a process of its own: see PhotonHdf5Reader.
//
// Source: Photon-HDF5 format definition 0.5 (photon-hdf5.readthedocs.io).
//
// Memory: two chunks of each array. Threads: one. Errors: Error(Fault::data) with the file and the
// place in it.
class PhotonHdf5File {
 public:
  using Warn = std::function<void(const std::string&)>;

  // Reads what stands beside the photons. warn: never empty.
  PhotonHdf5File(std::string file, const Warn& warn);
  ~PhotonHdf5File();
  PhotonHdf5File(const PhotonHdf5File&) = delete;
  PhotonHdf5File& operator=(const PhotonHdf5File&) = delete;

  // The format in this header is the default, since RecordingHeader has no format for a file that
  // is no single row of records.
  [[nodiscard]] const RecordingHeader& header() const { return header_; }

  // Fills `out` with the next photons and returns their number, 0 only at the end.
  std::size_t read(std::span<PhotonHdf5Record> out);

 private:
  // An array of /photon_data.
  struct Array {
    std::string path;
    std::unique_ptr<Hdf5Handle> data;  // null: there is none
    std::uint64_t values = 0;
    std::size_t value_bytes = 0;
    std::vector<std::int64_t> block;
  };

  void open(const Warn& warn);
  void check_format() const;
  void find_group(const Warn& warn);
  void open_array(Array& array, const char* name) const;
  void read_times(const Warn& warn);
  void read_syncs(double unit_s, const Warn& warn);
  void fit_nanotimes(const Warn& warn);
  void add_texts();
  [[nodiscard]] std::optional<double> number_at(const std::string& path) const;
  [[nodiscard]] double needed_number(const std::string& path) const;
  void read_block(Array& array, std::uint64_t begin, std::size_t values) const;
  std::size_t read_rows(std::span<PhotonHdf5Record> out);
  // Row i of the blocks that were read last.
  void check_timestamp(std::size_t i);
  [[nodiscard]] std::uint32_t nanotime(std::size_t i) const;
  [[noreturn]] void refuse_row(const Array& array, std::size_t i, const std::string& why) const;

  std::string name_;
  std::unique_ptr<Hdf5Handle> file_;
  RecordingHeader header_;
  std::string group_;
  Array timestamps_;
  Array detectors_;
  Array nanotimes_;
  std::uint64_t taken_ = 0;  // photons
  std::int64_t most_timestamp_ = 0;
  std::int64_t most_step_back_ = 0;     // of timestamps
  std::optional<std::int64_t> latest_;  // timestamp
  std::int64_t nanotime_steps_ = 1;     // of the file's, in a step of the records
};

}  // namespace splid::recording
