#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "drivers/bridge/bridge.hpp"
#include "tests/support/shared_sink.hpp"

namespace splid::test {

// A bridge's source on a thread of its own, stopped when it goes out of scope.
class RunningBridge {
 public:
  explicit RunningBridge(const std::string& address) {
    BridgeOptions options;
    options.address = address;
    SourceContext context;
    context.report = [this](const DeviceReport& report) { reports.add(report); };
    source_ = options.open(context);
    thread_ = std::jthread([this](const std::stop_token& stop) { source_->run(sink, stop); });
  }

  [[nodiscard]] SourceInfo info() const { return source_->info(); }
  [[nodiscard]] std::uint64_t counter(const std::string& name) const {
    for (const SourceCounter& counter : source_->counters()) {
      if (counter.name == name) return counter.value;
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }

  SharedSink sink;
  ReportList reports;

 private:
  std::unique_ptr<TagSource> source_;
  std::jthread thread_;
};

}  // namespace splid::test
