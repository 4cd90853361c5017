#include "protocol/frame_columns.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "protocol/json_writer.hpp"

namespace splid {
namespace {

// Is shown each column with its value in a message, in the order of the columns.
class ColumnVisitor {
 public:
  virtual ~ColumnVisitor() = default;
  virtual void number(const char* name, const char* unit, std::optional<double> value) = 0;
  virtual void integer(const char* name, const char* unit, std::optional<std::int64_t> value) = 0;
  virtual void flag(const char* name, bool value) = 0;
  // bytes: room for the longest text.
  virtual void text(const char* name, std::size_t bytes, std::string_view value) = 0;
};

constexpr std::size_t name_bytes = 16;  // the longest name, pattern_fault's stray_pulses, has 12

std::optional<std::int64_t> whole(std::optional<std::uint64_t> value) {
  return value ? std::optional(static_cast<std::int64_t>(*value)) : std::nullopt;
}

void show_estimates(const FrameMessage& message, ColumnVisitor& columns) {
  columns.number("distance_m", "m", message.distance_m);
  columns.number("velocity_mps", "m/s", message.velocity_mps);
  columns.number("acceleration_mps2", "m/s2", message.acceleration_mps2);
  columns.number("signal_per_pulse", "counts/pulse", message.signal_per_pulse);
  columns.number("background_per_s", "counts/s", message.background_per_s);
  columns.number("signal_per_period", "counts/period", message.signal_per_period);
  columns.number("background_per_period", "counts/period", message.background_per_period);
  columns.number("sbr", "", message.sbr);
  columns.number("delay_ns", "ns", message.delay_ns);
  columns.number("significance", "nats", message.significance);
  columns.number("range_odds_nats", "nats", message.range_odds_nats);
  columns.number("amplitude_misfit", "", message.amplitude_misfit);
  columns.number("pulse_misfit", "", message.pulse_misfit);
  columns.number("pulse_excess", "", message.pulse_excess);
  columns.number("acceleration_misfit_mps2", "m/s2", message.acceleration_misfit_mps2);
  columns.number("jerk_misfit_mps3", "m/s3", message.jerk_misfit_mps3);
  columns.number("path_excess", "", message.path_excess);
  columns.number("signal_gap", "", message.signal_gap);
  columns.number("pulse_sigma_ps", "ps", message.pulse_sigma_ps);
  columns.number("shape_misfit", "", message.shape_misfit);
  columns.number("pulse_skew", "", message.pulse_skew);
  columns.number("blind_fraction", "", message.blind_fraction);
  columns.number("dead_time_misfit_ns", "ns", message.dead_time_misfit_ns);
  columns.number("afterpulse_misfit", "", message.afterpulse_misfit);
  columns.number("flicker_misfit", "", message.flicker_misfit);
  columns.text("pattern_fault", name_bytes,
               message.pattern_fault ? to_string(*message.pattern_fault) : "");
  columns.number("std_distance_m", "m", message.std_distance_m);
  columns.number("std_velocity_mps", "m/s", message.std_velocity_mps);
  columns.number("std_acceleration_mps2", "m/s2", message.std_acceleration_mps2);
  columns.number("std_signal_per_pulse", "counts/pulse", message.std_signal_per_pulse);
  columns.number("std_background_per_s", "counts/s", message.std_background_per_s);
  columns.number("std_pulse_excess", "", message.std_pulse_excess);
  columns.number("std_pulse_sigma_ps", "ps", message.std_pulse_sigma_ps);
  columns.number("std_pulse_skew", "", message.std_pulse_skew);
}

void show_sync(const FrameMessage& message, ColumnVisitor& columns) {
  const bool known = message.sync.has_value();
  const FrameMessage::Sync sync = message.sync.value_or(FrameMessage::Sync{});
  const auto count = [known](std::uint64_t value) {
    return known ? whole(value) : std::optional<std::int64_t>{};
  };
  columns.integer("sync_count", "", count(sync.count));
  columns.integer("sync_missing", "", count(sync.missing));
  columns.integer("sync_spurious", "", count(sync.spurious));
  columns.number("sync_period_ps", "ps", sync.period_ps);
  columns.number("sync_drift_ppm", "ppm", sync.drift_ppm);
  columns.number("sync_jitter_ps", "ps", sync.jitter_ps);
}

void show(const FrameMessage& message, ColumnVisitor& columns) {
  columns.number("timestamp", "s", message.timestamp_s);
  columns.integer("sequence", "", whole(message.sequence));
  columns.text("status", name_bytes, to_string(message.status));
  columns.flag("valid", message.valid());
  columns.text("mode", name_bytes, to_string(message.mode));
  columns.integer("start_ps", "ps", message.start_ps);
  columns.number("duration_ms", "ms", message.duration_ms);
  show_estimates(message, columns);
  columns.integer("photons", "", whole(message.photons));
  columns.integer("lost_tags", "", whole(message.lost_tags));
  columns.integer("uncounted_losses", "", whole(message.uncounted_losses));
  columns.number("seen_fraction", "", message.seen_fraction);
  show_sync(message, columns);
  const auto reference = message.reference.value_or(FrameMessage::Reference{});
  columns.number("reference_distance_m", "m", reference.distance_m);
  columns.number("reference_velocity_mps", "m/s", reference.velocity_mps);
  columns.text("effort", name_bytes, message.effort.value_or(""));
  columns.number("compute_ms", "ms", message.compute_ms);
  columns.number("latency_ms", "ms", message.latency_ms);
}

class Describer final : public ColumnVisitor {
 public:
  void number(const char* name, const char* unit, std::optional<double> /*value*/) override {
    add(name, unit, ColumnType::number, sizeof(double));
  }
  void integer(const char* name, const char* unit, std::optional<std::int64_t> /*value*/) override {
    add(name, unit, ColumnType::integer, sizeof(std::int64_t));
  }
  void flag(const char* name, bool /*value*/) override { add(name, "", ColumnType::flag, 1); }
  void text(const char* name, std::size_t bytes, std::string_view /*value*/) override {
    add(name, "", ColumnType::text, bytes);
  }
  std::vector<FrameColumn> columns;

 private:
  void add(const char* name, const char* unit, ColumnType type, std::size_t bytes) {
    const std::size_t offset = columns.empty() ? 0 : columns.back().offset + columns.back().bytes;
    columns.push_back({name, unit, type, offset, bytes});
  }
};

class RowWriter final : public ColumnVisitor {
 public:
  explicit RowWriter(std::string& rows) : rows_(rows) {}
  void number(const char* /*name*/, const char* /*unit*/, std::optional<double> value) override {
    const bool known = value && std::isfinite(*value);
    put(known ? *value : std::numeric_limits<double>::quiet_NaN());
  }
  void integer(const char* /*name*/, const char* /*unit*/,
               std::optional<std::int64_t> value) override {
    put(value.value_or(-1));
  }
  void flag(const char* /*name*/, bool value) override { rows_ += value ? '\1' : '\0'; }
  void text(const char* /*name*/, std::size_t bytes, std::string_view value) override {
    value = value.substr(0, bytes);
    rows_.append(value).append(bytes - value.size(), '\0');
  }

 private:
  template <class Value>
  void put(Value value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    rows_.append(bytes, sizeof value);
  }
  std::string& rows_;
};

class CsvWriter final : public ColumnVisitor {
 public:
  void number(const char* /*name*/, const char* /*unit*/, std::optional<double> value) override {
    put(value && std::isfinite(*value) ? number_text(*value) : "");
  }
  void integer(const char* /*name*/, const char* /*unit*/,
               std::optional<std::int64_t> value) override {
    put(value ? std::to_string(*value) : "");
  }
  void flag(const char* /*name*/, bool value) override { put(value ? "true" : "false"); }
  // No text of a message has a comma, a quote or a line feed: they are names.
  void text(const char* /*name*/, std::size_t /*bytes*/, std::string_view value) override {
    put(value);
  }
  [[nodiscard]] std::string line() const { return line_ + "\n"; }

 private:
  void put(std::string_view value) {
    if (!first_) line_ += ',';
    first_ = false;
    line_ += value;
  }
  std::string line_;
  bool first_ = true;
};

}  // namespace

const std::vector<FrameColumn>& frame_columns() {
  static const std::vector<FrameColumn> all = [] {
    Describer describer;
    show({}, describer);
    return describer.columns;
  }();
  return all;
}

std::size_t frame_row_bytes() {
  return frame_columns().back().offset + frame_columns().back().bytes;
}

void append_frame_row(const FrameMessage& message, std::string& rows) {
  RowWriter writer(rows);
  show(message, writer);
}

std::string frame_csv_head() {
  std::string line;
  for (const FrameColumn& column : frame_columns()) {
    if (!line.empty()) line += ',';
    line += column.name;
  }
  return line + "\n";
}

std::string frame_csv_row(const FrameMessage& message) {
  CsvWriter writer;
  show(message, writer);
  return writer.line();
}

}  // namespace splid
