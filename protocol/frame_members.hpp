#pragma once

#include <concepts>
#include <type_traits>

#include "protocol/frame_json.hpp"

// The members of the `frame` message, each named once: the JSON both ways, the columns of tables,
// Python's members and the manual's table are all visitors of describe().

namespace splid {

// What a member is called, its unit (empty: none), and what it is in a sentence.
struct Member {
  const char* name;
  const char* unit;
  const char* doc;
};

// The deviations in the group `std`.
template <class Values, class Visitor>
void describe_deviations(Values& values, Visitor& see) {
  constexpr bool is_frame = std::same_as<std::remove_const_t<Values>, FrameMessage>;
  see.number({"distance_m", "m", "standard deviation of the distance"}, values.std_distance_m);
  see.number({"velocity_mps", "m/s",
              "standard deviation of the velocity; left out if the target is taken to be at rest"},
             values.std_velocity_mps);
  if constexpr (is_frame) {
    see.number({"acceleration_mps2", "m/s2", "standard deviation of the acceleration"},
               values.std_acceleration_mps2);
  }
  see.number({"signal_per_pulse", "counts/pulse", "standard deviation of the signal"},
             values.std_signal_per_pulse);
  if constexpr (is_frame) {
    see.number({"background_per_s", "counts/s",
                "standard deviation of the background; for a background of 0: one count divided by "
                "the time without losses"},
               values.std_background_per_s);
    see.number({"pulse_sigma_ps", "ps", "standard deviation of the pulse's width"},
               values.std_pulse_sigma_ps);
  }
}

template <class Finding, class Visitor>
void describe_finding(Finding& finding, Visitor& see) {
  see.text({"name", "", "name of the effect, [listed below](#findings)"}, finding.name);
  see.number({"value", "", "size of the effect, in `unit`"}, finding.value);
  see.number({"std", "", "standard deviation of the value"}, finding.std);
  see.text_if_any({"unit", "", "unit of the value; left out for a ratio"}, finding.unit);
  see.number({"gain_nats", "nats", "log-likelihood ratio against the configured model"},
             finding.gain_nats);
  see.text({"advice", "", "what to do, with the key of the configuration"}, finding.advice);
}
// The members that a frame has, and those of them that each of its targets has too.
template <class Values, class Visitor>
void describe_values(Values& values, Visitor& see) {
  constexpr bool is_frame = std::same_as<std::remove_const_t<Values>, FrameMessage>;
  see.choice({"status", "", "[see below](#status-of-a-frame)"}, values.status);
  if constexpr (is_frame) {
    see.flag({"valid", "",
              "true for `ok` and `ambiguous`: the frame has a target with values. For `ambiguous`, "
              "the range may be wrong"},
             values.valid());
    see.choice({"mode", "",
                "mode of the pattern: `baseline` (even pulses), `ambiguous` (even pulses; the "
                "target may be beyond the unambiguous range), `mrr` (several rates in turn), "
                "`random`, `interleaved` (superposed pulse trains)"},
               values.mode);
    see.whole({"start_ps", "ps", "start of the frame, as a string"}, values.start_ps);
    see.number({"duration_ms", "ms", "length of the frame, a whole number of pattern periods"},
               values.duration_ms);
  }
  see.number({"distance_m", "m", "distance, less `scene.range_offset_m`"}, values.distance_m);
  see.number({"velocity_mps", "m/s", "radial velocity"}, values.velocity_mps);
  if constexpr (is_frame) {
    see.number(
        {"acceleration_mps2", "m/s2",
         "radial acceleration, constant over the frame "
         "([how](../estimation.md#a-target-that-accelerates)). With `scene.motion` `accelerating`: "
         "in frames with a target. With `auto`: in frames that show an acceleration"},
        values.acceleration_mps2);
  }
  see.number({"signal_per_pulse", "counts/pulse", "signal counts for a pulse of amplitude 1"},
             values.signal_per_pulse);
  if constexpr (is_frame) {
    see.number({"background_per_s", "counts/s", "all other detections; 0 if the photons show none"},
               values.background_per_s);
  }
  see.number({"signal_per_period", "counts/period", "signal counts in a pattern period"},
             values.signal_per_period);
  if constexpr (is_frame) {
    see.number({"background_per_period", "counts/period", "background counts in a pattern period"},
               values.background_per_period);
    see.number({"sbr", "",
                "signal counts divided by background counts; left out if the background is below "
                "two standard deviations (about four photons)"},
               values.sbr);
  }
  see.number({"delay_ns", "ns", "round-trip time at the start of the frame"}, values.delay_ns);
  see.number(
      {"significance", "nats",
       "log-likelihood ratio against no target; in `targets`, against the other targets alone"},
      values.significance);
  see.number({"range_odds_nats", "nats",
              "natural logarithm x of the [odds](../estimation.md#range-odds) that the range is "
              "right: the range is wrong with probability 1 / (1 + e^x). In mode `ambiguous`, the "
              "odds hold within the pattern's unambiguous range"},
             values.range_odds_nats);
  if constexpr (is_frame) {
    see.number({"pulse_sigma_ps", "ps",
                "with `pulse.width` `fitted`: standard deviation of the detected pulse; left out "
                "if splid keeps the configured width"},
               values.pulse_sigma_ps);
    see.number(
        {"blind_fraction", "",
         "if the dead time is modelled: fraction of the time without losses in which the detector "
         "is dead; with several inputs, fraction of the light that meets a dead input"},
        values.blind_fraction);
  }
  see.list_if_any({"findings", "",
                   "effects that the configured model lacks: [see below](#findings); left out if "
                   "there are none"},
                  values.findings,
                  [](auto& finding, auto& inner) { describe_finding(finding, inner); });
  see.group({"std", "", ""}, values, [](auto& of, auto& std) { describe_deviations(of, std); });
}

template <class Sync, class Visitor>
void describe_sync(Sync& sync, Visitor& see) {
  see.count({"count", "", "syncs in the frame"}, sync.count);
  see.count({"missing", "", "pattern periods without a sync"}, sync.missing);
  see.count({"spurious", "", "syncs that fit no period"}, sync.spurious);
  see.number({"period_ps", "ps", "measured pattern period"}, sync.period_ps);
  see.number(
      {"drift_ppm", "ppm", "measured pattern period divided by the calibrated period, minus 1"},
      sync.drift_ppm);
  see.number({"jitter_ps", "ps", "root mean square of the syncs' offsets from evenly spaced times"},
             sync.jitter_ps);
}

// Message: FrameMessage, const or not. Visitor: has a member function for each kind of member; see
// protocol/frame_json.cpp for one that writes and one that reads.
template <class Message, class Visitor>
void describe(Message& message, Visitor& see) {
  see.number({"timestamp", "s", "UTC in the middle of the frame ([clocks](#which-clock))"},
             message.timestamp_s);
  see.count({"sequence", "", "counts frames from 0"}, message.sequence);
  describe_values(message, see);
  see.list(
      {"targets", "", "with `scene.targets` above 1: [the targets of the frame](#several-targets)"},
      message.targets, [](auto& target, auto& inner) { describe_values(target, inner); });
  see.count({"photons", "", "photons in the frame"}, message.photons);
  see.count({"lost_tags", "",
             "tags (photons, syncs, markers) that were lost in the frame's time, as far as their "
             "number is known"},
            message.lost_tags);
  see.count_if_any({"uncounted_losses", "",
                    "number of losses with an unknown number of tags; a loss counts in the frame "
                    "in which it ends; left out if 0"},
                   message.uncounted_losses);
  see.number({"seen_fraction", "",
              "fraction of the frame's time without losses, 0 to 1; in a stream with syncs, an "
              "improbably long time without any tag counts as a loss"},
             message.seen_fraction);
  see.part({"sync", "",
            "the syncs of the frame; left out if they have no times, as in a [T3 "
            "recording](../guide/recording.md#t3)"},
           message.sync, [](auto& sync, auto& inner) { describe_sync(sync, inner); });
  see.part(
      {"reference", "", "values of the [encoder](../guide/instruments/encoder.md)"},
      message.reference, [](auto& reference, auto& inner) {
        inner.number({"distance_m", "m", "distance by the encoder"}, reference.distance_m);
        inner.number({"velocity_mps", "m/s", "velocity by the encoder"}, reference.velocity_mps);
      });
  see.part({"scan", "", "with a [scan](../guide/scan.md): the pixel that the frame belongs to"},
           message.scan, [](auto& scan, auto& inner) {
             inner.count({"picture", "", "number of the picture, from 0"}, scan.picture);
             inner.count({"line", "", "number of the line in the picture, from 0"}, scan.line);
             inner.count({"column", "", "number of the pixel in the line, from 0 at the left"},
                         scan.column);
             inner.number({"azimuth_deg", "degrees", "azimuth of the pixel, positive to the right"},
                          scan.azimuth_deg);
             inner.number({"elevation_deg", "degrees", "elevation of the pixel, positive upwards"},
                          scan.elevation_deg);
           });
  see.text({"effort", "",
            "effort of the estimate, `balanced` or `fast`; `fast` replaces a configured `balanced` "
            "if frames come too fast"},
           message.effort);
  see.number({"compute_ms", "ms", "computing time of the estimate"}, message.compute_ms);
  see.number({"latency_ms", "ms", "time from the arrival of the frame's last tag to publication"},
             message.latency_ms);
  see.text_if_any({"pixel", "", "with several pixels: name of the pixel"}, message.pixel);
}

}  // namespace splid
