#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>

#include "config/config.hpp"
#include "daemon/batch/batch_folder.hpp"
#include "daemon/batch/batch_list.hpp"
#include "daemon/batch/slice_choice.hpp"

namespace splid::batch {

// By what the recordings of a batch are measured.
class Meter {
 public:
  // config: as it was read; its source is not used. jobs: frames that are estimated at the same
  // time, which changes no bit of them. With estimator.tracked, where it would, as many as the
  // configuration says.
  Meter(Config config, std::int64_t jobs, Slicing slicing);

  [[nodiscard]] const Facts& facts() const { return facts_; }

  // Called some times a second with how far the frames have come in the recording, bytes.
  using Reach = std::function<void(std::uint64_t position)>;

  // Measures a part of a recording into slices in `folder`, but for those that are there already,
  // and does nothing where the part is measured. Where the part has the recording's begin, the
  // recording's checksum is computed meanwhile. Returns false after a stop request; whole slices
  // are kept.
  //
  // Threads: the caller's, and those of a Stream. Errors: Error(Fault::data) where the recording
  // cannot be measured; others where no recording could be.
  bool measure(const Recording& recording, const Part& part, const Folder& folder,
               const Reach& reach, const std::stop_token& stop);

  // Whether that part needs no measuring any more. Errors: as batch::Folder::key_of().
  [[nodiscard]] bool is_measured(const Recording& recording, const Part& part,
                                 const Folder& folder) const;

 private:
  void read_next(const Recording& recording);
  bool measure_slices(const Recording& recording, const Part& part, const Folder& folder,
                      const std::string& key, const Reach& reach, const std::stop_token& stop);

  Config config_;
  const EncoderOptions encoder_;    // as configured
  const PipelineOptions pipeline_;  // as configured
  std::int64_t jobs_;
  Slicing slicing_;
  Facts facts_;
};

}  // namespace splid::batch
