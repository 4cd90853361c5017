#pragma once

#include <string>

#include "daemon/security/curve_key.hpp"

namespace splid {

// Files of keys, as CZMQ and pyzmq call certificates and read them: lines of ZPL (RFC 4/ZPL) among
// which are public-key = "Z85" and, in the secret one, secret-key = "Z85"; others are passed over.
//
// Errors of all that read: Error(Fault::usage) with the file and what to do. A service that has one
// does not start, and is not started again.

// FOLDER/NAME.key and FOLDER/NAME.key_secret.
struct KeyFiles {
  std::string public_file;
  std::string secret_file;
};

// Writes both, the secret one for its owner alone (0600), whatever the umask, and only where
// neither is there; none stays where one could not be written.
// name: letters, digits, dot, dash and underscore, the first a letter or a digit.
// Errors: Error(Fault::usage) for a name that is none and for files that are there;
// Error(Fault::device) where they cannot be written.
KeyFiles write_key_files(const std::string& folder, const std::string& name,
                         const CurveKeyPair& keys);

// Of a file that its owner alone may read (guarded_file.hpp). Its public key, if it says one, has
// to be that of its secret key.
CurveKeyPair read_secret_key(const std::string& file);

// text: a public key itself, or a file with one.
std::string read_public_key(const std::string& text);

// What read_secret_key() finds in a file's text.
CurveKeyPair parse_secret_key(const std::string& text, const std::string& file);
std::string parse_public_key(const std::string& text, const std::string& file);

}  // namespace splid
