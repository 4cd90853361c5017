#include <pybind11/stl.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/frame_plan.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_members.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

std::size_t most_photons(const Config& config) {
  const auto tags = std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags));
  const auto capacity = frame_capacity(config.frame.length_ms, config.pattern, tags, true);
  return std::min(capacity.photons, max_estimated_photons);
}

// What a message says of the frame itself: its photons are counted and not copied.
Frame frame_of(const FrameView& view) {
  Frame frame({view.photons_ps.size(), 0, 0, view.losses.size()});
  frame.start_ps = view.start_ps;
  frame.end_ps = view.end_ps;
  frame.sync = view.sync;
  frame.photons_ps.resize(view.photons_ps.size());
  for (const Loss& loss : view.losses) {
    frame.add_loss(loss.begin_ps, loss.end_ps, loss.count);
    frame.lost_tags += static_cast<std::uint64_t>(std::max<std::int64_t>(loss.count, 0));
  }
  frame.settle_losses();
  return frame;
}

// One estimator, which one thread at a time may use.
class FrameByFrame {
 public:
  explicit FrameByFrame(const Config& config)
      : options_(framer_options(config.frame.length_ms, config.pattern, config.drift.method, {})),
        clock_(options_.period_ps, options_.drift, options_.max_syncs),
        estimator_(config.pattern, config.pulse, config.scene, config.estimator,
                   config.frame.length_ms, most_photons(config), config.drift.reference,
                   config.detector, config.channels.photon.size()),
        context_(frame_context(config)),
        inputs_(config.channels.photon.size()) {
    context_.lists_targets = true;
  }

  FrameMessage estimate(FrameView view, std::span<const std::int64_t> syncs_ps) {
    if (!view.photons_of_input.empty() && view.photons_of_input.size() != inputs_) {
      throw Error(Fault::usage,
                  "photons_of_input: " + std::to_string(view.photons_of_input.size()) +
                      " counts, and channels.photon has " + std::to_string(inputs_) + " inputs");
    }
    const std::scoped_lock lock(mutex_);
    clock_.reset();  // else the estimate would depend on the frame before
    view.sync = clock_.fit(syncs_ps, view.start_ps, view.end_ps);
    return make_frame_message(frame_of(view), estimator_.estimate(view), context_, {});
  }

 private:
  std::mutex mutex_;
  FramerOptions options_;
  SyncClock clock_;
  FrameEstimator estimator_;
  FrameContext context_;
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

FrameMessage estimate(FrameByFrame& estimator, const Times& photons_ps, const Times& syncs_ps,
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

// The members of a message by the names of their columns in tables (distance_m of std is
// std_distance_m). A number that is not known is NaN.
class Values {
 public:
  void number(const Member& member, std::optional<double> value) {
    put(member, py::float_(value.value_or(std::numeric_limits<double>::quiet_NaN())));
  }
  void count(const Member& member, std::optional<std::uint64_t> value) {
    put(member, py::int_(value.value_or(0)));
  }
  void count_if_any(const Member& member, std::uint64_t value) { count(member, value); }
  void whole(const Member& member, std::int64_t value) { put(member, py::int_(value)); }
  void flag(const Member& member, bool value) { put(member, py::bool_(value)); }
  template <class Enum>
  void choice(const Member& member, Enum value) {
    put(member, py::str(to_string(value)));
  }
  void text(const Member& member, const std::optional<std::string>& value) {
    put(member, py::str(value.value_or("")));
  }
  void text_if_any(const Member& member, const std::string& value) { put(member, py::str(value)); }
  template <class Owner, class Members>
  void group(const Member& member, const Owner& owner, Members members) {
    group_ = std::string(member.name) + "_";
    members(owner, *this);
    group_.clear();
  }
  template <class Part, class Members>
  void part(const Member& member, const std::optional<Part>& part, Members members) {
    group(member, part.value_or(Part{}), members);
  }
  template <class Item, class Members>
  void list(const Member& member, const std::optional<std::vector<Item>>& items, Members) {
    put(member, py::cast(items.value_or(std::vector<Item>{})));
  }
  // A dictionary for each item.
  template <class Item, class Members>
  void list_if_any(const Member& member, const std::vector<Item>& items, Members members) {
    py::list list;
    for (const Item& item : items) {
      Values values;
      members(item, values);
      list.append(values.all);
    }
    put(member, list);
  }

  py::dict all;
  std::map<std::string, std::string> docs;

 private:
  void put(const Member& member, py::object value) {
    const std::string name = group_ + member.name;
    const std::string unit = *member.unit == 0 ? "" : std::string(" (") + member.unit + ")";
    all[py::str(name)] = std::move(value);
    docs[name] = member.doc + unit;
  }
  std::string group_;
};

Values values_of(const FrameMessage& frame) {
  Values values;
  describe(frame, values);
  return values;
}

Values values_of(const FrameMessage::Target& target) {
  Values values;
  describe_values(target, values);
  return values;
}

// What only a stream of frames has.
bool is_of_streams(const std::string& name) {
  static const std::set<std::string> names = {
      "timestamp",  "sequence",   "uncounted_losses",     "effort",
      "compute_ms", "latency_ms", "reference_distance_m", "reference_velocity_mps",
      "pixel"};
  return names.contains(name) || name.starts_with("scan_");
}

template <class Message>
void bind_members(py::class_<Message>& type) {
  for (const auto& [name, doc] : values_of(Message{}).docs) {
    if (is_of_streams(name)) continue;
    type.def_property_readonly(
        name.c_str(),
        [name = name](const Message& self) {
          return py::object(values_of(self).all[py::str(name)]);
        },
        doc.c_str());
  }
}

constexpr const char* target_doc =
    R"(One of a frame's targets, with members like those of Estimate.

status is ok, or ambiguous where its range is not sure. Deviations (std_) are those with the other
targets unknown too, and the significance (nats) is what this target adds to the others.)";

constexpr const char* estimate_doc =
    R"(One frame's estimate: the members of the frame message, by the names of their columns in tables.

A number that is not known is NaN; std_ is one standard deviation. targets: a list of Target, the
brightest first; the values above are those of the first. findings: a list of dictionaries.
Source: docs/reference/messages.md.)";

}  // namespace

void bind_estimator(py::module_& module) {
  py::class_<FrameMessage::Target> target(module, "Target", target_doc);
  bind_members(target);
  py::class_<FrameMessage> estimated(module, "Estimate", estimate_doc);
  bind_members(estimated);
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
