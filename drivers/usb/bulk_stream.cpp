#include "drivers/usb/bulk_stream.hpp"

#include <libusb.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "drivers/usb/usb_error.hpp"

namespace splid::usb {
namespace {

struct FreeTransfer {
  void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
};

struct Transfer {
  std::unique_ptr<libusb_transfer, FreeTransfer> transfer;
  std::unique_ptr<std::byte[]> buffer;
};

void count(std::atomic<std::uint64_t>& counter, std::uint64_t more) {
  counter.fetch_add(more, std::memory_order_relaxed);
}

std::size_t whole_packets(std::size_t bytes, std::size_t packet_bytes) {
  return (bytes + packet_bytes - 1) / packet_bytes * packet_bytes;
}

}  // namespace

const char* transfer_status_name(std::size_t status) {
  constexpr std::array<const char*, Counters::statuses> names = {
      "completed", "error", "timed_out", "cancelled", "stall", "no_device", "overflow"};
  return names.at(status);
}

// All that the callbacks touch, in one object, which can outlive a BulkStream whose transfers do
// not come back.
struct BulkStream::Flight {
  libusb_device_handle* handle;
  std::uint8_t endpoint;
  std::size_t transfer_bytes;
  BlockQueue& queue;
  Counters& counters;
  Wake& wake;
  std::vector<Transfer> transfers{};
  std::atomic<std::size_t> flying{0};
  std::atomic<bool> stopping{false};
  std::atomic<unsigned> trouble{none};
  std::atomic<std::uint32_t> stalls{0};
  std::atomic<int> last_failure{LIBUSB_TRANSFER_ERROR};
  int failures_in_row = 0;  // event thread only, while transfers are in flight

  static void LIBUSB_CALL finished(libusb_transfer* transfer) {
    static_cast<Flight*>(transfer->user_data)->take(*transfer);
  }

  void take(libusb_transfer& transfer) {
    count(counters.transfers.at(transfer.status), 1);
    if (transfer.actual_length > 0) {
      const auto length = static_cast<std::size_t>(transfer.actual_length);
      count(counters.bytes, length);
      const auto* bytes = reinterpret_cast<const std::byte*>(transfer.buffer);
      if (!queue.push({bytes, length})) count(counters.dropped_bytes, length);
    }
    if (judge(transfer) && !stopping.load(std::memory_order_relaxed) && submit(transfer)) {
      wake.notify();
      return;
    }
    // Once the owner sees zero it may destroy this object, so only the wake is touched after that.
    Wake& owner = wake;
    flying.fetch_sub(1, std::memory_order_release);
    owner.notify();
  }

  // Whether the transfer may be submitted again.
  bool judge(const libusb_transfer& transfer) {
    switch (transfer.status) {
      case LIBUSB_TRANSFER_COMPLETED:
        failures_in_row = 0;
        return true;
      case LIBUSB_TRANSFER_CANCELLED:
        return false;
      case LIBUSB_TRANSFER_NO_DEVICE:
        trouble |= gone;
        return false;
      case LIBUSB_TRANSFER_STALL:
        // A stall ends all transfers in flight, of which only the first was being filled.
        if ((trouble.fetch_or(stalled) & stalled) == 0) {
          ++stalls;  // before the cut, so that whoever sees the cut also sees the stall
          queue.cut();
        }
        return false;
      default:
        fail(transfer.status);
        if (++failures_in_row < max_failures) return true;
        trouble |= failing;
        return false;
    }
  }

  void fail(int status) {
    last_failure.store(status, std::memory_order_relaxed);
    queue.cut();
  }

  bool submit(libusb_transfer& transfer) {
    const int code = libusb_submit_transfer(&transfer);
    if (code == 0) return true;
    trouble |= code == LIBUSB_ERROR_NO_DEVICE ? gone
               : code == LIBUSB_ERROR_NO_MEM  ? no_room
                                              : failing;
    return false;
  }

  void add_transfer() {
    Transfer added{decltype(Transfer::transfer)(libusb_alloc_transfer(0)),
                   std::make_unique_for_overwrite<std::byte[]>(transfer_bytes)};
    libusb_fill_bulk_transfer(added.transfer.get(), handle, endpoint,
                              reinterpret_cast<unsigned char*>(added.buffer.get()),
                              static_cast<int>(transfer_bytes), finished, this, 0);
    transfers.push_back(std::move(added));
  }
};

BulkStream::BulkStream(const Device& device, std::uint8_t endpoint, std::size_t transfer_bytes,
                       BlockQueue& queue, Counters& counters, Wake& wake)
    : device_(device),
      flight_(new Flight{device.handle(), endpoint,
                         whole_packets(transfer_bytes, device.max_packet_bytes(endpoint)), queue,
                         counters, wake}) {}

BulkStream::~BulkStream() {
  // To free memory that the kernel may still write to would be worse than to keep it.
  if (!stop()) static_cast<void>(flight_.release());
}

std::size_t BulkStream::start(std::size_t transfers) {
  while (flight_->transfers.size() < transfers) flight_->add_transfer();
  for (; transfers > 0; transfers /= 2) {
    flight_->stopping = false;
    flight_->trouble = none;
    flight_->failures_in_row = 0;
    if (submit_all(transfers)) return transfers;
    if (!stop()) break;
  }
  throw DeviceError(device_.name(), "cannot start transfers", LIBUSB_ERROR_NO_MEM);
}

// False where the kernel has no room for so many transfers.
bool BulkStream::submit_all(std::size_t transfers) {
  const std::span all(flight_->transfers);
  return std::all_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(transfers),
                     [&](const Transfer& each) { return submit_first(*each.transfer); });
}

bool BulkStream::submit_first(libusb_transfer& transfer) {
  ++flight_->flying;
  const int code = libusb_submit_transfer(&transfer);
  if (code == 0) return true;
  --flight_->flying;
  if (code != LIBUSB_ERROR_NO_MEM) device_.check(code, "cannot start transfers");
  return false;
}

bool BulkStream::stop() {
  using namespace std::chrono_literals;
  flight_->stopping = true;
  const auto deadline = std::chrono::steady_clock::now() + 1s;
  while (flight_->flying.load(std::memory_order_acquire) > 0) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    // Cancelled in every round: a callback may have been about to submit a transfer.
    for (Transfer& each : flight_->transfers) libusb_cancel_transfer(each.transfer.get());
    flight_->wake.wait_for(10ms);
  }
  return true;
}

unsigned BulkStream::trouble() const { return flight_->trouble; }

std::uint32_t BulkStream::stalls() const { return flight_->stalls; }

const char* BulkStream::last_failure() const {
  return transfer_status_name(static_cast<std::size_t>(flight_->last_failure.load()));
}

}  // namespace splid::usb
