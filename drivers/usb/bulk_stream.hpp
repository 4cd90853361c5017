#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/usb/block_queue.hpp"
#include "drivers/usb/usb_device.hpp"
#include "drivers/wake.hpp"

struct libusb_transfer;

namespace splid::usb {

// What came of the transfers. Any thread may read these; libusb's event thread writes them.
struct Counters {
  static constexpr std::size_t statuses = 7;
  std::array<std::atomic<std::uint64_t>, statuses> transfers{};  // index: libusb_transfer_status
  std::atomic<std::uint64_t> bytes{0};
  std::atomic<std::uint64_t> dropped_bytes{0};  // no room in the queue
  std::atomic<std::uint64_t> reopens{0};        // times a device was opened again
};

// Names for the index of usb::Counters::transfers.
const char* transfer_status_name(std::size_t status);

// Asynchronous transfers from a bulk IN endpoint, so many in flight that the device never waits. A
// finished transfer is copied into the queue and submitted again, and nothing else is done with it.
// After a failed transfer, bytes may be missing: that is a cut in the queue. A transfer that cannot
// be submitted again, because the endpoint stalled, the device is gone, or too many transfers have
// failed, stays down, and trouble() says why; stop() and start() bring it back where that helps.
//
// Threads: the event thread runs the callbacks; everything else is called by the owner. Errors:
// usb::DeviceError.
class BulkStream {
 public:
  enum Trouble : unsigned {
    none = 0,
    stalled = 1,  // the endpoint is halted until clear_halt()
    no_room = 2,  // the kernel has no memory for another transfer
    failing = 4,  // max_failures transfers in a row have failed
    gone = 8,     // the device was unplugged
  };

  static constexpr int max_failures = 100;

  // device, queue, counters and wake (notified when there is something to do) outlive this object.
  // transfer_bytes: length of each transfer; it is rounded up to whole packets, so that a device
  // cannot send more than there is room for.
  BulkStream(const Device& device, std::uint8_t endpoint, std::size_t transfer_bytes,
             BlockQueue& queue, Counters& counters, Wake& wake);
  // Stops first. Transfers that do not come back are left to the kernel and never freed.
  ~BulkStream();
  BulkStream(const BulkStream&) = delete;
  BulkStream& operator=(const BulkStream&) = delete;

  // Puts so many transfers in flight; where the kernel has no room for them, half as many, and so
  // on. Returns how many are in flight. Call it when none is.
  std::size_t start(std::size_t transfers);
  // Cancels all transfers and waits until all are back; false where they are not within 1 s.
  bool stop();

  [[nodiscard]] unsigned trouble() const;
  // How often the endpoint stalled. A stall is one cut in the queue, however many transfers it
  // ended.
  [[nodiscard]] std::uint32_t stalls() const;
  // The reason why the last failed transfer failed, such as "overflow".
  [[nodiscard]] const char* last_failure() const;

 private:
  struct Flight;

  bool submit_all(std::size_t transfers);
  bool submit_first(libusb_transfer& transfer);

  const Device& device_;
  std::unique_ptr<Flight> flight_;
};

}  // namespace splid::usb
