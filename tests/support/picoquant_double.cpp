// A double of PicoQuant's libraries for tests: their entry points, with instruments, records and
// faults as a PicoQuantControl says. It is compiled four times, with the prefix of each library:
//
//   SPLID_PICOQUANT_PREFIX    MH_, HH_, TH260_ or PH_
//   SPLID_PICOQUANT_FAMILY    0, 1, 2 or 3, in this order

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "tests/support/picoquant_control.hpp"

#define SPLID_JOIN_2(a, b) a##b
#define SPLID_JOIN(a, b) SPLID_JOIN_2(a, b)
#define ENTRY(name) extern "C" int SPLID_JOIN(SPLID_PICOQUANT_PREFIX, name)

namespace {

using splid::test::PicoQuantControl;
using Clock = std::chrono::steady_clock;

constexpr int family = SPLID_PICOQUANT_FAMILY;
constexpr bool is_multiharp = family == 0;
constexpr bool is_hydraharp = family == 1;
constexpr bool is_timeharp = family == 2;
constexpr bool is_picoharp = family == 3;

constexpr int most_a_read = is_multiharp ? 1'048'576 : 131'072;
constexpr int flag_fifo_full = is_picoharp ? 0x0003 : 0x0002;
constexpr std::uint64_t wrap = is_picoharp ? 210'698'240 : 1 << 25;

// Records are handed out by this many, so that one time for all of them is enough.
constexpr std::size_t group = 256;

PicoQuantControl* control = nullptr;

PicoQuantControl* map_control() {
  const char* file = std::getenv("SPLID_PICOQUANT_DOUBLE");
  const int descriptor = file == nullptr ? -1 : ::open(file, O_RDWR | O_CLOEXEC);
  void* place =
      ::mmap(nullptr, sizeof(PicoQuantControl), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  if (place == MAP_FAILED) std::abort();
  return static_cast<PicoQuantControl*>(place);
}

template <class... Values>
void log(const char* name, Values... values) {
  std::string line = name;
  ((line += " " + std::to_string(values)), ...);
  line += '\n';
  const std::uint32_t at = control->log_bytes.load();
  if (at + line.size() > control->log.size()) return;
  line.copy(&control->log[at], line.size());
  control->log_bytes = at + static_cast<std::uint32_t>(line.size());
}

// One measurement: the file's records, and up to which of them the clock has come.
class Records {
 public:
  void load() {
    records_.clear();
    times_.clear();
    std::FILE* file = std::fopen(control->records_file.data(), "rb");
    if (file == nullptr) return;
    std::fseek(file, 0, SEEK_END);
    const long end = std::ftell(file);
    const auto from = static_cast<long>(control->records_offset);
    records_.resize(static_cast<std::size_t>(std::max(end - from, 0L)) / sizeof records_[0]);
    std::fseek(file, from, SEEK_SET);
    records_.resize(std::fread(records_.data(), sizeof records_[0], records_.size(), file));
    std::fclose(file);
    std::uint64_t base = 0;
    for (std::size_t i = 0; i < records_.size(); ++i) {
      const std::uint64_t time = base + time_of(records_[i], base);
      if (i % group == group - 1 || i + 1 == records_.size()) times_.push_back(time);
    }
    length_ = base;
  }

  void begin() {
    begun_ = Clock::now();
    at_ = 0;
    round_ = 0;
  }

  // How many records there are that were not read.
  [[nodiscard]] std::uint64_t waiting() const {
    if (records_.empty()) return 0;
    if (control->speed == 0) return control->loops ? most_a_read : records_.size() - at_;
    const std::chrono::duration<double> passed = Clock::now() - begun_;
    const auto ticks =
        static_cast<std::uint64_t>(passed.count() * control->speed * 1e12 / control->resolution_ps);
    const std::uint64_t round = control->loops ? ticks / length_ : 0;
    const std::uint64_t rest = ticks - round * length_;
    const auto groups = std::upper_bound(times_.begin(), times_.end(), rest) - times_.begin();
    const std::uint64_t of_round =
        std::min(static_cast<std::size_t>(groups) * group, records_.size());
    const std::uint64_t all = round * records_.size() + of_round;
    return all - std::min(all, round_ * records_.size() + at_);
  }

  int read(unsigned int* buffer, std::uint64_t most) {
    std::uint64_t count = std::min(waiting(), most);
    const std::uint64_t given = count;
    while (count > 0) {
      if (at_ == records_.size()) {
        at_ = 0;
        ++round_;
      }
      const std::size_t some = std::min<std::uint64_t>(count, records_.size() - at_);
      std::memcpy(buffer, &records_[at_], some * sizeof records_[0]);
      at_ += some;
      buffer += some;
      count -= some;
    }
    return static_cast<int>(given);
  }

 private:
  // Since the last wrap; a record of wraps moves `base` on.
  static std::uint64_t time_of(std::uint32_t record, std::uint64_t& base) {
    if (is_picoharp) {
      if (record >> 28U != 15) return record & 0xFFFFFFFU;
      if ((record & 15U) == 0) base += wrap;
      return (record & 15U) == 0 ? 0 : record & 0xFFFFFF0U;
    }
    if (record >> 25U != 127) return record & 0x1FFFFFFU;
    base += wrap * std::max(record & 0x1FFFFFFU, 1U);
    return 0;
  }

  std::vector<unsigned int> records_;
  std::vector<std::uint64_t> times_;  // of the last record of each group
  std::uint64_t length_ = 1;
  Clock::time_point begun_;
  std::size_t at_ = 0;
  std::uint64_t round_ = 0;
};

Records records;
bool is_measuring = false;
bool fifo_is_full = false;
bool has_ended = false;
int open_index = -1;

// The code of a call of an open instrument.
int code(int index) {
  constexpr int not_open = -10;
  if (index != open_index) return not_open;
  const bool is_plugged_in = control->serials.at(static_cast<std::size_t>(index))[0] != '\0';
  constexpr int bulk_read_failed = -37;
  return is_plugged_in ? control->failing_code.load() : bulk_read_failed;
}

template <class... Values>
int told(int index, const char* name, Values... values) {
  log(name, values...);
  return code(index);
}

int read_fifo(int index, unsigned int* buffer, int most, int* count) {
  *count = 0;
  if (control->crashes.exchange(0) != 0) std::raise(SIGSEGV);
  if (control->hangs.load() != 0) ++control->hung;
  while (control->hangs.load() != 0) ::usleep(1000);
  if (code(index) < 0 || !is_measuring) return code(index);
  if (control->is_silent.load() != 0) return 0;
  const std::uint64_t waiting = records.waiting();
  if (control->fifo_is_full.exchange(0) != 0 || waiting > control->fifo_records) {
    fifo_is_full = true;
    ++control->was_full;
  }
  if (control->measurement_ends.exchange(0) != 0) has_ended = true;
  if (has_ended) return 0;
  const int shortened = control->most_a_read.load();
  if (shortened > 0) most = std::min(most, shortened);
  *count = records.read(buffer, static_cast<std::uint64_t>(most));
  if (control->garbage_reads.load() > 0) {
    --control->garbage_reads;
    *count = std::max(*count, 1000);
    for (int i = 0; i < *count; ++i) buffer[i] = static_cast<unsigned>(i + 1) * 2'654'435'761U;
  }
  control->records += static_cast<std::uint64_t>(*count);
  return 0;
}

}  // namespace

ENTRY(GetLibraryVersion)(char* version) {
  if (control != nullptr) ::munmap(control, sizeof *control);
  control = map_control();
  std::strcpy(version, control->library_version.data());
  return 0;
}

ENTRY(GetErrorString)(char* words, int code) {
  switch (code) {
    case -1:
      std::strcpy(words, "DEVICE_OPEN_FAIL");
      break;
    case -2:
      std::strcpy(words, "DEVICE_BUSY");
      break;
    case -17:
      std::strcpy(words, "INVALID_ARGUMENT");
      break;
    case -37:
      std::strcpy(words, "USB_BULKRD_FAIL");
      break;
    case -46:
      std::strcpy(words, "CALIB_FAIL");
      break;
    default:
      return -1;
  }
  return 0;
}

ENTRY(OpenDevice)(int index, char* serial) {
  const auto& found = control->serials.at(static_cast<std::size_t>(index));
  if (found[0] == '\0') return -1;
  if (control->open_code < 0) return control->open_code;
  std::strcpy(serial, found.data());
  open_index = index;
  return 0;
}

ENTRY(CloseDevice)(int index) {
  log("CloseDevice", index);
  is_measuring = false;
  open_index = -1;
  return 0;
}

#if SPLID_PICOQUANT_FAMILY < 2
ENTRY(Initialize)(int index, int mode, int reference) {
  return told(index, "Initialize", mode, reference);
}
#else
ENTRY(Initialize)(int index, int mode) { return told(index, "Initialize", mode); }
#endif

ENTRY(GetHardwareInfo)(int index, char* model, char* part, char* version) {
  std::strcpy(model, control->model.data());
  std::strcpy(part, "930000");
  std::strcpy(version, "1.0");
  return code(index);
}

ENTRY(GetResolution)(int index, double* resolution_ps) {
  *resolution_ps = control->resolution_ps;
  return code(index);
}

ENTRY(SetSyncDiv)(int index, int divider) { return told(index, "SetSyncDiv", divider); }

ENTRY(SetMarkerEdges)(int index, int a, int b, int c, int d) {
  return told(index, "SetMarkerEdges", a, b, c, d);
}

ENTRY(SetMarkerEnable)(int index, int a, int b, int c, int d) {
  return told(index, "SetMarkerEnable", a, b, c, d);
}

ENTRY(SetInputCFD)(int index, int channel, int level, int zero_cross) {
  return told(index, "SetInputCFD", channel, level, zero_cross);
}

#if SPLID_PICOQUANT_FAMILY == 3
ENTRY(SetSyncOffset)(int index, int offset) { return told(index, "SetSyncOffset", offset); }
#else
ENTRY(GetNumOfInputChannels)(int index, int* inputs) {
  *inputs = control->inputs;
  return code(index);
}
ENTRY(SetSyncCFD)(int index, int level, int zero_cross) {
  return told(index, "SetSyncCFD", level, zero_cross);
}
ENTRY(SetSyncEdgeTrg)(int index, int level, int edge) {
  return told(index, "SetSyncEdgeTrg", level, edge);
}
ENTRY(SetSyncChannelOffset)(int index, int offset) {
  return told(index, "SetSyncChannelOffset", offset);
}
ENTRY(SetInputEdgeTrg)(int index, int channel, int level, int edge) {
  return told(index, "SetInputEdgeTrg", channel, level, edge);
}
ENTRY(SetInputChannelOffset)(int index, int channel, int offset) {
  return told(index, "SetInputChannelOffset", channel, offset);
}
ENTRY(SetInputChannelEnable)(int index, int channel, int enable) {
  return told(index, "SetInputChannelEnable", channel, enable);
}
ENTRY(GetSyncRate)(int index, int* rate) {
  *rate = 264'550;
  return code(index);
}
#endif

#if SPLID_PICOQUANT_FAMILY == 0
ENTRY(SetOflCompression)(int index, int hold_ms) {
  return told(index, "SetOflCompression", hold_ms);
}
#endif

#if SPLID_PICOQUANT_FAMILY == 1 || SPLID_PICOQUANT_FAMILY == 3
ENTRY(Calibrate)(int index) { return told(index, "Calibrate"); }
#endif

ENTRY(StartMeas)(int index, int length_ms) {
  ++control->starts;
  records.load();
  records.begin();
  is_measuring = true;
  fifo_is_full = has_ended = false;
  return told(index, "StartMeas", length_ms);
}

ENTRY(StopMeas)(int index) {
  is_measuring = false;
  return told(index, "StopMeas");
}

ENTRY(CTCStatus)(int index, int* ended) {
  *ended = has_ended ? 1 : 0;
  return code(index);
}

ENTRY(GetFlags)(int index, int* flags) {
  *flags = control->flags | (fifo_is_full ? flag_fifo_full : 0);
  return code(index);
}

ENTRY(GetCountRate)(int index, int, int* rate) {
  *rate = 1000;
  return code(index);
}

ENTRY(GetWarnings)(int index, int* warnings) {
  *warnings = control->warnings;
  return code(index);
}

ENTRY(GetWarningsText)(int index, char* text, int) {
  std::strcpy(text, "Sync rate is zero.\n\nAn input rate is too high.\n");
  return code(index);
}

#if SPLID_PICOQUANT_FAMILY == 0
ENTRY(ReadFiFo)(int index, unsigned int* buffer, int* count) {
  return read_fifo(index, buffer, most_a_read, count);
}
#else
ENTRY(ReadFiFo)(int index, unsigned int* buffer, int most, int* count) {
  constexpr int invalid_argument = -17;
  if (most > most_a_read) return invalid_argument;
  return read_fifo(index, buffer, most, count);
}
#endif
