#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/options.hpp"

namespace splid {

// What each of the instrument's channels means. A name is `sync` (the sync input), `marker:N`
// (N: marker bits, 1 to 15) or an input number; parse_channel() reads it. JSON: `channels`.
struct ChannelOptions {
  std::vector<std::string> photon = {"1"};  // several inputs count as one detector
  std::string sync = "sync";
  std::string encoder = "marker:1";  // empty: none
  // How late the tags of each of `photon`'s inputs come, in the same order; or empty.
  std::vector<double> delays_ps = {};
  // The inputs of `pixels`, in the place of `photon`; delays_ps is then theirs. Not in JSON.
  std::vector<std::int64_t> pixels = {};
  // The inputs that photons come on, of pixels where there are any.
  [[nodiscard]] std::vector<std::string> photon_names() const;
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// JSON: `frame`.
struct FrameOptions {
  double length_ms = 50;           // rounded to a whole number of pattern periods
  std::string by = "auto";         // auto, time, marker:N or line:START:STOP:PIXELS; scan_lines()
  double min_seen_fraction = 0.9;  // a frame of which less was seen is `incomplete`
  void describe(OptionVisitor& visitor);
};

// JSON: `publish`.
struct PublishOptions {
  std::string endpoint = "tcp://127.0.0.1:9872";
  // A second endpoint, without keys, on this machine, with the same messages; empty: none.
  std::string local_endpoint;
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// JSON: `control`.
struct ControlOptions {
  // ipc:///PATH or, with keys, tcp://HOST:PORT; auto: control::endpoint_of() chooses; off: none.
  std::string endpoint = "auto";
  std::string allow_list;  // file of public keys, for TCP; empty: none
  [[nodiscard]] bool is_tcp() const { return endpoint.starts_with("tcp://"); }
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// JSON: `metrics`.
struct MetricsOptions {
  std::string file;  // empty: none
  std::string http;  // HOST:PORT of a loopback address; empty: none
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

enum class RecordWhen {
  always,  // record from the start on
  asked,   // record when a control request asks for it
};

enum class RecordFrames {
  off,   // frames are published and not kept
  hdf5,  // in a table beside each recording, as HDF5
  csv,   // the same as text
};

// JSON: `record`.
struct RecordOptions {
  std::string folder;  // empty: nothing is recorded
  RecordWhen when = RecordWhen::always;
  RecordFrames frames = RecordFrames::off;
  double max_file_mib = 1024;  // of 2^20 bytes
  double max_file_s = 600;     // of the tagger's clock
  double max_folder_gib = 50;  // of 2^30 bytes
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// JSON: `pipeline`.
struct PipelineOptions {
  std::int64_t ring_capacity_tags = 4'194'304;  // 64 MiB; a frame's tags must fit
  std::int64_t estimation_threads = 1;
  void describe(OptionVisitor& visitor);
};

}  // namespace splid
