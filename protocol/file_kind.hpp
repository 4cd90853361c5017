#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace splid {

// What a file seems to be, to be told to a person who named it where another kind was expected.
struct FileKind {
  std::string_view what;  // with its article: "a PTU recording"
  std::string_view next;  // what to do with it, an imperative without a stop

  friend bool operator==(const FileKind&, const FileKind&) = default;
};

// What to do with a recording of any format that splid reads.
inline constexpr std::string_view recording_next = "splid check tells what is in it";
inline constexpr FileKind config_file_kind = {"a splid configuration", "give it as --config"};
inline constexpr FileKind pattern_file_kind = {"a splid pattern",
                                               "name it in a configuration, as /pattern/file"};
inline constexpr FileKind truth_file_kind = {"the truth of a simulated scene",
                                             "splid listen --truth compares frames with it"};

// Tells a file's kind by its first bytes, and by the ending of its name where a format has no mark
// of its own. Absent where neither tells the kind. start: the file's first bytes; of a JSON file as
// many as reach to its "schema".
//
// Threads: any. Errors: none.
std::optional<FileKind> kind_of_file(std::string_view start, std::string_view name = {});

// "is a PTU recording, but a pattern file is expected here; splid check tells what is in it", or
// empty where the file's kind is not known. expected: with its article.
std::string misplaced_file(std::string_view start, std::string_view name,
                           std::string_view expected);

}  // namespace splid
