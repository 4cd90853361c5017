#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <string_view>

#include "daemon/cloud/encoding.hpp"
#include "protocol/error.hpp"

// LAS 1.4 R15 of the ASPRS, point data record format 6, with the columns as extra bytes.

namespace splid::cloud {
namespace {

constexpr unsigned head_bytes = 375;
constexpr unsigned point_bytes = 30;  // without extra bytes
constexpr unsigned point_format = 6;
constexpr unsigned extra_bytes_id = 4;
constexpr unsigned text_id = 3;

// Times count from 1980-01-06 in GPS time, less 1e9 s: global encoding, bit 0. Bit 4 is always set
// with this format of points: a coordinate system would be given as text, and a cloud about the
// lidar has none.
constexpr unsigned global_encoding = 1U << 0U | 1U << 4U;
constexpr double gps_epoch_unix_s = 315'964'800;
constexpr double leap_seconds = 18;  // of GPS time over UTC, since 2017
constexpr double adjustment_s = 1e9;

constexpr double finest_step_m = 1e-4;

// The time of a point is its GPS time, and not an extra byte.
bool is_extra(const Column& column) { return column.kind != Kind::float64; }

void append_name(std::string_view text, std::size_t bytes, std::string& out) {
  out.append(text.substr(0, bytes));
  out.append(bytes - std::min(text.size(), bytes), '\0');
}

void append_record_head(unsigned id, std::size_t bytes, std::string_view what, std::string& out) {
  append_number(0, 2, out);
  append_name("LASF_Spec", 16, out);
  append_number(id, 2, out);
  append_number(bytes, 2, out);
  append_name(what, 32, out);
}

std::string text_record() {
  const std::string text = std::string(axes_in_words) +
                           "; radial_velocity in m/s, receding positive; intensity is 65535 times "
                           "signal_per_pulse, at most 65535; GPS time is UTC + 18 s, mid-dwell";
  std::string record;
  append_record_head(text_id, text.size(), "what the values are", record);
  return record + text;
}

std::string extra_bytes_record() {
  std::string descriptors;
  for (const Column& column : columns) {
    if (!is_extra(column)) continue;
    constexpr unsigned float_type = 9, uint32_type = 5;
    append_number(0, 2, descriptors);
    append_number(column.kind == Kind::uint32 ? uint32_type : float_type, 1, descriptors);
    append_number(0, 1, descriptors);  // no limits, no scale
    append_name(column.name, 32, descriptors);
    constexpr std::size_t unused_bytes = 124;  // limits, scale and offset
    append_name("", unused_bytes, descriptors);
    append_name(column.unit, 32, descriptors);
  }
  std::string record;
  append_record_head(extra_bytes_id, descriptors.size(), "extra bytes of a point", record);
  return record + descriptors;
}

unsigned whole_point_bytes() {
  unsigned bytes = point_bytes;
  for (const Column& column : columns) bytes += is_extra(column) ? bytes_of(column.kind) : 0;
  return bytes;
}

// The day of the first point, so that the same recording gives the same bytes.
void append_day(double unix_s, std::string& out) {
  using namespace std::chrono;
  const auto day = floor<days>(sys_time<seconds>(seconds(std::llround(unix_s))));
  const year_month_day date{day};
  const auto first = sys_days{date.year() / January / 1};
  append_number(static_cast<std::uint64_t>((day - first).count() + 1), 2, out);
  append_number(static_cast<std::uint64_t>(static_cast<int>(date.year())), 2, out);
}

class Las : public Encoding {
 public:
  explicit Las(double largest_range_m) : records_(text_record() + extra_bytes_record()) {
    constexpr double most_steps = std::numeric_limits<std::int32_t>::max();
    while (largest_range_m > step_m_ * most_steps) step_m_ *= 10;
  }

  [[nodiscard]] std::string head(const Summary& cloud) const override {
    std::string out = "LASF";
    append_number(0, 2, out);  // file source
    append_number(global_encoding, 2, out);
    append_name("", 16, out);  // project
    append_number(1, 1, out);
    append_number(4, 1, out);
    append_name("splid", 32, out);
    append_name("splid " SPLID_VERSION, 32, out);
    append_day(cloud.first_time_s, out);
    append_number(head_bytes, 2, out);
    append_number(head_bytes + records_.size(), 4, out);
    append_number(2, 4, out);  // variable-length records
    append_number(point_format, 1, out);
    append_number(whole_point_bytes(), 2, out);
    append_name("", 4 + 5 * 4, out);  // counts of earlier versions
    for (int i = 0; i < 3; ++i) append_double(step_m_, out);
    for (int i = 0; i < 3; ++i) append_double(0, out);
    for (std::size_t i = 0; i < 3; ++i) {
      append_double(in_steps(cloud.most[i]), out);
      append_double(in_steps(cloud.least[i]), out);
    }
    append_name("", 8 + 8 + 4, out);  // no waveforms, no extended records
    append_number(cloud.points, 8, out);
    append_number(cloud.points, 8, out);        // first returns
    append_name("", std::size_t{14} * 8, out);  // further returns
    return out + records_;
  }

  void append(const Point& point, const Summary& /*cloud*/, std::string& out) const override {
    for (const double place : {point.x, point.y, point.z}) append_number(steps(place), 4, out);
    constexpr double full = std::numeric_limits<std::uint16_t>::max();
    const double share = std::clamp(point.signal_per_pulse, 0.0, 1.0);
    append_number(static_cast<std::uint64_t>(std::lround(full * share)), 2, out);
    append_number(0x11, 1, out);  // the first return of one
    append_name("", 7, out);      // flags, class, user's byte, scan angle, source
    append_double(point.time_s - gps_epoch_unix_s + leap_seconds - adjustment_s, out);
    for (const Column& column : columns) {
      if (column.kind == Kind::float32) append_float(point.*column.value, out);
      if (column.kind == Kind::uint32) append_number(point.pixel, 4, out);
    }
  }

 private:
  // A place as it is read again.
  [[nodiscard]] double in_steps(double place_m) const {
    return std::round(place_m / step_m_) * step_m_;
  }
  [[nodiscard]] std::uint32_t steps(double place_m) const {
    const double count = std::round(place_m / step_m_);
    if (!(std::abs(count) <= std::numeric_limits<std::int32_t>::max())) {
      throw Error(
          Fault::data,
          fmt::format("a point at {} m is beyond the {} m of steps of {} m that a .las "
                      "holds; write a .pcd or a .ply",
                      place_m, step_m_ * std::numeric_limits<std::int32_t>::max(), step_m_));
    }
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(count));
  }

  std::string records_;
  double step_m_ = finest_step_m;
};

}  // namespace

std::unique_ptr<Encoding> las_encoding(double largest_range_m) {
  return std::make_unique<Las>(largest_range_m);
}

}  // namespace splid::cloud
