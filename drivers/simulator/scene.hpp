#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/simulator/detectors.hpp"
#include "drivers/simulator/fine_time.hpp"
#include "drivers/simulator/random.hpp"
#include "drivers/simulator/scanner.hpp"
#include "drivers/simulator/signal_stream.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "drivers/simulator/sync_stream.hpp"
#include "drivers/tag_writer.hpp"
#include "protocol/pattern.hpp"

namespace splid::simulator {

// The events that a tagger records of a scene, in the order of time.
//
// Threads: one. No allocation once the fullest stretch has passed.
class Scene {
 public:
  enum class Part {
    all,
    photons,  // no syncs and markers, as of one of several detectors
  };

  // Pattern and options are valid.
  Scene(const Pattern& pattern, const Options& options, Part part = Part::all);

  // Writes the events before until_ps (since the stream's start) that were not written yet. Returns
  // false once a stop was requested; the rest of the stream is then lost.
  bool write_until(std::int64_t until_ps, TagWriter& out);

 private:
  bool write_background(std::int64_t until_ps, TagWriter& out);
  bool write_first(TagWriter& out);
  bool put_light(std::int64_t time_ps, TagWriter& out);
  bool put_detection(std::int64_t time_ps, std::optional<Detection> detection, TagWriter& out);
  bool put_photon(std::int64_t time_ps, int detector, TagWriter& out);
  bool put_late(TagWriter& out);
  [[nodiscard]] std::int64_t next_late_ps() const {
    return late_.empty() ? PendingTimes::none : late_.front().time_ps;
  }
  bool put_sync(std::int64_t time_ps, TagWriter& out);
  void next_background();
  PendingTimes& next_signal();
  bool put_marker(TagWriter& out);
  [[nodiscard]] std::int64_t next_marker_ps() const;

  // A photon that its detector's timing walk delays.
  struct LatePhoton {
    std::int64_t time_ps;
    int detector;
  };
  static bool is_later(const LatePhoton& a, const LatePhoton& b) { return a.time_ps > b.time_ps; }

  std::vector<SignalStream> signals_;  // of each target, and of the fog
  ForeignStream foreign_;
  SyncStream sync_;  // never filled where there are photons only
  bool has_syncs_;
  Detectors detectors_;
  std::vector<LatePhoton> late_;  // a heap, the earliest first
  Random random_;
  std::int64_t start_ps_;
  int photon_input_;
  bool near_photons_only_;
  bool photon_since_sync_ = false;
  double background_gap_ps_;  // mean; 0: no background
  FineTime background_;       // next event; far in the future where there is no background
  double marker_gap_ps_;      // 0: no markers of an encoder
  FineTime marker_;           // next of them
  std::optional<Scanner> scanner_;
};

}  // namespace splid::simulator
