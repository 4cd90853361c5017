#pragma once

#include <string>

namespace splid::security {

// Reading files that decide who gets in. The first two functions read a whole file, and refuse a
// file that somebody else could have written or replaced. The file, each folder on the way to it
// from the root, and each link on that way have to belong to root or to the user who runs this
// program. The modes of the file and of the folders may let neither group nor others write, except
// for a sticky folder such as /tmp.
//
// Each file is a regular file of at most 1 MiB. Errors: Error(Fault::usage) with the file, what is
// wrong with it and the command that mends it. A file name that looks like a key is not shown.

std::string read_unforgeable_file(const std::string& file);

// Also refuses a file that group or others may read. A file in $CREDENTIALS_DIRECTORY is taken
// unchecked: the service manager guards it in ways that a mode does not show (the mask of an access
// control list looks like a permission of the group).
std::string read_secret_file(const std::string& file);

// A file of a public key, which a person names: whoever owns it.
std::string read_public_file(const std::string& file);

}  // namespace splid::security
