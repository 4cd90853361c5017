#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/picoquant_control.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::test {

// What tells the four doubles apart.
struct PicoQuantKind {
  const char* instrument;  // in a configuration
  const char* library;     // the double's file
  const char* model;
  double resolution_ps;
  bool is_picoharp = false;
};

inline const std::array<PicoQuantKind, 4> picoquant_kinds = {{
    {"multiharp", SPLID_DOUBLES "/libmhlib.so", "MultiHarp 150", 5},
    {"hydraharp", SPLID_DOUBLES "/libhhlib.so", "HydraHarp 400", 1},
    {"timeharp260", SPLID_DOUBLES "/libth260lib.so", "TimeHarp 260 P", 25},
    {"picoharp300", SPLID_DOUBLES "/libph300.so", "PicoHarp 300", 4, true},
}};

// An event of a scene: at so many steps of the clock, on input 0 (the sync) or 1, 2, ... of the
// panel; below zero: markers with these bits.
struct PicoQuantEvent {
  std::uint64_t ticks;
  int input;
};

// Steps of the clock from one wrap to the next.
constexpr std::uint64_t picoquant_wrap(bool is_picoharp) {
  return is_picoharp ? 210'698'240 : 1 << 25;
}

// Records of T2 of sorted events, up to the end of the wrap that the last is in.
inline std::vector<std::uint32_t> picoquant_records(const std::vector<PicoQuantEvent>& events,
                                                    bool is_picoharp) {
  const std::uint64_t wrap = picoquant_wrap(is_picoharp);
  const std::uint32_t overflow = is_picoharp ? 15U << 28U : (127U << 25U) | 1U;
  std::vector<std::uint32_t> records;
  std::uint64_t base = 0;
  for (const PicoQuantEvent& event : events) {
    for (; event.ticks >= base + wrap; base += wrap) records.push_back(overflow);
    const auto ticks = static_cast<std::uint32_t>(event.ticks - base);
    const auto input = static_cast<std::uint32_t>(event.input);
    if (is_picoharp) {
      const bool is_marker = event.input < 0;
      records.push_back(is_marker ? (15U << 28U) | (ticks & ~15U) | (0U - input)
                                  : (input << 28U) | ticks);
    } else if (event.input > 0) {
      records.push_back(((input - 1) << 25U) | ticks);
    } else {
      records.push_back((1U << 31U) | ((0U - input) << 25U) | ticks);
    }
  }
  records.push_back(overflow);
  return records;
}

// An instrument of PicoQuant's, behind the double of its library, in this process and in those that
// it starts.
class PicoQuantInstrument {
 public:
  explicit PicoQuantInstrument(const PicoQuantKind& kind) : kind_(kind) {
    const std::string file = folder_.path("control");
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (::ftruncate(descriptor, sizeof(PicoQuantControl)) != 0) throw std::runtime_error(file);
    void* place = ::mmap(nullptr, sizeof(PicoQuantControl), PROT_READ | PROT_WRITE, MAP_SHARED,
                         descriptor, 0);
    ::close(descriptor);
    if (place == MAP_FAILED) throw std::runtime_error(file);
    control_ = new (place) PicoQuantControl;
    ::setenv("SPLID_PICOQUANT_DOUBLE", file.c_str(), 1);
    text(control_->library_version, "3.1");
    text(control_->model, kind.model);
    control_->resolution_ps = kind.resolution_ps;
    plug("1045678");
  }
  ~PicoQuantInstrument() {
    ::unsetenv("SPLID_PICOQUANT_DOUBLE");
    ::munmap(control_, sizeof *control_);
  }
  PicoQuantInstrument(const PicoQuantInstrument&) = delete;
  PicoQuantInstrument& operator=(const PicoQuantInstrument&) = delete;

  PicoQuantControl& control() { return *control_; }
  [[nodiscard]] const PicoQuantKind& kind() const { return kind_; }
  template <std::size_t size>
  static void text(std::array<char, size>& place, const std::string& words) {
    place.fill('\0');
    words.copy(place.data(), size - 1);
  }
  // Empty: unplugs it.
  void plug(const std::string& serial, std::size_t index = 0) {
    text(control_->serials.at(index), serial);
  }
  // What it was told so far.
  [[nodiscard]] std::string log() const { return {control_->log.data(), control_->log_bytes}; }

  void give(const std::vector<std::uint32_t>& records) {
    std::string bytes(records.size() * sizeof records[0], '\0');
    std::memcpy(bytes.data(), records.data(), bytes.size());
    give_file(folder_.write("records", bytes), 0);
  }
  void give_file(const std::string& file, std::uint64_t offset) {
    text(control_->records_file, file);
    control_->records_offset = offset;
  }
  // A target at rest, for ever, on input 1: a sync each period, a quarter of a period after every
  // second sync a photon, and so many photons of ambient light at any time of a period.
  void give_scene(int ambient = 0) {
    constexpr std::uint64_t wraps = 64;
    const std::uint64_t period = picoquant_wrap(kind_.is_picoharp) / periods_a_wrap;
    std::mt19937 random(7);
    std::vector<PicoQuantEvent> events;
    for (std::uint64_t k = 0; k < wraps * periods_a_wrap; ++k) {
      events.push_back({k * period, 0});
      if (random() % 2 == 0) events.push_back({k * period + period / 4 + random() % 16, 1});
      for (int i = 0; i < ambient; ++i) events.push_back({k * period + random() % period, 1});
    }
    const auto is_before = [](const PicoQuantEvent& a, const PicoQuantEvent& b) {
      return a.ticks < b.ticks;
    };
    std::sort(events.begin(), events.end(), is_before);
    give(picoquant_records(events, kind_.is_picoharp));
    control_->loops = true;
  }
  [[nodiscard]] double scene_period_ps() const {
    return static_cast<double>(picoquant_wrap(kind_.is_picoharp) / periods_a_wrap) *
           kind_.resolution_ps;
  }

 private:
  static constexpr std::uint64_t periods_a_wrap = 32;

  PicoQuantKind kind_;
  TempFolder folder_;
  PicoQuantControl* control_ = nullptr;
};

}  // namespace splid::test
