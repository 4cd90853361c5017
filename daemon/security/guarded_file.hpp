#pragma once

#include <string>

namespace splid {

// Files on which it rests who gets in. Each of these reads the whole of one and refuses it where
// others than its owner could have written it, or put another in its place: the file, each folder
// on the way to it from the root, and each link on that way have to belong to root or to who runs
// this program, and the modes of file and folders may let neither group nor others write, unless a
// folder is sticky as /tmp is.
//
// Errors: Error(Fault::usage) with the file, what is wrong and the command that mends it. A name
// that looks like a key is not shown.

std::string read_unforgeable_file(const std::string& file);

// Refused also where group or others may read it. What the service manager put into
// $CREDENTIALS_DIRECTORY is guarded by it, in ways that a mode does not show (an access control
// list's mask looks like a group's), and taken as it is.
std::string read_secret_file(const std::string& file);

}  // namespace splid
