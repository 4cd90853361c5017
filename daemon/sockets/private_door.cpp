#include "daemon/sockets/private_door.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <zmq.hpp>

#include "protocol/error.hpp"

namespace splid::sockets {
namespace {

constexpr int door_backlog = 128;

[[noreturn]] void fail(const std::string& call) {
  throw Error(Fault::device,
              "a socket of splid's own: " + call + ": " + std::generic_category().message(errno));
}

sockaddr_un address_of(const std::string& file) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (file.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    fail(file);
  }
  file.copy(address.sun_path, file.size());
  return address;
}

// The folder that the socket's file is in for a moment. The service manager removes a service's
// runtime directory when the service ends, however it ends.
std::string folder_of_moment() {
  for (const char* variable : {"RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"}) {
    const char* folder = std::getenv(variable);
    if (folder != nullptr && folder[0] == '/' && ::access(folder, W_OK) == 0) return folder;
  }
  std::error_code error;
  const auto folder = std::filesystem::temp_directory_path(error);
  return error ? "/tmp" : folder.string();
}

// A folder that only its owner may enter, with the socket's file in it. Both are removed when this
// goes out of scope.
class OwnFolder {
 public:
  OwnFolder() : folder_(folder_of_moment() + "/splid-XXXXXX") {
    if (::mkdtemp(folder_.data()) == nullptr) fail("mkdtemp " + folder_);
    file_ = folder_ + "/gate";
  }
  ~OwnFolder() {
    ::unlink(file_.c_str());
    ::rmdir(folder_.c_str());
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;

  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  std::string folder_;
  std::string file_;
};

FileDescriptor unix_socket() {
  return FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
}

}  // namespace

PrivateDoor::PrivateDoor(zmq::socket_t& socket) {
  const OwnFolder folder;
  const sockaddr_un address = address_of(folder.file());
  FileDescriptor listener = unix_socket();
  if (!listener.is_open()) fail("socket");
  if (::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    fail("bind");
  }
  if (::listen(listener.get(), door_backlog) != 0) fail("listen");
  inode_ = FileDescriptor(::open(folder.file().c_str(), O_PATH | O_CLOEXEC));
  if (!inode_.is_open()) fail("open");
  try {
    socket.set(zmq::sockopt::use_fd, listener.release());
    socket.bind("ipc://" + folder.file());
    socket.set(zmq::sockopt::use_fd, -1);
  } catch (const zmq::error_t& error) {
    throw Error(Fault::device, std::string("a socket of splid's own: ") + error.what());
  }
}

FileDescriptor PrivateDoor::connect() const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::snprintf(address.sun_path, sizeof address.sun_path, "/proc/self/fd/%d", inode_.get());
  FileDescriptor socket = unix_socket();
  if (!socket.is_open()) return socket;
  {
    // libzmq needs one more descriptor for its end of the connection, and would try without a pause
    // if there were none.
    const FileDescriptor spare(::fcntl(inode_.get(), F_DUPFD_CLOEXEC, 0));
    if (!spare.is_open()) return {};
  }
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    socket.reset();
  }
  return socket;
}

}  // namespace splid::sockets
