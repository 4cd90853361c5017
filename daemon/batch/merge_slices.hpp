#pragma once

#include <string>
#include <vector>

#include "daemon/batch/batch_folder.hpp"
#include "daemon/batch/batch_list.hpp"

namespace splid::batch {

enum class State {
  done,        // its table is made
  failed,      // it cannot be measured
  unfinished,  // slices are missing that may still come
};

// What became of a recording.
struct Outcome {
  Recording recording;
  State state = State::unfinished;
  std::string why;    // a sentence, where it is not done
  std::string lines;  // where it is done: as RecordingSummary::lines()
};

// Makes the table of a recording whose slices are all there, and removes these. Does nothing where
// the table is made already. Errors: Error(Fault::device) where a file cannot be written or read.
Outcome merge_slices(const Folder& folder, const Recording& recording);

// The summary of a batch: a line of comma-separated text for each recording, of several
// pixels one for each pixel, with a head. Has the
// same bytes whoever measured what, and in which order.
std::string summary_text(const std::vector<Outcome>& outcomes);

// Merges all recordings of the folder and writes the summary. Errors: as merge_slices();
// Error(Fault::usage) where the folder is not that of a batch.
std::vector<Outcome> merge_folder(const Folder& folder);

}  // namespace splid::batch
