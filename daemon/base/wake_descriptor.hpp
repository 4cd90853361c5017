#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

namespace splid {

// Wakes a thread that waits in a poll of descriptors: the thread polls get(), another thread calls
// notify().
//
// Threads: any for notify() and clear().
class WakeDescriptor {
 public:
  WakeDescriptor() : descriptor_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  ~WakeDescriptor() { ::close(descriptor_); }
  WakeDescriptor(const WakeDescriptor&) = delete;
  WakeDescriptor& operator=(const WakeDescriptor&) = delete;

  void notify() const { (void)::eventfd_write(descriptor_, 1); }
  void clear() const {
    eventfd_t count = 0;
    (void)::eventfd_read(descriptor_, &count);
  }
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace splid
