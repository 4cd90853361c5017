#include "daemon/source_thread.hpp"

#include <pthread.h>

#include <utility>

namespace splid {
namespace {

template <class Sink>
std::exception_ptr run_into(Sink& sink, TagSource& source, const std::stop_token& stop) {
  std::exception_ptr fault;
  try {
    source.run(sink, stop);
  } catch (...) {
    fault = std::current_exception();
  }
  sink.finish();
  return fault;
}

}  // namespace

SourceThread::SourceThread(TagSource& source, TagRing& ring, std::stop_token stop)
    : thread_([this, &source, &ring, stop = std::move(stop)] { run(source, ring, stop); }) {}

SourceThread::~SourceThread() {
  destroyed_.request_stop();
  join();
}

void SourceThread::join() {
  if (thread_.joinable()) thread_.join();
}

void SourceThread::run(TagSource& source, TagRing& ring, const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "source");
  // Either the caller's request, or this object's end, where nobody reads the ring any more.
  const std::stop_callback pass_on(stop, [this] { destroyed_.request_stop(); });
  const std::stop_token either = destroyed_.get_token();
  if (source.info().live) {
    DroppingSink sink(ring, either);
    fault_ = run_into(sink, source, either);
  } else {
    WaitingSink sink(ring, either);
    fault_ = run_into(sink, source, either);
  }
}

}  // namespace splid
