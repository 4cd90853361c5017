#include "tests/support/usb_double.hpp"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <deque>
#include <filesystem>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

namespace splid::test {
namespace {

constexpr const char* root_hub_path = "/devices/usb1";
constexpr std::uint16_t bulk_packet_bytes = 512;

struct Unref {
  template <class Object>
  void operator()(Object* object) const {
    g_object_unref(object);
  }
};
struct UnrefData {
  void operator()(UMockdevIoctlData* data) const { umockdev_ioctl_data_unref(data); }
};
using IoctlData = std::unique_ptr<UMockdevIoctlData, UnrefData>;

void require(bool done, const char* what) {
  if (!done) throw std::runtime_error(std::string{"usb double: "} + what);
}

void append16(std::vector<std::uint8_t>& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
}

std::vector<std::uint8_t> endpoints_of(const UsbDoubleOptions& options, int setting) {
  std::vector<std::uint8_t> all = options.endpoints;
  const std::vector<std::uint8_t>& more = options.endpoints_of_setting_1;
  if (setting == 1) all.insert(all.end(), more.begin(), more.end());
  return all;
}

// Device, configuration, two alternate settings of interface 0.
std::vector<std::uint8_t> descriptors(const UsbDoubleOptions& options) {
  std::vector<std::uint8_t> bytes{18, 1, 0x00, 0x02, 0xFF, 0, 0, 64};
  append16(bytes, options.id.vendor);
  append16(bytes, options.id.product);
  bytes.insert(bytes.end(), {0x00, 0x01, 0, 0, 0, 1});
  const std::size_t endpoints =
      2 * options.endpoints.size() + options.endpoints_of_setting_1.size();
  bytes.insert(bytes.end(), {9, 2});
  append16(bytes, 9 + 2 * 9 + 7 * endpoints);
  bytes.insert(bytes.end(), {1, 1, 0, 0x80, 250});
  for (const std::uint8_t setting : std::array<std::uint8_t, 2>{0, 1}) {
    const std::vector<std::uint8_t> all = endpoints_of(options, setting);
    const auto count = static_cast<std::uint8_t>(all.size());
    bytes.insert(bytes.end(), {9, 4, 0, setting, count, 0xFF, 0, 0, 0});
    for (const std::uint8_t endpoint : all) {
      bytes.insert(bytes.end(), {7, 5, endpoint, 2});
      append16(bytes, bulk_packet_bytes);
      bytes.push_back(0);
    }
  }
  return bytes;
}

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    std::array<char, 4> digits{};
    std::snprintf(digits.data(), digits.size(), "%02X", unsigned{byte});
    text += digits.data();
  }
  return text;
}

// A pseudo-terminal whose slave stands for the device's node: poll() finds it ready while its
// output is not held up, as it finds a usbfs node with finished transfers, and sees an error once
// the master is closed, as after an unplug.
class Gate {
 public:
  Gate() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    require(master_ >= 0 && grantpt(master_) == 0 && unlockpt(master_) == 0, "no terminal");
    std::array<char, 64> name{};
    require(ptsname_r(master_, name.data(), name.size()) == 0, "no terminal's name");
    path_ = name.data();
    slave_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY);
    require(slave_ >= 0, "no terminal's slave");
    termios raw{};
    tcgetattr(slave_, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave_, TCSANOW, &raw);
    tcflow(slave_, TCOOFF);
  }
  ~Gate() {
    ::close(slave_);
    ::close(master_);
  }
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  void set_open(bool open) {
    if (open != open_) tcflow(slave_, open ? TCOON : TCOOFF);
    open_ = open;
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  int master_;
  int slave_ = -1;
  bool open_ = false;
  std::string path_;
};

// A transfer as the driver submitted it.
struct Urb {
  IoctlData urb;
  IoctlData buffer;
  usbdevfs_urb* kernel() const { return reinterpret_cast<usbdevfs_urb*>(urb->data); }
  [[nodiscard]] std::uint8_t endpoint() const { return kernel()->endpoint; }
};

}  // namespace

class UsbDouble::Bus {
 public:
  // beside: whose bus it shares; null: it has one of its own.
  Bus(UsbDoubleOptions options, UsbFirmware& firmware, const Bus* beside, int port)
      : options_(std::move(options)),
        firmware_(firmware),
        testbed_(beside == nullptr ? umockdev_testbed_new()
                                   : UMOCKDEV_TESTBED(g_object_ref(beside->testbed_.get()))),
        device_path_("/devices/usb1/1-" + std::to_string(port)),
        first_number_(2 + (port - 1) * numbers),
        number_(first_number_ - 1) {
    if (beside == nullptr) add_root_hub();
    ticker_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        std::this_thread::sleep_for(std::chrono::milliseconds{1});
        const std::lock_guard lock(mutex_);
        if (gate_ && !flying_.empty()) gate_->set_open(true);
      }
    });
  }

  ~Bus() {
    ticker_ = {};
    if (gate_) unplug();
  }

  void plug() {
    {
      const std::lock_guard lock(mutex_);
      number_ = number_ == first_number_ + numbers - 1 ? first_number_ : number_ + 1;
      setting_ = 0;
      gate_.emplace();
      firmware_.power_on();
    }
    std::array<char, 40> node{};
    std::snprintf(node.data(), node.size(), "/dev/bus/usb/001/%03d", number_);
    handler_.reset(umockdev_ioctl_base_new());
    g_signal_connect(handler_.get(), "handle-ioctl", G_CALLBACK(&Bus::handle), this);
    require(
        umockdev_testbed_attach_ioctl(testbed_.get(), node.data(), handler_.get(), nullptr) != 0,
        "no ioctl");
    node_ = root() + node.data();
    std::filesystem::create_directories(std::filesystem::path(node_).parent_path());
    std::filesystem::remove(node_);
    std::filesystem::create_symlink(gate_->path(), node_);
    add(device_text(node.data()));
  }

  void unplug() {
    {
      const std::lock_guard lock(mutex_);
      for (Urb& urb : flying_) finish(std::move(urb), -ESHUTDOWN, 0);
      flying_.clear();
      gate_.reset();
    }
    const std::string sys = std::string("/sys") + device_path_;
    umockdev_testbed_uevent(testbed_.get(), sys.c_str(), "remove");
    umockdev_testbed_remove_device(testbed_.get(), sys.c_str());
    std::array<char, 40> node{};
    std::snprintf(node.data(), node.size(), "/dev/bus/usb/001/%03d", number_);
    umockdev_testbed_detach_ioctl(testbed_.get(), node.data(), nullptr);
    std::filesystem::remove(node_);
  }

  void set_most_transfers(std::size_t transfers) {
    const std::lock_guard lock(mutex_);
    most_transfers_ = transfers;
  }

  void fail_writes(int status) {
    const std::lock_guard lock(mutex_);
    write_status_ = status;
  }

  std::size_t transfers_in_flight() {
    const std::lock_guard lock(mutex_);
    return flying_.size();
  }

  [[nodiscard]] std::string root() const {
    const std::unique_ptr<gchar, decltype(&g_free)> path(
        umockdev_testbed_get_root_dir(testbed_.get()), g_free);
    return path.get();
  }

 private:
  void add_root_hub() {
    add(std::string("P: ") + root_hub_path +
        "\nN: bus/usb/001/001\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\n"
        "E: DEVNUM=001\nE: DEVNAME=/dev/bus/usb/001/001\nA: busnum=1\\n\nA: devnum=1\\n\n"
        "A: speed=480\\n\nA: bConfigurationValue=1\\n\nA: maxchild=6\\n\nH: descriptors=" +
        hex(descriptors({{0x1d6b, 0x0002}, "", {0x81}})) + "\n");
  }

  void add(const std::string& text) {
    require(umockdev_testbed_add_from_string(testbed_.get(), text.c_str(), nullptr) != 0,
            "no device");
  }

  [[nodiscard]] std::string device_text(const char* node) const {
    const std::string number = std::to_string(number_);
    std::string text = std::string("P: ") + device_path_ +
                       "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\nE: DEVNUM=" +
                       std::string(3 - number.size(), '0') + number + "\nE: DEVNAME=" + node +
                       "\nA: busnum=1\\n\nA: devnum=" + number +
                       "\\n\nA: speed=" + std::to_string(options_.speed_mbit_s) +
                       "\\n\nA: bConfigurationValue=1\\n\n";
    if (!options_.serial.empty()) text += "A: serial=" + options_.serial + "\\n\n";
    return text + "H: descriptors=" + hex(descriptors(options_)) + "\n";
  }

  static gboolean handle(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<Bus*>(self)->serve(client);
  }

  gboolean serve(UMockdevIoctlClient* client) {
    const std::lock_guard lock(mutex_);
    UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(client);
    const auto reply = [&](int error) {
      umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
      return TRUE;
    };
    switch (umockdev_ioctl_client_get_request(client)) {
      case USBDEVFS_GET_CAPABILITIES: {
        const IoctlData caps(umockdev_ioctl_data_resolve(arg, 0, sizeof(std::uint32_t), nullptr));
        const std::uint32_t value = USBDEVFS_CAP_BULK_SCATTER_GATHER |
                                    USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_ZERO_PACKET |
                                    USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        std::memcpy(caps->data, &value, sizeof value);
        return reply(0);
      }
      case USBDEVFS_CLAIMINTERFACE:
      case USBDEVFS_DISCONNECT_CLAIM:
      case USBDEVFS_RELEASEINTERFACE:
        return reply(0);
      case USBDEVFS_GETDRIVER:
        return reply(ENODATA);
      case USBDEVFS_SETINTERFACE: {
        const IoctlData data(
            umockdev_ioctl_data_resolve(arg, 0, sizeof(usbdevfs_setinterface), nullptr));
        usbdevfs_setinterface wanted{};
        std::memcpy(&wanted, data->data, sizeof wanted);
        setting_ = static_cast<int>(wanted.altsetting);
        firmware_.alternate_selected(setting_);
        return reply(gate_ ? 0 : ENODEV);
      }
      case USBDEVFS_CLEAR_HALT: {
        const IoctlData data(umockdev_ioctl_data_resolve(arg, 0, sizeof(unsigned), nullptr));
        unsigned endpoint = 0;
        std::memcpy(&endpoint, data->data, sizeof endpoint);
        firmware_.halt_cleared(static_cast<std::uint8_t>(endpoint));
        return reply(gate_ ? 0 : ENODEV);
      }
      case USBDEVFS_SUBMITURB:
        return reply(submit(arg));
      case USBDEVFS_DISCARDURB:
        return reply(discard(arg));
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY:
        return reply(reap(arg));
      default:
        return reply(ENOTTY);
    }
  }

  int submit(UMockdevIoctlData* arg) {
    if (!gate_) return ENODEV;
    if (flying_.size() >= most_transfers_) return ENOMEM;
    Urb urb;
    urb.urb.reset(umockdev_ioctl_data_resolve(arg, 0, sizeof(usbdevfs_urb), nullptr));
    const auto length = static_cast<std::size_t>(urb.kernel()->buffer_length);
    urb.buffer.reset(umockdev_ioctl_data_resolve(urb.urb.get(), offsetof(usbdevfs_urb, buffer),
                                                 length, nullptr));
    const std::vector<std::uint8_t> known = endpoints_of(options_, setting_);
    if (std::find(known.begin(), known.end(), urb.endpoint()) == known.end()) return ENOENT;
    const bool is_written = (urb.endpoint() & 0x80U) == 0;
    if (is_written && write_status_ == -ENODEV) return ENODEV;
    if (is_written && write_status_ != 0) {
      finish(std::move(urb), write_status_, 0);
    } else if (is_written) {
      firmware_.written(urb.endpoint(), {reinterpret_cast<std::byte*>(urb.buffer->data), length});
      finish(std::move(urb), 0, length);
    } else {
      flying_.push_back(std::move(urb));
    }
    gate_->set_open(true);
    return 0;
  }

  int discard(UMockdevIoctlData* arg) {
    const auto found = std::find_if(flying_.begin(), flying_.end(), [&](const Urb& urb) {
      return urb.urb->client_addr == *reinterpret_cast<gulong*>(arg->data);
    });
    if (found == flying_.end()) return EINVAL;
    finish(std::move(*found), -ENOENT, 0);
    flying_.erase(found);
    if (gate_) gate_->set_open(true);
    return 0;
  }

  int reap(UMockdevIoctlData* arg) {
    if (done_.empty()) serve_next();
    if (done_.empty()) {
      if (!gate_) return ENODEV;
      gate_->set_open(false);
      return EAGAIN;
    }
    const Urb urb = std::move(done_.front());
    done_.pop_front();
    const IoctlData pointer(umockdev_ioctl_data_resolve(arg, 0, sizeof(gpointer), nullptr));
    umockdev_ioctl_data_set_ptr(pointer.get(), 0, urb.urb.get());
    return 0;
  }

  // The oldest transfer of the first endpoint that has something to say.
  void serve_next() {
    std::uint32_t asked = 0;  // a bit an endpoint
    for (auto urb = flying_.begin(); urb != flying_.end(); ++urb) {
      const std::uint32_t bit = 1U << (urb->endpoint() & 0xFU);
      if ((asked & bit) != 0) continue;
      asked |= bit;
      const std::span room(reinterpret_cast<std::byte*>(urb->buffer->data),
                           static_cast<std::size_t>(urb->kernel()->buffer_length));
      const auto answer = firmware_.read(urb->endpoint(), room);
      if (!answer) continue;
      finish(std::move(*urb), answer->status, answer->bytes);
      flying_.erase(urb);
      return;
    }
  }

  void finish(Urb urb, int status, std::size_t bytes) {
    urb.kernel()->status = status;
    urb.kernel()->actual_length = static_cast<int>(bytes);
    done_.push_back(std::move(urb));
  }

  UsbDoubleOptions options_;
  UsbFirmware& firmware_;
  std::unique_ptr<UMockdevTestbed, Unref> testbed_;
  std::unique_ptr<UMockdevIoctlBase, Unref> handler_;
  std::string node_;
  std::string device_path_;
  static constexpr int numbers = 20;  // the kernel counts to 127, and six may share the bus
  int first_number_;
  int number_;  // of the device on the bus; the root hub has 1
  int setting_ = 0;
  int write_status_ = 0;
  std::mutex mutex_;
  std::size_t most_transfers_ = 128;
  std::optional<Gate> gate_;  // while plugged in
  std::deque<Urb> flying_;    // in the order of their submission
  std::deque<Urb> done_;      // to be reaped
  std::jthread ticker_;
};

UsbDouble::UsbDouble(UsbDoubleOptions options, UsbFirmware& firmware)
    : bus_(std::make_unique<Bus>(std::move(options), firmware, nullptr, 1)) {}

UsbDouble::UsbDouble(UsbDoubleOptions options, UsbFirmware& firmware, const UsbDouble& beside,
                     int port)
    : bus_(std::make_unique<Bus>(std::move(options), firmware, beside.bus_.get(), port)) {}

UsbDouble::~UsbDouble() = default;

void UsbDouble::plug() { bus_->plug(); }

void UsbDouble::unplug() { bus_->unplug(); }

void UsbDouble::set_most_transfers(std::size_t transfers) { bus_->set_most_transfers(transfers); }

void UsbDouble::fail_writes(int status) { bus_->fail_writes(status); }

std::size_t UsbDouble::transfers_in_flight() const { return bus_->transfers_in_flight(); }

std::vector<std::string> UsbDouble::environment() const {
  return {"UMOCKDEV_DIR=" + bus_->root(), "LD_PRELOAD=libumockdev-preload.so.0"};
}

}  // namespace splid::test
