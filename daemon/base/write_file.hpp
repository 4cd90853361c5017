#pragma once

#include <string>
#include <string_view>

namespace splid {

// Writes all of `text` to an open file; false where a part is not written, and errno says why.
bool write_all(int file, std::string_view text);

// Writes a whole file. An existing file is replaced, and stays unchanged where writing fails.
// Errors: Error(Fault::device) with the file and the errno text.
void write_file(const std::string& file, const std::string& text);

// Checks that a result can be written to `file`, before a command does something that it cannot
// take back, such as having a generator play. force: the command's --force. Errors:
// Error(Fault::usage) where `file` exists and `force` is false; Error(Fault::device) where its
// folder does not exist or the file cannot be written.
void check_may_write(const std::string& file, bool force);

// Checks that the folder of `file` exists, before minutes of work for a result in that file. Does
// nothing for an empty name. Errors: Error(Fault::device) where the folder does not exist.
void check_folder_of(const std::string& file);

}  // namespace splid
