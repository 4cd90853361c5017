#pragma once

#include <chrono>
#include <string>

#include "drivers/device_news.hpp"
#include "drivers/picoquant/call_watch.hpp"
#include "drivers/picoquant/library.hpp"
#include "drivers/picoquant/options.hpp"
#include "drivers/source.hpp"

namespace splid::picoquant {

// The tags of an instrument of PicoQuant's, measured in T2 mode by the maker's library and decoded
// as those of a PTU recording. Inputs have the numbers of the panel, and the sync and the markers
// are those of the records.
//
// While the instrument or the library is not there, it is tried again twice a second, for ever.
// A FIFO that was full, records that are none, and the end of the longest measurement (100 h) cost
// a new measurement: a loss from the last tag on, and a clock that begins anew.
//
// It reports no_device while the instrument is unplugged, in use or not found; failing, with what
// the library says, where something else is wrong, and where nothing comes for 200 ms; connected
// otherwise. The library's warnings and the instrument's flags are its caution.
//
// Threads: as TagSource; overdue_call() may be called from any. Errors: none from run().
class Source final : public TagSource {
 public:
  Source(Options options, const SourceContext& context);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;
  // The call into the library that hangs; empty where none does.
  [[nodiscard]] std::string overdue_call() const;

  // Nothing, not even a wrap of the clock, came for so long. Then the instrument is opened anew.
  static constexpr std::chrono::milliseconds silence_told{200};
  static constexpr std::chrono::milliseconds silence_ended{2000};

 private:
  [[nodiscard]] std::string named(const LibraryError& error) const;

  Options options_;
  DeviceNews news_;
  CallWatch watch_;
  std::string serial_;  // of the instrument that the stream stays with; empty: any
};

}  // namespace splid::picoquant
