#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/options.hpp"

namespace splid {

// Which of the instrument's channels mean what. A name is `sync` (the sync input), `marker:N`
// (N: marker bits, 1 to 15) or an input number; parse_channel() reads it. JSON: `channels`.
struct ChannelOptions {
  std::vector<std::string> photon = {"1"};  // several are one detector split over inputs
  std::string sync = "sync";
  std::string encoder = "marker:1";    // empty: none
  std::vector<double> delays_ps = {};  // by which photon's tags come late, in its order; or none
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// JSON: `frame`.
struct FrameOptions {
  double length_ms = 50;           // rounded to a whole number of pattern periods
  double min_seen_fraction = 0.9;  // a frame that saw less is `incomplete`
  void describe(OptionVisitor& visitor);
};

// JSON: `detector`.
struct DetectorOptions {
  // Zero: not known, so no frame is ever called saturated.
  double dead_time_ns = 0;
  void describe(OptionVisitor& visitor);
};

// JSON: `publish`.
struct PublishOptions {
  std::string endpoint = "tcp://127.0.0.1:9872";
  std::string local_endpoint;  // plain, on this machine, the same messages; empty: none
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// JSON: `control`.
struct ControlOptions {
  // ipc:///PATH or, with keys, tcp://HOST:PORT; auto: control_endpoint() finds one; off: none.
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
  always,  // from the start
  asked,   // from a control request on
};

// JSON: `record`.
struct RecordOptions {
  std::string folder;  // empty: nothing is recorded
  RecordWhen when = RecordWhen::always;
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
