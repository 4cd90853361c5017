#pragma once

#include <string>

#include "daemon/security/curve_key.hpp"

namespace splid::security {

// Files of keys, which CZMQ and pyzmq read too and call certificates: lines of ZPL (RFC 4/ZPL). The
// line public-key = "Z85" gives the public key; in a secret file, secret-key = "Z85" gives the
// secret key. Other lines are passed over.
//
// Errors of all functions that read: Error(Fault::usage) with the file and what to do. A service
// whose key file is wrong does not start, and the service manager does not try again.

// FOLDER/NAME.key and FOLDER/NAME.key_secret.
struct KeyFiles {
  std::string public_file;
  std::string secret_file;
};

// Writes both files. The secret file is readable by its owner alone (0600), whatever the umask.
// Does nothing where one of the files exists already; leaves neither file where one cannot be
// written. name: letters, digits, dot, dash and underscore; begins with a letter or a digit.
// Errors: Error(Fault::usage) for any other name and for files that exist; Error(Fault::device)
// where a file cannot be written.
KeyFiles write_key_files(const std::string& folder, const std::string& name,
                         const CurveKeyPair& keys);

// Reads both keys from a secret file, which only its owner may read (guarded_file.hpp). A public
// key in the file has to belong to its secret key.
CurveKeyPair read_secret_key(const std::string& file);

// text: a public key itself, or the name of a file with a public key.
std::string read_public_key(const std::string& text);

// The keys in a file's text. file: the name for errors.
CurveKeyPair parse_secret_key(const std::string& text, const std::string& file);
std::string parse_public_key(const std::string& text, const std::string& file);

}  // namespace splid::security
