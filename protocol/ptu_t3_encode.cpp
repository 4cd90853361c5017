#include "protocol/ptu_t3_encode.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/record_decoder.hpp"

namespace splid {
namespace {

constexpr std::uint64_t t3_wrap = 1024;
constexpr std::uint64_t t3_most_overflows = 1023;  // that one record counts
constexpr std::uint32_t t3_special = 1U << 31U;
constexpr std::uint32_t t3_overflow = t3_special | 63U << 25U;
constexpr double t3_most_steps = 32'767;  // this time stands for any later one
constexpr int t3_most_input = 63;

}  // namespace

PtuT3Encoder::PtuT3Encoder(std::int64_t period_ps, double step_ps)
    : period_ps_(period_ps), step_ps_(step_ps) {}

void PtuT3Encoder::append(std::uint32_t record, std::vector<std::byte>& out) {
  for (unsigned shift = 0; shift < 32; shift += 8) {
    out.push_back(static_cast<std::byte>(record >> shift & 0xFFU));
  }
  ++records_;
}

void PtuT3Encoder::reject(std::int64_t time_ps) {
  ++rejected_;
  losses_.add_missed(time_ps, 1);
}

void PtuT3Encoder::put(const Tag& tag, std::vector<std::byte>& out) {
  const auto number = static_cast<std::uint64_t>(sync_ps_ / period_ps_);
  const double since_ps = static_cast<double>(tag.time_ps - sync_ps_);
  const bool is_photon = tag.kind != TagKind::marker;
  const int input = tag.kind == TagKind::missed ? input_of_untimed(tag) : tag.value;
  const bool fits = input >= (is_photon ? 0 : 1) && input <= (is_photon ? t3_most_input : 15);
  if (!fits || since_ps < 0 || number < overflows_ * t3_wrap) {
    reject(tag.time_ps);
    return;
  }
  while (number - overflows_ * t3_wrap >= t3_wrap) {
    const std::uint64_t count = std::min(number / t3_wrap - overflows_, t3_most_overflows);
    append(t3_overflow | static_cast<std::uint32_t>(count), out);
    overflows_ += count;
  }
  const double steps =
      tag.kind == TagKind::missed ? t3_most_steps : std::round(since_ps / step_ps_);
  const auto time = static_cast<std::uint32_t>(is_photon ? std::min(steps, t3_most_steps) : 0);
  append((is_photon ? 0 : t3_special) | static_cast<std::uint32_t>(input) << 25U | time << 10U |
             static_cast<std::uint32_t>(number % t3_wrap),
         out);
}

void PtuT3Encoder::encode(std::span<const Tag> tags, std::vector<std::byte>& out) {
  for (const Tag& tag : tags) {
    switch (tag.kind) {
      case TagKind::sync:
        sync_ps_ = tag.time_ps;
        break;
      case TagKind::photon:
      case TagKind::marker:
      case TagKind::missed:
        put(tag, out);
        break;
      case TagKind::heartbeat:
      case TagKind::loss_begin:
      case TagKind::loss_end:
      case TagKind::clock_break:
        losses_.take(tag);
        break;
    }
  }
}

}  // namespace splid
