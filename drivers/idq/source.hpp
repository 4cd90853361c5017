#pragma once

#include "drivers/device_news.hpp"
#include "drivers/idq/options.hpp"
#include "drivers/source.hpp"

namespace splid::idq {

// The times of an ID900 or ID1000 Time Controller of ID Quantique's as tags: all inputs, that of
// the pattern's syncs too, are photons of the input's number, which channels.sync may name.
//
// The instrument hands out times at the end of each sub-acquisition, of 200 ms or more. So tags
// come later than the events by the length of a sub-acquisition and some 0.1 s.
//
// While the instrument or the data link program does not answer, they are tried again twice a
// second, for ever. Messages that are no times, somebody who stops the measurement, and a data link
// program that begins anew cost a new measurement: a loss from the last tag on, and a clock that
// begins anew.
//
// It reports no_device where one of the two does not answer; failing, with their words, where they
// refuse something or no sub-acquisition comes for 2 s; connected otherwise.
//
// Threads: as TagSource. Errors: none from run().
class Source final : public TagSource {
 public:
  Source(Options options, const SourceContext& context);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;

 private:
  void measure(TagSink& sink, const std::stop_token& stop);

  Options options_;
  DeviceNews news_;
};

}  // namespace splid::idq
