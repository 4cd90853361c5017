#pragma once

#include <cstdint>
#include <string>
#include <vector>

// The room batch/ measures many recordings, on many machines at a time, to one table each. Open
// this file first. Its parts:
//   batch_list.hpp      which recordings, and which part of them a shard measures
//   batch_folder.hpp    the files in the output folder, and the measured slices among them
//   slice_choice.hpp    which frames of a recording are in that part
//   measure_part.hpp    from a recording to slices
//   merge_slices.hpp    from slices to a table, and the summary
//
// Design note: a frame depends on all frames before it: it begins where the frame before it ended,
// the pattern's clock starts from the period before, and dead time looks back to photons of the
// frame before. So every shard cuts its recordings into frames from their begin, and estimates the
// frames of its own part alone. This needs no index that shards would have to wait for, and gives
// the same bits by construction, whoever measures what. It costs the cutting of the frames before,
// once for each shard: in a scene with few photons and every sync as long as their estimation.

namespace splid::batch {

struct Recording {
  std::string file;         // as it was given, or found in a folder that was given
  std::string name;         // its table is NAME.h5 in the output folder
  std::uint64_t bytes = 1;  // at least 1, also where the file cannot be read
  std::uint64_t begin = 0;  // bytes of the recordings before it
};

// The recordings that a command line names. Of a folder these are all files in it and in the
// folders below it that are named as recordings are, sorted by their path. A recording that cannot
// be opened is listed all the same, so that it is named where it fails. Errors: Error(Fault::usage)
// where a folder has no recording, and where two recordings would have one table.
std::vector<Recording> find_recordings(const std::vector<std::string>& given);

// One of `count` shares of a batch, which together are the whole, numbered from 1.
struct Shard {
  std::uint64_t index = 1;
  std::uint64_t count = 1;
};

// Reads "3/7". Errors: Error(Fault::usage) where that is not what the text says.
Shard shard_of(const std::string& text);

// Bytes [begin, end) of a recording: a share of it, by which the frames are dealt out. A slice of
// frames belongs to the part in which its first record stands.
struct Part {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
  [[nodiscard]] std::uint64_t bytes() const { return end - begin; }
};

// A shard's part of a recording; empty where it has none. The parts of all shards are the whole
// recording and do not overlap. all_bytes: of all recordings.
Part part_of(const Shard& shard, const Recording& recording, std::uint64_t all_bytes);

std::uint64_t bytes_of(const std::vector<Recording>& recordings);

}  // namespace splid::batch
