#pragma once

#include <chrono>
#include <stop_token>
#include <thread>

#include "drivers/source.hpp"

namespace splid {

// Waits half a second before an instrument is tried again, with signs of life to the sink. Returns
// within 10 ms of a stop request.
inline void wait_between_tries(TagSink& sink, const std::stop_token& stop) {
  constexpr std::chrono::milliseconds between_signs{10};
  for (std::chrono::milliseconds left{500}; left.count() > 0 && !stop.stop_requested();
       left -= between_signs) {
    sink.publish(0);
    std::this_thread::sleep_for(between_signs);
  }
}

}  // namespace splid
