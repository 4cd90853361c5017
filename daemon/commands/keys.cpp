#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "daemon/commands/commands.hpp"
#include "daemon/security/key_file.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

struct KeysCommand {
  std::string folder = ".";
  std::string name = "splid";
};

int make_keys(const KeysCommand& options) {
  const security::CurveKeyPair keys = security::make_curve_keys();
  const security::KeyFiles files = security::write_key_files(options.folder, options.name, keys);
  const std::string secret = shown_text(files.secret_file, most_said);
  const std::string open = shown_text(files.public_file, most_said);
  std::printf("%s\n", keys.public_key.c_str());
  std::fprintf(stderr,
               "%s: secret, readable by you alone; it stays on this machine:\n"
               "    of a server: \"security\":{\"server_key\":\"%s\",...}\n"
               "    of a viewer: splid listen --key %s --server-key ...\n"
               "%s: public, for the other side:\n"
               "    of a server: splid listen --server-key %s ...\n"
               "    of a viewer: a line in the server's security.allow_list:\n"
               "    %s %s\n",
               secret.c_str(), secret.c_str(), secret.c_str(), open.c_str(), open.c_str(),
               keys.public_key.c_str(), shown_text(options.name, most_said).c_str());
  return 0;
}

}  // namespace

void add_keys(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("keys", "Make a pair of keys for encrypted connections");
  const auto options = std::make_shared<KeysCommand>();
  command
      ->add_option("name", options->name, "Name of the files NAME.key (public) and NAME.key_secret")
      ->capture_default_str();
  command->add_option("--output,-o", options->folder, "Folder for the files")
      ->capture_default_str();
  command->callback([&action, options] { action = [options] { return make_keys(*options); }; });
}

}  // namespace splid
