#include <pybind11/stl.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <vector>

#include "daemon/stream/frame_plan.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "protocol/error.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr double m_per_ns_of_delay = speed_of_light_mps / 1e9 / 2;  // as of a frame, to the bit

std::size_t most_photons(const Config& config) {
  const auto tags = std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags));
  const auto capacity = frame_capacity(config.frame.length_ms, config.pattern, tags, true);
  return std::min(capacity.photons, max_estimated_photons);
}

// A frame's estimate with the clock that it was made by.
struct FrameResult {
  Estimate estimate;
  SyncFit sync;
  double range_offset_m = 0;
};

// One of a frame's targets.
struct TargetResult {
  TargetEstimate target;
  double range_offset_m = 0;
};

py::list targets_of(const FrameResult& self) {
  const Estimate& estimate = self.estimate;
  py::list targets;
  const auto add = [&](const TargetEstimate& target) {
    targets.append(TargetResult{target, self.range_offset_m});
  };
  if (!estimate.has_values) return targets;
  if (estimate.target_count == 0) add(estimate.first_target());
  for (std::size_t k = 0; k < estimate.target_count; ++k) add(estimate.targets.at(k));
  return targets;
}

// One estimator, which one thread at a time may use.
class FrameByFrame {
 public:
  explicit FrameByFrame(const Config& config)
      : options_(framer_options(config.frame.length_ms, config.pattern, config.drift.method)),
        clock_(options_.period_ps, options_.drift, options_.max_syncs),
        estimator_(config.pattern, config.pulse, config.scene, config.estimator,
                   config.frame.length_ms, most_photons(config), config.drift.reference,
                   config.detector, config.channels.photon.size()),
        range_offset_m_(config.scene.range_offset_m),
        inputs_(config.channels.photon.size()) {}

  FrameResult estimate(FrameView view, std::span<const std::int64_t> syncs_ps) {
    if (!view.photons_of_input.empty() && view.photons_of_input.size() != inputs_) {
      throw Error(Fault::usage,
                  "photons_of_input: " + std::to_string(view.photons_of_input.size()) +
                      " counts, and channels.photon has " + std::to_string(inputs_) + " inputs");
    }
    const std::scoped_lock lock(mutex_);
    clock_.reset();  // else the estimate would depend on the frame before
    view.sync = clock_.fit(syncs_ps, view.start_ps, view.end_ps);
    return {estimator_.estimate(view), view.sync, range_offset_m_};
  }

 private:
  std::mutex mutex_;
  FramerOptions options_;
  SyncClock clock_;
  FrameEstimator estimator_;
  double range_offset_m_;
  std::size_t inputs_;
};

void check_inside(std::span<const std::int64_t> times_ps, const char* name, std::int64_t start_ps,
                  std::int64_t end_ps) {
  const auto outside = std::find_if(times_ps.begin(), times_ps.end(), [&](std::int64_t time_ps) {
    return time_ps < start_ps || time_ps >= end_ps;
  });
  if (outside == times_ps.end()) return;
  throw Error(Fault::usage,
              std::string(name) + "[" + std::to_string(outside - times_ps.begin()) +
                  "] = " + std::to_string(*outside) +
                  " is outside of the frame, which is from start_ps = " + std::to_string(start_ps) +
                  " to before end_ps = " + std::to_string(end_ps));
}

// losses: rows of begin, end and count.
std::vector<Loss> losses_from(const Times& rows, std::int64_t start_ps, std::int64_t end_ps) {
  std::vector<Loss> losses;
  if (rows.size() == 0) return losses;
  if (rows.ndim() != 2 || rows.shape(1) != 3) {
    throw py::value_error("losses: rows of (begin_ps, end_ps, count) are expected");
  }
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    const Loss loss{rows.at(i, 0), rows.at(i, 1), rows.at(i, 2)};
    const bool is_next = losses.empty() || loss.begin_ps >= losses.back().end_ps;
    if (!is_next || loss.begin_ps < start_ps || loss.end_ps > end_ps ||
        loss.begin_ps >= loss.end_ps) {
      throw Error(Fault::usage, "losses[" + std::to_string(i) +
                                    "]: each loss ends after it begins, they are sorted, do not "
                                    "overlap and lie within the frame");
    }
    losses.push_back(loss);
  }
  return losses;
}

FrameResult estimate(FrameByFrame& estimator, const Times& photons_ps, const Times& syncs_ps,
                     std::int64_t start_ps, std::int64_t end_ps, const Times& loss_rows,
                     const Times& before_ps, const std::vector<std::uint64_t>& photons_of_input) {
  if (start_ps >= end_ps) {
    throw Error(Fault::usage, "end_ps = " + std::to_string(end_ps) +
                                  " is not after start_ps = " + std::to_string(start_ps));
  }
  const auto photons = times_of(photons_ps);
  const auto syncs = times_of(syncs_ps);
  const auto before = times_of(before_ps);
  const std::vector<Loss> losses = losses_from(loss_rows, start_ps, end_ps);
  const py::gil_scoped_release unlocked;
  check_inside(photons, "photons_ps", start_ps, end_ps);
  check_inside(syncs, "syncs_ps", start_ps, end_ps);
  return estimator.estimate({start_ps, end_ps, photons, losses, {}, before, photons_of_input},
                            syncs);
}

// A member of an estimate that has values; NaN where it has none.
template <class Member>
auto known(Member member, double factor = 1) {
  return [member, factor](const FrameResult& self) {
    return self.estimate.has_values ? factor * (self.estimate.*member) : unknown;
  };
}

void bind_values(py::class_<FrameResult>& type) {
  type.def_property_readonly("delay_ns", known(&Estimate::delay_ns))
      .def_property_readonly("delay_start_ns", known(&Estimate::delay_start_ns))
      .def_property_readonly("velocity_mps", known(&Estimate::velocity_mps))
      .def_property_readonly("signal_per_pulse", known(&Estimate::signal_per_pulse))
      .def_property_readonly("std_delay_ns", known(&Estimate::std_delay_ns))
      .def_property_readonly("std_distance_m", known(&Estimate::std_delay_ns, m_per_ns_of_delay))
      .def_property_readonly("std_velocity_mps", known(&Estimate::std_velocity_mps))
      .def_property_readonly("std_signal_per_pulse", known(&Estimate::std_signal_per_pulse))
      .def_property_readonly("std_background_per_s", known(&Estimate::std_background_per_ns, 1e9))
      .def_property_readonly("range_odds_nats", known(&Estimate::range_odds_nats))
      .def_property_readonly(
          "blind_fraction",
          [](const FrameResult& self) {
            return self.estimate.dead_time_modelled ? self.estimate.blind_fraction : unknown;
          })
      .def_property_readonly("dead_time_misfit_ns",
                             [](const FrameResult& self) {
                               return self.estimate.dead_time_misfit_ns.value_or(unknown);
                             })
      .def_property_readonly(
          "afterpulse_misfit",
          [](const FrameResult& self) { return self.estimate.afterpulse_misfit.value_or(unknown); })
      .def_property_readonly(
          "flicker_misfit",
          [](const FrameResult& self) { return self.estimate.flicker_misfit.value_or(unknown); })
      .def_property_readonly("background_per_s",
                             [](const FrameResult& self) {
                               return self.estimate.status == FrameStatus::not_run ||
                                              self.estimate.status == FrameStatus::no_sync
                                          ? unknown
                                          : self.estimate.background_per_ns * 1e9;
                             })
      .def_property_readonly("distance_m", [](const FrameResult& self) {
        if (!self.estimate.has_values) return unknown;
        return m_per_ns_of_delay * self.estimate.delay_ns - self.range_offset_m;
      });
}

void bind_acceleration(py::class_<FrameResult>& type) {
  const auto if_known = [](double Estimate::*member) {
    return [member](const FrameResult& self) {
      return self.estimate.std_acceleration_mps2 > 0 ? self.estimate.*member : unknown;
    };
  };
  type.def_property_readonly("acceleration_mps2", if_known(&Estimate::acceleration_mps2))
      .def_property_readonly("std_acceleration_mps2", if_known(&Estimate::std_acceleration_mps2))
      .def_property_readonly("acceleration_misfit_mps2",
                             [](const FrameResult& self) {
                               return self.estimate.acceleration_misfit_mps2.value_or(unknown);
                             })
      .def_property_readonly(
          "jerk_misfit_mps3",
          [](const FrameResult& self) { return self.estimate.jerk_misfit_mps3.value_or(unknown); })
      .def_property_readonly(
          "path_excess",
          [](const FrameResult& self) { return self.estimate.path_excess.value_or(unknown); })
      .def_property_readonly("signal_gap", [](const FrameResult& self) {
        return self.estimate.signal_gap.value_or(unknown);
      });
}

void bind_pulse(py::class_<FrameResult>& type) {
  const auto if_fitted = [](double Estimate::*member) {
    return [member](const FrameResult& self) {
      return self.estimate.std_pulse_sigma_ns > 0 ? 1e3 * (self.estimate.*member) : unknown;
    };
  };
  const auto if_seen = [](double Estimate::*member) {
    return [member](const FrameResult& self) {
      return self.estimate.std_pulse_excess > 0 ? self.estimate.*member : unknown;
    };
  };
  const auto if_skew = [](double Estimate::*member) {
    return [member](const FrameResult& self) {
      return self.estimate.std_pulse_skew > 0 ? self.estimate.*member : unknown;
    };
  };
  type.def_property_readonly("pulse_skew", if_skew(&Estimate::pulse_skew))
      .def_property_readonly("std_pulse_skew", if_skew(&Estimate::std_pulse_skew))
      .def_property_readonly("shape_misfit", [](const FrameResult& self) {
        return self.estimate.shape_misfit.value_or(unknown);
      });
  type.def_property_readonly("pulse_sigma_ps", if_fitted(&Estimate::pulse_sigma_ns))
      .def_property_readonly("std_pulse_sigma_ps", if_fitted(&Estimate::std_pulse_sigma_ns))
      .def_property_readonly(
          "pulse_misfit",
          [](const FrameResult& self) { return self.estimate.pulse_misfit.value_or(unknown); })
      .def_property_readonly("pulse_excess", if_seen(&Estimate::pulse_excess))
      .def_property_readonly("std_pulse_excess", if_seen(&Estimate::std_pulse_excess));
}

// For help(); what each member is stands in _splid.pyi.
constexpr const char* target_doc =
    R"(One of a frame's targets, with values like those of Estimate.

status is ok, or ambiguous where its range is not sure. Deviations (std_) are those with the other
targets unknown too, and the significance (nats) is what this target adds to the others.)";

constexpr const char* estimate_doc =
    R"(One frame's estimate. Values are NaN where has_values is False; std_ is one standard deviation.

status: ok, no_target, ambiguous, no_sync or not_run. distance_m (c/2 times delay_ns, less
scene.range_offset_m), delay_ns (round trip) and velocity_mps (positive away from the lidar) are at
mid-frame, delay_start_ns is at the frame's start. signal_per_pulse: counts for each pulse of
amplitude 1. significance: nats gained over no target. An acceleration is NaN where the path was
taken as straight. targets: a list of Target. Source: docs/estimation.md.)";

void bind_target(py::module_& module) {
  const auto value = [](double TargetEstimate::*member, double factor = 1) {
    return [=](const TargetResult& self) { return factor * (self.target.*member); };
  };
  const auto if_there = [](std::optional<double> TargetEstimate::*member) {
    return [=](const TargetResult& self) { return (self.target.*member).value_or(unknown); };
  };
  py::class_<TargetResult>(module, "Target", target_doc)
      .def_property_readonly("status",
                             [](const TargetResult& self) { return to_string(self.target.status); })
      .def_property_readonly("distance_m",
                             [](const TargetResult& self) {
                               return m_per_ns_of_delay * self.target.delay_ns -
                                      self.range_offset_m;
                             })
      .def_property_readonly("delay_ns", value(&TargetEstimate::delay_ns))
      .def_property_readonly("delay_start_ns", value(&TargetEstimate::delay_start_ns))
      .def_property_readonly("velocity_mps", value(&TargetEstimate::velocity_mps))
      .def_property_readonly("signal_per_pulse", value(&TargetEstimate::signal_per_pulse))
      .def_property_readonly("std_distance_m",
                             value(&TargetEstimate::std_delay_ns, m_per_ns_of_delay))
      .def_property_readonly("std_delay_ns", value(&TargetEstimate::std_delay_ns))
      .def_property_readonly("std_velocity_mps", value(&TargetEstimate::std_velocity_mps))
      .def_property_readonly("std_signal_per_pulse", value(&TargetEstimate::std_signal_per_pulse))
      .def_property_readonly("significance", value(&TargetEstimate::significance_nats))
      .def_property_readonly("range_odds_nats", value(&TargetEstimate::range_odds_nats))
      .def_property_readonly("pulse_misfit", if_there(&TargetEstimate::pulse_misfit))
      .def_property_readonly("acceleration_misfit_mps2",
                             if_there(&TargetEstimate::acceleration_misfit_mps2))
      .def_property_readonly("jerk_misfit_mps3", if_there(&TargetEstimate::jerk_misfit_mps3))
      .def_property_readonly("signal_gap", if_there(&TargetEstimate::signal_gap))
      .def_property_readonly("shape_odds_nats", if_there(&TargetEstimate::shape_odds_nats));
}

void bind_clock(py::class_<FrameResult>& type) {
  const auto if_locked = [](double SyncFit::*member) {
    return [member](const FrameResult& self) {
      return self.sync.locked ? self.sync.*member : unknown;
    };
  };
  type.def_property_readonly("sync_locked",
                             [](const FrameResult& self) { return self.sync.locked; })
      .def_property_readonly("sync_count", [](const FrameResult& self) { return self.sync.count; })
      .def_property_readonly("sync_missing",
                             [](const FrameResult& self) { return self.sync.missing; })
      .def_property_readonly("sync_spurious",
                             [](const FrameResult& self) { return self.sync.spurious; })
      .def_property_readonly("sync_period_ps", if_locked(&SyncFit::period_ps))
      .def_property_readonly("sync_drift_ppm", if_locked(&SyncFit::drift_ppm))
      .def_property_readonly("sync_jitter_ps", if_locked(&SyncFit::jitter_ps));
}

}  // namespace

void bind_estimator(py::module_& module) {
  bind_target(module);
  py::class_<FrameResult> result(module, "Estimate", estimate_doc);
  result
      .def_property_readonly(
          "status", [](const FrameResult& self) { return to_string(self.estimate.status); })
      .def_property_readonly("has_values",
                             [](const FrameResult& self) { return self.estimate.has_values; })
      .def_property_readonly(
          "significance", [](const FrameResult& self) { return self.estimate.significance_nats; })
      .def_property_readonly("photons",
                             [](const FrameResult& self) { return self.estimate.photons; })
      .def_property_readonly("targets", &targets_of);
  bind_values(result);
  bind_acceleration(result);
  bind_pulse(result);
  bind_clock(result);
  py::class_<FrameByFrame>(module, "Estimator")
      .def(py::init([](const ConfigText& text) {
             const Config config = text.read();
             return std::make_unique<FrameByFrame>(config);
           }),
           py::arg("config"))
      .def("estimate", &estimate, py::arg("photons_ps").noconvert(),
           py::arg("syncs_ps").noconvert(), py::arg("start_ps"), py::arg("end_ps"),
           py::arg("losses").noconvert(), py::arg("before_ps").noconvert(),
           py::arg("photons_of_input"));
}

}  // namespace splid::python
