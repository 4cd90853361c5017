#include "daemon/stream/source_thread.hpp"

#include <pthread.h>

#include <utility>

namespace splid {
namespace {

// Closes the ring also when the source fails, so that the tags that it sent before become frames.
template <class Sink>
void run_into(Sink&& sink, TagSource& source, const std::stop_token& stop) {
  try {
    source.run(sink, stop);
  } catch (...) {
    sink.finish();
    throw;
  }
  sink.finish();
}

}  // namespace

SourceThread::SourceThread(TagSource& source, TagRing& ring, std::stop_token stop)
    : dropping_(source.info().live ? std::make_unique<DroppingSink>(ring, destroyed_.get_token())
                                   : nullptr),
      thread_([this, &source, &ring, stop = std::move(stop)] { run(source, ring, stop); }) {}

SourceThread::~SourceThread() {
  destroyed_.request_stop();
  join();
}

void SourceThread::join() {
  if (thread_.joinable()) thread_.join();
}

void SourceThread::run(TagSource& source, TagRing& ring, const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "source");
  // Stops at the caller's request, and when this object is destroyed, since then nobody reads the
  // ring any more.
  const std::stop_callback pass_on(stop, [this] { destroyed_.request_stop(); });
  const std::stop_token either = destroyed_.get_token();
  try {
    if (dropping_) {
      run_into(*dropping_, source, either);
    } else {
      run_into(WaitingSink(ring, either), source, either);
    }
  } catch (...) {
    fault_ = std::current_exception();
    ring.close();
  }
}

}  // namespace splid
